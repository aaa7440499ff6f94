#pragma once
// The constraints of a shooting problem, by an augmented Lagrangian (docs/solver.md, Eqs. 10 to 14).
#include "bielle/solve/fddp.h"
#include "solve/lq_sweep.h"
#include "solve/node_evaluations.h"

namespace bielle {

class AugmentedLagrangian {
 public:
  /// Reads the bounds of the problem. Starts with the initial penalty and zero multipliers, unless setMultipliers() or
  /// move() has provided others since the last call.
  /// \throws std::invalid_argument if a lower bound exceeds the upper one
  void resize(const ShootingProblem& problem, const ConstraintOptions& options);
  bool isEmpty() const { return rows_ == 0; }

  /// Contribution of one node to the merit, Eq. (10).
  double calc(int node, const VectorXd& c) const;
  /// Computes the weights of Eq. (11) and the measures below at the current iterate.
  void evaluate(const EvaluationList& iterate);
  /// Marks the rows of a node that have weights. Returns whether one was not marked before.
  bool addWeighted(int node, std::vector<char>& rows) const;
  /// Null if the node has no constraints.
  const ConstraintWeights* getWeights(int node) const { return rows_ > 0 ? nodes_[node].getWeights() : nullptr; }

  double getValue() const { return at_.value; }                   ///< sum of the contributions to Eq. (10)
  double violation() const { return at_.violation; }              ///< the largest
  double complementarity() const { return at_.complementarity; }  ///< Eq. (13), of the multipliers after Eq. (12)
  bool isSatisfied() const { return at_.violation <= options_.tolerance; }
  /// Whether constraints are violated, but so little that multipliers under a growing penalty should mend it.
  bool isNear() const;
  /// Whether violations alone are minimized, and outweigh `cost` so far that the least of them has been found.
  bool dominates(double cost) const;
  /// Whether multipliers should be updated, given the decrease that a full step promises under the present ones.
  bool isDue(double foreseen) const;

  /// Updates the multipliers, Eq. (12), raises the penalty if the violation has decreased too little since the last update,
  /// and evaluates again. Once the penalty has reached its maximum, the violations alone are minimized: without multipliers,
  /// under a penalty that dominates `cost`. Returns false if that has been done and has not reduced them: infeasible.
  bool updateMultipliers(const EvaluationList& iterate, double cost);
  /// Holds the rows that have a multiplier at their bounds (receding.h, Eq. 14) until the next evaluate().
  void hold(const EvaluationList& iterate);
  /// Holds the inequalities that a trial violates at the bounds that they violate there, and no others, Eq. (15): in the weights
  /// alone, and until the next evaluate(). Returns whether they are others than before.
  /// \param keep  those that are held, and add only the ones that a step towards the trial violates first
  bool holdViolated(const EvaluationList& iterate, const EvaluationList& trial, bool keep);
  /// What inequalities add to the value of a trial beyond what those that the weights hold add, as if they were equations.
  double calcKinks(const EvaluationList& iterate, const EvaluationList& trial);
  /// What these weights make of the iterate beyond getValue().
  double excess() const { return at_.excess; }
  /// Minimizes the violations alone from now on, as updateMultipliers() does in the end. False if that was so already.
  bool restore(const EvaluationList& iterate, double cost);
  /// Whether settle() makes sense: violations are not minimized on their own.
  bool canSettle() const { return !isEmpty() && !restoring_; }
  /// Eq. (12) under a constant penalty, of all nodes but the first, which are then held as by hold(); then of the first one. Between
  /// the two, move() takes back what the former did.
  void renewAhead(const EvaluationList& iterate);
  void renewFirst(const EvaluationList& iterate);
  /// Back to the multipliers before the last Eq. (12).
  void takeBack();
  /// Raises the penalty; once it is at its maximum, updates the multipliers if a full step has not halved the violation.
  /// Returns whether the violation has been halved.
  bool settle(const EvaluationList& iterate, bool full);
  /// Back to the penalty far from the solution.
  void endSettling(const EvaluationList& iterate);
  int numUpdates() const { return num_updates_; }
  /// Eq. (12) alone: at a stationary point, the multipliers of the constraints.
  void adoptMultipliers(const EvaluationList& iterate);

  double penalty() const { return penalty_; }
  double largestMultiplier() const;
  Multipliers multipliers() const;
  void setMultipliers(const Multipliers& multipliers);
  /// Multipliers of a window that has moved.
  void move(const std::vector<NodeSource>& sources);
  /// The row with the largest violation, e.g. "wrench cone of foot_left at node 12 is violated by 0.05".
  std::string describeWorst(const ShootingProblem& problem) const;

 private:
  struct Node {
    VectorXd lower, upper, multipliers, earlier;  // the latter before the last Eq. (12)
    ConstraintWeights weights;
    const ConstraintWeights* getWeights() const { return lower.size() > 0 ? &weights : nullptr; }
  };
  struct Measures {
    double value = 0, violation = 0, complementarity = 0;
    double gain = 0;     // increase of `value` by Eq. (12), to first order: |y+ - y|^2 / (2 rho)
    double squares = 0;  // sum of the squared violations
    double excess = 0;   // rho/2 times the sum of the squares of Eq. (15) less those of Eq. (10)
    int worst_node = 0, worst_row = 0;
  };
  bool isHeld(const Node& node, Eigen::Index row) const { return holds_ && node.multipliers[row] != 0; }
  double calcDistance(const Node& node, Eigen::Index row, double c) const;  // d of Eq. (10) or (14)
  double calcContribution(double d, double multiplier) const;
  struct Inequality {
    double &gradient, &hessian;  // of the weights
    double d;                    // of Eq. (15)
    double violation, before;    // d of Eq. (10), in the trial and at the iterate
    double move;                 // of c, from the iterate to the trial
  };
  template <class Visit>
  void visitInequalities(const EvaluationList& iterate, const EvaluationList& trial, const Visit& visit);
  void startRestoration(double cost);
  void measure(const EvaluationList& iterate);
  void measure(int node, const VectorXd& c, Measures& out);
  void renew(const EvaluationList& iterate, int node);

  ConstraintOptions options_;
  std::vector<Node> nodes_;
  std::vector<Node> moved_;  // memory of move()
  std::vector<int> takers_;  // likewise: of each node's memory
  Eigen::Index rows_ = 0;    // of all nodes
  bool holds_ = false;       // by Eq. (14)
  bool restoring_ = false;   // minimizes the violations alone
  bool kept_ = false;        // the next resize() keeps multipliers and penalty
  bool ahead_ = false;       // the first node still has to follow the others
  double penalty_ = 1;
  double far_penalty_ = 1;  // without what was added close to the solution; where the next solve starts
  Measures at_;
  double last_violation_ = 0;  // at the last update of the multipliers
  int num_updates_ = 0;
};

}  // namespace bielle
