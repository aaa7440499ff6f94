#pragma once
// The problem of a robot as a nonlinear program, for solvers that know vectors and sparse matrices alone:
//     min f(z)    s.t.    bounds of z,    bounds of rows(z),        f = sum_k l_k + l_N.
// Its transcriptions, multiple_shooting.h and collocation.h, say what the variables z are, and which rows the dynamics
// have. The path constraints c_k of the nodes are rows of both, but for rows without bounds and rows of the given state
// x_0 alone. The Hessian is that of Gauss and Newton, of f alone.
#include <memory>
#include <string>
#include <vector>

#include "bielle/ocp/robot_problem.h"
#include "bielle/solve/fddp.h"

namespace bielle {

class NonlinearProgram {
 public:
  virtual ~NonlinearProgram() = default;

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
  const VectorXd& start() const { return start_; }  // z of the guess

  // What follows is of the last z; nothing is computed twice for the same. False where the problem cannot be evaluated:
  // why.
  bool evaluate(ConstVectorRef z);
  bool linearize(ConstVectorRef z);
  const std::string& failure() const { return failure_; }
  double calcCost() const;
  virtual void getRows(VectorRef out) const = 0;
  virtual void getGradient(VectorRef out) const = 0;
  virtual void getJacobian(VectorRef values) const = 0;
  virtual void getHessian(VectorRef values) const = 0;

  const ShootingTrajectory& trajectory() const { return trajectory_; }
  // The multipliers of all path constraints from those of the rows, those that were left out zero.
  Multipliers expand(ConstVectorRef multipliers) const;
  // Largest violation of a path constraint, and of the equations of the dynamics.
  double calcViolation() const;
  virtual double calcGap() const = 0;

 protected:
  // \param guess  x_0 is replaced by the initial one, and controls are projected on their bounds
  // \throws InputError where durations are variables
  NonlinearProgram(const RobotProblem& problem, ShootingTrajectory guess);

  // Of z_: trajectory_ and evaluations_, then their derivatives.
  virtual bool update() = 0;
  virtual bool differentiate() = 0;
  // After places_ have been filled: no bounds but those of controls and path constraints, and equations.
  void setBounds(int variables, int rows);
  void getPathRows(VectorRef out) const;
  bool fail(const std::string& why);

  struct Place {
    int u = 0, nu = 0;                       // where u_k is in z
    int c = 0;                               // first row of c_k
    std::vector<int> kept;                   // rows of c_k
    std::vector<const Residual*> residuals;  // of these
    std::vector<char> wanted;                // all rows of c_k, for LinearizeTask
    int numRows() const { return static_cast<int>(kept.size()); }
  };

  const RobotProblem& problem_;
  ShootingTrajectory guess_, trajectory_;
  std::unique_ptr<ProblemScratch> scratch_;
  std::vector<std::unique_ptr<NodeEvaluation>> guesses_, evaluations_;  // the former are the problem's
  std::vector<Place> places_;
  Bounds variables_, rows_;
  Entries jacobian_, hessian_;
  VectorXd start_, z_;

 private:
  void listPathRows(int node, Place& place) const;

  bool evaluated_ = false, linearized_ = false;  // at z_
  std::string failure_;
};

// Whether a residual depends on more than the state.
inline bool dependsOnControls(const Residual& residual) {
  return residual.needsForces() || residual.needsControls() || residual.needsSpeeds();
}

}  // namespace bielle
