#pragma once
/// \file The motion of a closed mechanism as a smooth field around the manifold of its closed states, for explicit integrators
/// of high order.
///
/// At a closed configuration q_0 with the independent closure rows J_0 begins a chart: tangent vectors d (nv) stand for
///
///     q = q_0 (+) delta,   delta = d - J_0^T zeta,   zeta such that q is closed                                    (1)
///
/// and with the rows J at q, S = J M^{-1} J^T and any u (nv), the closed velocity nearest to u in the metric of M, and the
/// acceleration there, are
///
///     v = u - M^{-1} J^T S^{-1} J u                                                                                (2)
///     a = M^{-1} (f + J^T lambda),   lambda = -S^{-1} (J M^{-1} f + gamma),   f = tau - b                          (3)
///     d' = D(delta) v,   u' = a                                                                                    (4)
///
/// where D is the derivative of delta by the motion of q (joint.h). On closed states zeta = 0 and u = v, and (4) is the motion
/// of the mechanism; beside them it is a smooth extension. A Runge-Kutta method on (4) thus has its full order, while every
/// acceleration is taken at a closed state: loops do not drift, and need no stabilization.
///
/// **Redundant rows.** Rows are chosen once by pivoting; any independent ones give the same a.
/// **Singular postures.** Where rows become dependent at an instant, as those of a parallelogram that folds, the branches of the
/// motion cross. (1) moves along the rows of q_0 alone, across the branch that the motion is on, so that it cannot slip to
/// the other; the error of (3) grows like rounding over the square of the sine between rows. Nearer than kSingular the field says that it
/// is not defined: the step is to be taken with another length, and passes over.
///
/// The trees that hang on the world are factorized apart, and S is sparse where it is large: the cost of N four-bars side by
/// side is linear in N.
#include <Eigen/SparseCholesky>
#include <Eigen/SparseLU>
#include <memory>
#include <string>
#include <vector>

#include "bielle/dynamics/closure.h"
#include "math/decompositions.h"

namespace bielle {

/// No function but select() allocates after the constructor, unless more than kDenseRows rows are chosen.
class ClosedField {
 public:
  /// Of independence(): below it rows count as dependent.
  static constexpr double kSingular = 1e-12;
  static constexpr int kDenseRows = 96;

  explicit ClosedField(const Model& model);
  ClosedField(const ClosedField&) = delete;
  ClosedField& operator=(const ClosedField&) = delete;

  /// Chooses independent rows at a closed configuration. \returns their number
  int select(ConstVectorRef q);
  /// Begins a chart at a closed configuration, Eq. (1).
  void begin(ConstVectorRef q);
  /// Eqs. (1) and (2): sets state and workspace (velocities, bias). \returns false where the loops do not close or the rows are
  /// dependent; failure() then tells why
  bool close(ConstVectorRef d, ConstVectorRef u);
  /// Eqs. (3) and (4) after close(), under the generalized forces tau (nv).
  void accelerate(ConstVectorRef tau, VectorRef d_rate, VectorRef u_rate);

  const VectorXd& configuration() const { return ws_.q; }  ///< nq
  const VectorXd& velocity() const { return v_; }          ///< nv
  const VectorXd& forces() const { return lambda_; }       ///< of the chosen rows, Eq. (3), after accelerate()
  const Workspace& workspace() const { return ws_; }
  const std::string& failure() const { return failure_; }
  int rank() const { return rows_; }
  /// The least part of a row that is independent of those before it, in the metric of M^{-1}, as a square over the largest square of
  /// any row at the same configuration; 1 without loops. It falls where rows turn into others.
  double independence() const { return independence_; }
  /// Largest residual of all rows, the dependent ones included, at the present state, m or rad.
  double calcGap() const;

 private:
  // One closure with the columns that move it.
  struct Loop {
    int cluster = 0, index = 0;
    std::vector<int> dofs, chosen;            // columns; rows of the closure that were chosen
    int offset = 0;                           // of the first chosen row
    MatrixXd J, J_start;                      // chosen x dofs, at q and at q_0
    std::vector<std::pair<int, int>> blocks;  // block and first row there
    std::vector<std::pair<int, int>> places;  // per column: position in `blocks`, and row of the block
  };
  // A tree that hangs on the world, or several joints that share inertia.
  struct Block {
    std::vector<int> dofs, rows;  // rows: chosen ones that move it
    MatrixXd M, Jt, W, gram;      // n x n; n x rows, J^T; L^{-1} J^T; W^T W
    VectorXd x, y;                // n; rows
    Eigen::LLT<MatrixXd> factor;
  };
  // Two loops of a cluster that share columns.
  struct Pair {
    int a = 0, b = 0;
    std::vector<std::pair<int, int>> columns;
  };
  // Newton's matrix J(q) J_0^T of a cluster.
  struct Newton {
    int offset = 0, rows = 0;
    std::vector<int> loops;
    std::vector<Pair> pairs;
    MatrixXd K;
    Eigen::PartialPivLU<MatrixXd> factor;
    std::unique_ptr<Eigen::SparseMatrix<double>> sparse;
    std::unique_ptr<Eigen::SparseLU<Eigen::SparseMatrix<double>>> sparse_factor;
    VectorXd x;
  };

  void chooseRows(const Newton& newton);
  void placeRows(Loop& loop);
  void layOut(Newton& newton);
  void layOutSystem();
  void displace(ConstVectorRef d);
  double updateResidual();
  void updateRows();
  bool updateNewton();
  void solveNewton();
  bool updateFactors();
  void solveRows(VectorXd& x);
  void multiply(const VectorXd& x, VectorXd& rows) const;
  void addImpulse(const VectorXd& rows, VectorXd& x);
  void solveMass(VectorXd& x);
  bool fail(const std::string& why);
  std::string describeWorst() const;

  Model model_;
  const ConstraintSet set_;
  Workspace ws_;
  std::vector<Loop> loops_;
  std::vector<Block> blocks_;
  std::vector<std::pair<int, int>> places_;  // per dof: block and row there
  std::vector<Newton> newtons_;
  std::vector<int> grouped_;  // joints whose tangent space is not flat
  int rows_ = 0;
  MatrixXd S_, scratch_;
  Eigen::LLT<MatrixXd> S_factor_;
  std::unique_ptr<Eigen::SparseMatrix<double>> S_sparse_;
  std::unique_ptr<Eigen::SimplicialLLT<Eigen::SparseMatrix<double>>> S_sparse_factor_;
  VectorXd q_start_, q_, delta_, zeta_, residual_, gamma_, lambda_, r_, v_, a_, x_;
  double independence_ = 1;
  std::string failure_;
};

}  // namespace bielle
