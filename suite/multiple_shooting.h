#pragma once
// The problem of a robot as a nonlinear program, for solvers that know vectors and sparse matrices alone: direct multiple shooting
// (Bock and Plitt, "A multiple shooting algorithm for direct solution of optimal control problems", IFAC World Congress 1984).
//
// About the states xg_k of a guess, states have coordinates d_k, and the variables are
//     z = (u_0, d_1, u_1, d_2, .., u_{N-1}, d_N),    x_k = xg_k (+) d_k,    x_0 given.                                 (1)
// With the path constraints c_k, but for rows without bounds and rows of the given state alone, the program is
//     min  f = sum_k l_k(x_k, u_k) + l_N(x_N)    s.t.    bounds of u_k,    bounds of c_k(x_k, u_k),
//                                                        (f_k(x_k, u_k) (-) xg_{k+1}) - d_{k+1} = 0.                   (2)
// A StageModel has derivatives by dx_k, coordinates about x_k itself. Those by d_k follow from
//     dx_k = T_k dd_k,    T_k^-1 = P(xg_k) D(x_k),                                                                     (3)
// for x (-) xg is P(xg), which is RobotProblem::mapGains() of the identity, times the difference in the coordinates of the tree,
// and D is the derivative of the latter by dx_k. The Hessian is that of Gauss and Newton, of f alone.
#include <memory>
#include <string>
#include <vector>

#include "bielle/ocp/robot_problem.h"
#include "bielle/solve/fddp.h"

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

class MultipleShooting {
 public:
  // \param guess  of states that are closed; x_0 is replaced by the initial one, and controls are projected on their bounds
  // \throws InputError where durations are variables
  MultipleShooting(const RobotProblem& problem, ShootingTrajectory guess);

  // Of a sparse matrix, in the order of its values; of a symmetric one the lower triangle.
  struct Entries {
    std::vector<int> rows, columns;
    void add(int row, int column) { rows.push_back(row), columns.push_back(column); }
    int size() const { return static_cast<int>(rows.size()); }
  };
  struct Bounds {
    VectorXd lower, upper;  // infinite where there are none
  };
  const Bounds& variables() const { return variables_; }
  const Bounds& rows() const { return rows_; }
  const Entries& jacobian() const { return jacobian_; }
  const Entries& hessian() const { return hessian_; }
  VectorXd start() const;  // z of the guess

  // What follows is of the last z; nothing is computed twice for the same. False where the problem cannot be evaluated: why.
  bool evaluate(ConstVectorRef z);
  bool linearize(ConstVectorRef z);
  const std::string& failure() const { return failure_; }
  double calcCost() const;
  void getRows(VectorRef out) const;
  void getGradient(VectorRef out) const;
  void getJacobian(VectorRef values) const;
  void getHessian(VectorRef values) const;

  const ShootingTrajectory& trajectory() const { return trajectory_; }
  // The multipliers of all path constraints from those of the rows, those that were left out zero.
  Multipliers expand(ConstVectorRef multipliers) const;
  // Largest violation of a path constraint, and of the dynamics.
  double calcViolation() const;
  double calcGap() const;

 private:
  struct Node {
    int d = 0, nd = 0, u = 0, nu = 0;  // where d_k and u_k are in z; there is no d_0
    int c = 0, s = 0;                  // first rows of c_k and of the dynamics
    std::vector<int> kept;             // rows of c_k
    std::vector<char> of_controls;     // by kept row: whether it depends on u_k, by itself or through forces
    std::vector<char> wanted;          // all rows of c_k, for LinearizeTask
    RowMatrixXd P;                     // Eq. (3)
    MatrixXd T;
    StageModel model;
  };
  void listNodes();
  void listBounds();
  void listEntries();
  bool fail(const std::string& why);

  const RobotProblem& problem_;
  ShootingTrajectory guess_, trajectory_;
  Charts charts_;
  std::unique_ptr<ProblemScratch> scratch_;
  std::vector<Node> nodes_;
  Bounds variables_, rows_;
  Entries jacobian_, hessian_;
  std::vector<std::unique_ptr<NodeEvaluation>> guesses_, evaluations_;
  std::vector<VectorXd> d_, ahead_;  // d_k, and f_{k-1} (-) xg_k
  VectorXd z_;
  bool evaluated_ = false, linearized_ = false;  // at z_
  std::string failure_;
};

}  // namespace bielle
