#pragma once
/// \file A cycle: a shooting problem whose initial state is free, and whose last state is the initial one, moved.
///
/// From a shooting problem (the inner one) and a map S of states, such as a displacement over the ground,
///
///     min  sum_k l_k(x_k, u_k) + l_N(x_N)    s.t.  x_{k+1} = f_k(x_k, u_k),   x_N = S(x_0),    x_0 free             (1)
///
/// besides the requirements of the inner problem. With x_r its initial state, and theta in the tangent space there,
///
///     x_0 = x_r (+) theta.                                                                                         (2)
///
/// theta is the control of a stage before all others, which takes no state and costs nothing, and part of the state of all
/// other nodes, (x, theta), where it does not change. So a sweep has the value function of a cycle with its beginning as a
/// parameter, and the solver needs to know nothing of cycles. The last node has the constraints of the inner problem and
///
///     c = S(x_0) (-) x_N = 0,   in the tangent space at x_N, times a scale.                                        (3)
///
/// Derivatives by theta, of (2) and (3), are central differences of fourth order of (+) and (-), at two nodes of all. That of c
/// by x_N is taken as -1, which it is where c vanishes.
#include <functional>

#include "bielle/solve/fddp.h"
#include "solve/wrapped_problem.h"

namespace bielle {

/// S of Eq. (1): how a state of the inner problem appears a cycle later. The program may call it from several threads.
using StateMap = std::function<VectorXd(const VectorXd& x)>;

class PeriodicProblem : public WrappedProblem {
 public:
  /// \param inner  must outlive it
  /// \throws std::invalid_argument when its first and last node have tangent spaces of different size, or its initial state cannot
  /// be evaluated
  PeriodicProblem(const ShootingProblem& inner, StateMap map);

  int controlSize(int stage) const override { return stage > 0 ? inner_.controlSize(stage - 1) : n_; }
  void getControlBounds(int stage, VectorRef lower, VectorRef upper) const override;
  int constraintSize(int node) const override;
  void getConstraintBounds(int node, VectorRef lower, VectorRef upper) const override;
  std::string getConstraintName(int node, int row) const override;

  /// The same trajectory here, and back; likewise multipliers, of which those of (3), without its scale, are the last of the last node.
  ShootingTrajectory wrap(const ShootingTrajectory& inner) const;
  ShootingTrajectory unwrap(const ShootingTrajectory& trajectory) const;
  Multipliers wrap(Multipliers inner) const;
  Multipliers unwrap(Multipliers multipliers) const;

 private:
  VectorXd getState(const VectorXd& x) const { return x.head(inner_.stateSize()); }
  VectorXd calcStart(ConstVectorRef theta, ProblemScratch* inner) const;
  VectorXd calcError(const VectorXd& theta, const NodeEvaluation& last, ProblemScratch* inner) const;
  MatrixXd differentiate(const VectorXd& theta, bool maps, const NodeEvaluation& at, ProblemScratch* inner) const;
  void setControls(int node, WrappedEvaluation& at) const override;
  void finish(int node, WrappedEvaluation& at, ProblemScratch* inner) const override;
  void setModel(LinearizeTask& task, const StageModel* model, ProblemScratch* inner) const override;
  void linearizeStart(LinearizeTask& task, ProblemScratch* inner) const;
  void setClosing(const LinearizeTask& task, ProblemScratch* inner) const;

  StateMap map_;
  int n_;
  std::unique_ptr<NodeEvaluation> reference_;  // of the inner problem at x_r
};

/// Derivative of a map from the tangent space, of that size, at the last evaluation of `from` to that at the one of `to`, by central
/// differences of fourth order.
MatrixXd differentiateMap(const StateMap& map, int size, NodeEvaluator& from, NodeEvaluator& to);

/// A cycle repeated for ever, near a solution of (1): gains, and what deviations become.
struct CyclicFeedback {
  NumericalStatus status = NumericalStatus::Failed;
  std::vector<Gains> gains;  ///< N
  /// Of x_0 (-) that of the solution: by these factors its components along eigenvectors grow from a cycle to the next under
  /// these gains, Floquet multipliers; largest modulus first.
  Eigen::VectorXcd multipliers;
};

/// The value function V of the beginning of such a cycle, to second order, is the fixed point of a sweep whose last node has
/// V(S^{-1}(x)); the gains are those of that sweep. With E the derivative of S^{-1} at the end of the cycle, the multipliers are the
/// eigenvalues of
///     E (Fx + Fu K)_{N-1} .. (Fx + Fu K)_0.                                                                        (4)
/// (Bittanti, Colaneri, De Nicolao, "The periodic Riccati equation", 1991.)
/// \param solution, multipliers  of (1), as unwrap() gives them; rows with a multiplier count as equations with the penalty
CyclicFeedback calcCyclicFeedback(const ShootingProblem& inner, const StateMap& map, const ShootingTrajectory& solution,
                                  const Multipliers& multipliers);

}  // namespace bielle
