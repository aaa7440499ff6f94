#pragma once
/// \file The value of a design: the measures of its motions relative to those of the start design.
///
/// With m_i the measures of a design and m_i0 those of the start, the value of a feasible design is
///     f = sum_i w_i m_i / m_i0,                                                                                    (1)
/// W = sum_i w_i at the start. The measure of a workspace is the inverse of the share that is reached, at least half a point.
/// Infeasible designs are not errors; their values are
///     f = 2 W + W mean_p min(1, 10 g_p)      some posture p of the start's motions cannot be taken                 (2)
///     f = 1.5 W + 0.5 W s                    all can, but a motion could not be made                               (3)
/// with g_p (m or rad) the largest closing error that is left when loops, base and feet should be where they are in
/// posture p, and s in (0, 1] the share of the motion that is missing (kept motions), else 1. (2) is continuous in
/// the design, so that searches return to designs whose loops close.
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bielle/design/parametrization.h"
#include "bielle/motion/motion.h"
#include "design/gradient.h"
#include "design/measures.h"
#include "design/workspace.h"

namespace bielle {

struct DesignMotion {
  std::string name;
  std::function<MotionPlan(const Model&, const VectorXd& q0)> plan;  ///< called by several threads
};

enum class MotionMode {
  Reoptimized,  ///< solved for the design, from the solution of the start design
  Kept          ///< postures and accelerations of the start design; motors recomputed (transmission/lift.h)
};
const char* getName(MotionMode mode);

struct ObjectiveTerm {
  Measure measure = Measure::PeakTorque;
  std::vector<std::string> motors;  ///< empty: all
  double weight = 1;                ///< w_i
  WorkspaceRegion region = {};      ///< of the workspace, which has no motors
};

struct EvaluationOptions {
  MotionMode mode = MotionMode::Reoptimized;
  FddpOptions solver = makeSolverOptions();
  int postures = 6;  ///< of each motion, for (2)
  DriveTable drives;
  /// Kept motions whose linkages come nearer to a dead point are none (LiftOptions::singular): the least that a joint
  /// moves in a unit motion of its linkage.
  double margin = 1e-3;

  /// Engineering tolerances: a solve ends when its cost changes by less than 1e-8 of itself. One thread.
  static FddpOptions makeSolverOptions();
};

/// The reason why the value of designs has no gradient, and the remedy.
struct GradientObstacle {
  std::string problem, remedy;
};
/// Nothing where motions are kept and every measure has a gradient.
std::optional<GradientObstacle> findGradientObstacle(MotionMode mode, const std::vector<ObjectiveTerm>& objective);

enum class DesignStatus { Feasible, LoopOpen, MotionFailed };
const char* getName(DesignStatus status);

struct Evaluation {
  DesignStatus status = DesignStatus::Feasible;
  double value = 0;                     ///< f
  std::vector<double> terms;            ///< m_i, when feasible
  std::vector<MotionMeasures> motions;  ///< when feasible
  std::string message;                  ///< why not feasible
};

/// An evaluation and how its terms change.
struct SlopedEvaluation {
  Evaluation evaluation;
  /// w_i m_i / m_i0 of Eq. (1) in pieces; also of designs whose motions come too near to dead points, none of other
  /// infeasible ones.
  std::vector<MeasurePieces> terms;
  MeasurePieces limits;  ///< a hundredth tighter than EvaluationOptions::margin, <= 0
};

/// Makes the motions of the start design when it is made; designs are then evaluated each by itself, so that the result
/// does not depend on the order, by any number of threads at a time.
class DesignEvaluator {
 public:
  /// \throws ModelError when the start design cannot make the motions, or the objective names unknown motors
  DesignEvaluator(const Parametrization& robot, std::vector<DesignMotion> motions, std::vector<ObjectiveTerm> objective,
                  const EvaluationOptions& options = {});
  ~DesignEvaluator();

  Evaluation evaluate(const VectorXd& x) const;
  /// The same with gradients (gradient.h). Where they do not exist, as at a dead point, the design counts as one whose
  /// motion fails.
  /// \throws ModelError when motions are not kept, or a measure has no gradient
  SlopedEvaluation differentiate(const VectorXd& x) const;
  const Evaluation& start() const;  ///< of the start design
  const Parametrization& robot() const;
  const std::vector<DesignMotion>& motions() const;
  const std::vector<ObjectiveTerm>& objective() const;

 private:
  struct Data;
  std::unique_ptr<Data> data_;
};

}  // namespace bielle
