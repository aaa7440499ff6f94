#pragma once
// What a DesignEvaluator knows, for the files that it is made of: evaluation.cpp and, with gradients, sloped_evaluation.cpp.
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <vector>

#include "design/architecture_start.h"
#include "design/evaluation.h"

namespace bielle {

struct DesignEvaluator::Data {
  struct Base {
    std::once_flag made;
    std::optional<ArchitectureStart> start;
  };

  Parametrization robot;
  std::vector<DesignMotion> motions;
  std::vector<ObjectiveTerm> objective;
  EvaluationOptions options;
  double weight = 0;  // W, of the objectives
  std::set<Measure> requested;
  Evaluation start;
  std::mutex mutex;
  std::map<std::vector<int>, std::unique_ptr<Base>> bases;  // by architecture

  // Whether motions of the start design are transferred to other designs.
  bool mustKeep() const { return options.mode == MotionMode::Kept || options.margin > EvaluationOptions().margin; }
  void checkSpec();
  void solveStart();
  // Of the motions, in an objective and in a constraint on a measure; empty: 1.
  std::vector<double> listWeights() const;
  std::vector<double> listWeights(const DesignConstraint& constraint) const;
  // The start of the architecture of x, made if need be. Called by several threads.
  const ArchitectureStart& getBase(const VectorXd& x);
  void makeMotions(const ArchitectureStart& base, const Model& model, Evaluation& out,
                   std::vector<MotionOutcome>* outcomes = nullptr) const;
  // Adds a motion with the measures of its limits, or why it was not made, which the result tells. `missing`: the share
  // of all motions so far.
  bool addMotion(const std::string& name, const ArchitectureStart& base, double missing,
                 const ShootingTrajectory& trajectory, MotionOutcome& outcome, Evaluation& out) const;
  // \param made  the robot without payload, if it is requested
  Evaluation evaluate(const VectorXd& x, std::vector<MotionOutcome>* outcomes = nullptr,
                      std::optional<Model>* made = nullptr);
  MeasurePieces calcStartMargins(const ArchitectureStart& base, const Model& model, const VectorXd& x) const;
  MeasurePieces calcPieces(size_t i, const ArchitectureStart& base, const std::vector<MotorSlopes>& slopes,
                           const RobotSlopes& robot_slopes) const;
  MeasurePieces calcLimits(const ArchitectureStart& base, const std::vector<MotorSlopes>& slopes,
                           const RobotSlopes& robot_slopes) const;
  bool checkPostures(const ArchitectureStart& base, const Model& model, Evaluation& out) const;
  double calcTerm(size_t i, const ArchitectureStart& base, const Model& model, JointWays& ways,
                  const std::vector<MotionMeasures>& measures) const;
  void checkConstraints(const ArchitectureStart& base, const Model& model, JointWays& ways, Evaluation& out) const;
  void sumUp(const ArchitectureStart& base, const Model& model, Evaluation& out) const;
};

}  // namespace bielle
