#pragma once
/// \file The value of a design: the measures of its motions relative to those of the start design.
///
/// With m_i the measures of a design and m_i0 those of the start, the value of a feasible design is
///     f = sum_i w_i m_i / m_i0,                                                                                    (1)
/// W = sum_i w_i at the start. Measures of motions are multiplied by the weights of these before the largest is taken or all
/// are added, those in constraints only where they are added: other constraints hold for every motion as they are. Robots are
/// loaded with the payload of each motion; the mass of a robot is that without. What is better the larger stands in the objective
/// by its inverse: the share of a workspace, of at least half a point; the share of a range, of at least a hundredth; the least
/// ratio. Infeasible designs are not errors; their values are
///     f = 2 W + W mean_p min(1, 10 g_p)      some posture p of the start's motions is infeasible                   (2)
///     f = 1.5 W + 0.5 W s                    all are feasible, but a motion failed                                 (3)
///     f = 1.5 W + 0.5 W / (n + 1) V / (1 + V)        all n motions are made, but constraints are violated          (4)
///                                                    or goals are missed
/// with V the sum of the violations of constraints, each relative to its bound (in centimetres for a distance), and of
/// goals (bielle/motion/goal.h), by how much they are missed beyond their tolerance, relative to it; and with g_p (m or
/// rad) the largest closing error that remains when loops, base and feet are moved to posture p, and s in (0, 1] the
/// missing share of the motion (kept motions), else 1. (2) is continuous in the design, so that searches return to
/// designs whose loops close. So designs that violate constraints less are better than those that violate them more,
/// and these better than those without motions (Deb 2000, "An efficient constraint handling method for genetic
/// algorithms"). The start may violate constraints and miss goals.
///
/// Designs of other parts of a generator (Parametrization::getArchitecture) are other robots: postures and first motions are those of
/// the start with these parts, made when they are needed. Where the start with these parts cannot make a motion, it is solved for each
/// design from the guess of its plan, and no posture is checked.
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bielle/design/parametrization.h"
#include "design/constraint.h"
#include "design/design_motions.h"
#include "design/gradient.h"
#include "design/measures.h"
#include "design/workspace.h"

namespace bielle {

enum class MotionMode {
  Reoptimized,  ///< solved for the design, from the solution of the start design
  Kept          ///< postures and accelerations of the start design; motors recomputed (motion/lift.h)
};
const char* getName(MotionMode mode);

struct ObjectiveTerm {
  Measure measure = Measure::PeakTorque;
  std::vector<std::string> motors;  ///< empty: all
  double weight = 1;                ///< w_i
  WorkspaceRegion region = {};      ///< only for the workspace, which has no motors
  JointAngles range = {};           ///< only of a measure of joints, likewise
};

struct EvaluationOptions {
  MotionMode mode = MotionMode::Reoptimized;
  FddpOptions solver = makeSolverOptions();
  int postures = 6;  ///< of each motion, for (2)
  DriveTable drives;
  std::vector<DesignConstraint> constraints;
  /// Kept motions whose linkages come nearer to a dead point fail (LiftOptions::singular): least motion of a joint in a
  /// unit motion of its linkage. Where motions are made anew, a larger margin than this one limits searches with gradients to
  /// designs whose linkages could also follow the motions of the start design at that distance: their loops close.
  double margin = 1e-3;

  /// Engineering tolerances: a solve ends when its cost changes by a relative 1e-8 or less. One thread.
  static FddpOptions makeSolverOptions();
};

/// The reason why the value of designs has no gradient, and the remedy.
struct GradientObstacle {
  std::string problem, remedy;
};
/// Empty if every measure has a gradient, of the objective and of the constraints.
std::optional<GradientObstacle> findGradientObstacle(MotionMode mode, const std::vector<ObjectiveTerm>& objective,
                                                     const std::vector<DesignConstraint>& constraints);

/// A design that misses a goal may violate constraints as well.
enum class DesignStatus { Feasible, LoopOpen, MotionFailed, Violated, GoalMissed };
constexpr int kDesignStatuses = 5;
/// Whether the motions of such a design were made and measured.
inline bool isMeasured(DesignStatus status) {
  return status != DesignStatus::LoopOpen && status != DesignStatus::MotionFailed;
}
const char* getName(DesignStatus status);

/// Of one of the motions.
struct DesignGoal {
  std::string motion;
  GoalOutcome outcome;
};
std::string describeGoal(const DesignGoal& goal);  ///< e.g. "squat: depth"

struct Evaluation {
  DesignStatus status = DesignStatus::Feasible;
  double value = 0;                     ///< f
  std::vector<double> terms;            ///< m_i, if isMeasured(status)
  std::vector<MotionMeasures> motions;  ///< likewise
  std::vector<double> constraints;      ///< their measures, likewise
  std::string message;                  ///< reason if infeasible
  std::vector<DesignGoal> goals;        ///< requested and achieved, as the measures
  std::optional<double> margin = {};    ///< least one from dead points; none of a robot without serial joints
};

/// An evaluation and the gradients of its terms.
struct SlopedEvaluation {
  Evaluation evaluation;
  /// w_i m_i / m_i0 of Eq. (1) in pieces; also for designs whose motions come too near to dead points or that violate constraints,
  /// but empty for other infeasible ones.
  std::vector<MeasurePieces> terms;
  /// EvaluationOptions::margin and, of motions made anew, tolerances of goals, both a hundredth tighter; and
  /// constraints; <= 0
  MeasurePieces limits;
};

/// The constructor makes the motions of the start design. Designs are then evaluated independently, so that results do
/// not depend on the order, by any number of threads at a time.
class DesignEvaluator {
 public:
  /// \throws InputError when the motions of the start design fail, or the objective names unknown motors
  DesignEvaluator(const Parametrization& robot, std::vector<DesignMotion> motions, std::vector<ObjectiveTerm> objective,
                  const EvaluationOptions& options = {});
  ~DesignEvaluator();

  /// \param outcomes  if given, of the motions, in their order, as far as they were made
  Evaluation evaluate(const VectorXd& x, std::vector<MotionOutcome>* outcomes = nullptr) const;
  /// The same with gradients (gradient.h, motion_slopes.h). If they do not exist, as at a dead point, the design counts as one whose
  /// motion fails.
  /// \throws InputError when a measure has no gradient
  SlopedEvaluation differentiate(const VectorXd& x) const;
  /// The same with every motion as `bielle solve` makes it, by its usual steps and not from a motion of the start
  /// design. Its cost is that of another discretization.
  Evaluation solveUsually(const VectorXd& x) const;
  const Evaluation& start() const;  ///< of the start design, measured
  /// Pairs of bodies that constraints on distances leave out, of the architecture of x.
  std::vector<std::string> listLeftOut(const VectorXd& x) const;
  const Parametrization& robot() const;
  const std::vector<DesignMotion>& motions() const;
  const std::vector<ObjectiveTerm>& objective() const;
  const std::vector<DesignConstraint>& constraints() const;

 private:
  struct Data;
  std::unique_ptr<Data> data_;
};

}  // namespace bielle
