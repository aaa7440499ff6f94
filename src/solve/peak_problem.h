#pragma once
/// \file The least peak of the controls: a shooting problem whose controls stay within a common share of their limits.
///
/// From a shooting problem (the inner one) with controls u, and limits L_i > 0, infinite for controls that do not count,
///
///     min  sum_k l_k(x_k, u_k) + l_N(x_N) + weight s^2    s.t.  |u_i| <= s L_i  at every stage,    s <= most        (1)
///
/// besides the requirements of the inner problem. The share s is a control of the first stage and a state of all other
/// nodes, and the other controls are replaced by
///
///     u_i = s L_i w_i,   -1 <= w_i <= 1    (u_i = w_i, within its own bounds, where L_i is infinite).               (2)
///
/// Bounds of w do not depend on s, so that the solver satisfies them exactly. (2) is modelled
/// to first order: its second derivative, by s and w_i, belongs to the derivative of the Lagrangian by u_i, which at a
/// solution vanishes, unless w_i is at a bound and does not move. The cost is quadratic in s to give the model of s its
/// curvature.
#include <cmath>

#include "solve/wrapped_problem.h"

namespace bielle {

class PeakProblem : public WrappedProblem {
 public:
  /// \param inner  must outlive it
  /// \param limits  L, of the first controls of every stage; controls after them do not count
  /// \param weight  positive   \param most  largest s, may be infinite
  /// \throws std::invalid_argument when limits are not positive, none is finite, or weight or `most` is not positive
  PeakProblem(const ShootingProblem& inner, const VectorXd& limits, double weight, double most);

  int controlSize(int stage) const override { return inner_.controlSize(stage) + (stage > 0 ? 0 : 1); }
  void getControlBounds(int stage, VectorRef lower, VectorRef upper) const override;
  int constraintSize(int node) const override { return inner_.constraintSize(node); }
  void getConstraintBounds(int node, VectorRef lower, VectorRef upper) const override {
    inner_.getConstraintBounds(node, lower, upper);
  }
  std::string getConstraintName(int node, int row) const override { return inner_.getConstraintName(node, row); }

  /// The largest |u_i| / L_i of a trajectory of the inner problem.
  double calcPeak(const ShootingTrajectory& inner) const;
  /// The same trajectory here, with s its peak, and back.
  ShootingTrajectory wrap(const ShootingTrajectory& inner) const;
  ShootingTrajectory unwrap(const ShootingTrajectory& trajectory) const;

 private:
  double getShare(int node, const VectorXd& x, const VectorXd& u) const {
    return node > 0 ? x[x.size() - 1] : u[u.size() - 1];
  }
  bool counts(Eigen::Index control) const { return control < limits_.size() && std::isfinite(limits_[control]); }
  double getFactor(Eigen::Index control, double share) const { return counts(control) ? share * limits_[control] : 1; }
  void setControls(int node, WrappedEvaluation& at) const override;
  void finish(int node, WrappedEvaluation& at, ProblemScratch* inner) const override;
  void setModel(LinearizeTask& task, const StageModel* model, ProblemScratch* inner) const override;
  void setHessian(int node, const NodeEvaluation& at, const StageModel& inner, StageModel& out) const;

  VectorXd limits_;
  double weight_, most_;
};

}  // namespace bielle
