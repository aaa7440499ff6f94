#pragma once
// The constraints of a shooting problem, by an augmented Lagrangian (fddp.h, Eqs. 10 to 12).
#include "bielle/solve/fddp.h"
#include "solve/node_evaluations.h"

namespace bielle {

class AugmentedLagrangian {
 public:
  /// Bounds of the problem, the first penalty, and multipliers of zero; both are kept if they were given, or moved by advance().
  /// \throws std::invalid_argument where a lower bound exceeds the upper one
  void resize(const ShootingProblem& problem, const ConstraintOptions& options);
  bool isEmpty() const { return rows_ == 0; }

  /// The addend of Eq. (10) for one node.
  double calc(int node, const VectorXd& c) const;
  /// Eq. (11) about the current iterate, and how far it is from feasible.
  void update(const EvaluationList& iterate);
  /// Null if the node has no constraints.
  const ConstraintWeights* getWeights(int node) const { return rows_ > 0 ? nodes_[node].getWeights() : nullptr; }

  /// Of the iterate of the last update(): the sum of Eq. (10), the largest violation, and Eq. (13).
  double getValue() const { return value_; }
  double getViolation() const { return violation_; }
  double getComplementarity() const { return complementarity_; }
  bool isSatisfied() const { return violation_ <= options_.tolerance; }

  /// The share of getGain() that the foreseen decrease must have fallen to before raise() is due.
  double getShare() const { return restoring_ ? kRestorationShare : kShare; }
  /// Eq. (12), a larger penalty if the violation has fallen too little since the last time, then update(). When the penalty is
  /// at its largest, violations alone are minimized: without multipliers, under a penalty beside which `cost` hardly counts.
  /// False if even that is done and has not helped: the constraints are infeasible.
  bool raise(const EvaluationList& iterate, double cost);
  int getNumRaises() const { return num_raises_; }
  /// By how much Eq. (12) would lift the sum of Eq. (10): |y+ - y|^2 / (2 rho).
  double getGain() const { return gain_; }
  /// Eq. (12) once more at the end: with these multipliers the gradient vanishes.
  void settle();

  double getPenalty() const { return penalty_; }
  double getLargestMultiplier() const;
  Multipliers getMultipliers() const;
  /// To start from at the next resize().
  void setMultipliers(const Multipliers& multipliers);
  /// Node k becomes what node k + 1 was.
  void advance();
  /// The row that is violated most, e.g. "wrench cone of foot_left at node 12 is violated by 0.05".
  std::string describeWorst(const ShootingProblem& problem) const;

 private:
  static constexpr double kShare = 0.1, kRestorationShare = 1e-6;

  void startRestoration(double cost);

  struct Node {
    VectorXd lower, upper, multipliers;
    ConstraintWeights weights;
    const ConstraintWeights* getWeights() const { return lower.size() > 0 ? &weights : nullptr; }
    // d of Eq. (10)
    double calcDistance(double c, Eigen::Index row, double penalty) const;
  };

  ConstraintOptions options_;
  std::vector<Node> nodes_;
  Eigen::Index rows_ = 0;   // of all nodes
  bool restoring_ = false;  // minimizes violations alone
  bool kept_ = false;       // multipliers and penalty are those to start from
  double penalty_ = 1;
  double squares_ = 0;  // of the violations, summed
  double value_ = 0, gain_ = 0, violation_ = 0, complementarity_ = 0;
  int worst_node_ = 0, worst_row_ = 0;
  double last_violation_ = 0;  // at the last raise()
  int num_raises_ = 0;
};

}  // namespace bielle
