#pragma once
// The problem of a robot by direct multiple shooting (Bock and Plitt, "A multiple shooting algorithm for direct
// solution of optimal control problems", IFAC World Congress 1984).
//
// About the states xg_k of a guess, states have coordinates d_k, and the variables are
//     z = (u_0, d_1, u_1, d_2, .., u_{N-1}, d_N),    x_k = xg_k (+) d_k,    x_0 given.                              (1)
// Besides the path constraints the rows are
//     (f_k(x_k, u_k) (-) xg_{k+1}) - d_{k+1} = 0.                                                                   (2)
// A StageModel has derivatives by dx_k, coordinates about x_k itself. Those by d_k follow from
//     dx_k = T_k dd_k,    T_k^-1 = P(xg_k) D(x_k),                                                                  (3)
// for x (-) xg is P(xg), which is RobotProblem::mapGains() of the identity, times the difference in the coordinates of
// the tree, and D is the derivative of the latter by dx_k.
#include <memory>
#include <vector>

#include "nonlinear_program.h"

namespace bielle {

// T of Eq. (3).
class Charts {
 public:
  explicit Charts(const RobotProblem& problem);
  // \param P  tangent size x 2 nv, of the state xg   \param T  square
  NumericalStatus calc(const RowMatrixXd& P, const VectorXd& xg, const VectorXd& x, MatrixXd& T);

 private:
  class TreeDifference;
  std::shared_ptr<TreeDifference> difference_;
  RobotProblem node_;  // a terminal node, whose constraint is the difference: its Jacobian is D
  RobotEvaluator evaluator_;
  StageModel model_;
};

class MultipleShooting : public NonlinearProgram {
 public:
  // \param guess  of states that are closed
  MultipleShooting(const RobotProblem& problem, ShootingTrajectory guess);

  void getRows(VectorRef out) const override;
  void getGradient(VectorRef out) const override;
  void getJacobian(VectorRef values) const override;
  void getHessian(VectorRef values) const override;
  double calcGap() const override;

 private:
  struct Node {
    int d = 0, nd = 0;  // where d_k is in z; there is no d_0
    int s = 0;          // first row of the dynamics
    RowMatrixXd P;      // Eq. (3)
    MatrixXd T;
    StageModel model;
  };
  bool update() override;
  bool differentiate() override;
  void listNodes();
  void listEntries();

  Charts charts_;
  std::vector<Node> nodes_;
  std::vector<VectorXd> d_, ahead_;  // d_k, and f_{k-1} (-) xg_k
};

}  // namespace bielle
