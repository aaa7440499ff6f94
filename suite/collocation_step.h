#pragma once
// The equations of a step over all joints of the tree: the implicit midpoint rule, with closures at its end. With
//     delta = q_1 (-) q_0,    q_m = q_0 (+) delta/2,    v_m = (v_0 + v_1)/2,    a = (v_1 - v_0)/h                   (1)
// they are, J being the Jacobian of the closures, J_c that of the contacts and r their residuals (bielle/notation.h),
//     delta - h (v_m + J(q_m)^T zeta) = 0                                                                           (2)
//     M a + b(q_m, v_m) - B u - J^T lambda - J_c^T lambda_c = 0    at q_m                                           (3)
//     J_c a + gamma_c(q_m, v_m) + k_d J_c v_0 - k_p r_c = 0        the last two at (q_0, v_0)                       (4)
//     r(q_1) = 0,    J(q_1) v_1 = 0                                                                                 (5)
// zeta keeps places closed where the midpoint rule alone would leave them, and vanishes with h^2: the form of Gear,
// Leimkuhler and Gupta ("Automatic integration of Euler-Lagrange equations with constraints", Journal of Computational
// and Applied Mathematics 12-13, 1985), of which the collocation of Posa, Kuindersma and Tedrake ("Optimization and
// stabilization of trajectories for constrained dynamical systems", ICRA 2016) is made, too. At an impact h is 1, v_m
// is left out of (2), (3) is M (v_1 - v_0) - J^T Lambda - J_c^T Lambda_c and (4) J_c v_1.
#include <utility>
#include <vector>

#include "bielle/ocp/robot_problem.h"

namespace bielle {

// Matrices that act on the tangent of each joint by itself: a number times the identity but for joints that are curved.
struct JointBlocks {
  double plain = 1;
  std::vector<std::pair<int, MatrixXd>> curved;  // first index and block
};
// by * blocks
MatrixXd multiply(const MatrixXd& by, const JointBlocks& blocks);
// Of q (+) d, by d.
JointBlocks makeIntegrateBlocks(const Model& model, const VectorXd& d);

// Where things are among the rows and columns of a step: equations (2) to (5), of all closures and contacts, and the
// tangents of the variables. Forces are those of all rows of the constraints, zeta has one for each row of the
// closures.
struct StepLayout {
  StepLayout() = default;
  StepLayout(const Model& model, const ConstraintSet& constraints);
  int forces = 0, loops = 0;  // rows of the constraints, of closures alone
  int q0 = 0, v0 = 0, u = 0, lambda = 0, zeta = 0, q1 = 0, v1 = 0, columns = 0;
  // The first rows of (2), (3), (4) and both of (5).
  int places = 0, dynamics = 0, contacts = 0, closed = 0, still = 0, rows = 0;
};

class CollocationStep {
 public:
  explicit CollocationStep(const Model& model);

  struct Input {
    const StageSpec& spec;
    const VectorXd &x0, &x1;  // (q, v)
    const VectorXd &u, &lambda, &zeta;
  };
  // Eqs. (2) to (5). \param out  StepLayout::rows
  void update(const Input& in, VectorXd& out);
  // Their derivatives, after update() of the same. \param out  StepLayout::rows x columns
  void differentiate(const Input& in, MatrixXd& out);

 private:
  void addForceDerivatives(const ConstraintSet& set, const VectorXd& lambda, MatrixXd& by_q);
  void differentiateDynamics(const Input& in, const StepLayout& at);
  void differentiateEnds(const Input& in, const StepLayout& at, MatrixXd& out);
  void setPlaces(const Input& in, const StepLayout& at, MatrixXd& out) const;

  Model model_;
  Workspace start_, middle_, end_;
  double h_ = 0;
  VectorXd delta_, a_, v_mid_;
  MatrixXd J_;                          // at the middle
  MatrixXd D_q_, D_v_, c_q_, c_v_, G_;  // (3) and (4) by q_m and v_m; d(J^T zeta)/dq
  std::vector<Vector6d> f_ext_;
};

}  // namespace bielle
