#pragma once
/// \file Forward dynamics under closures and contacts, and its derivatives (the paper's eqs. 4 to 6).
///
///     M a - J^T lambda = tau - b,     J a = -gamma (1) G lambda = -gamma - J M^{-1} (tau - b),    G = J M^{-1} J^T (2)
/// where gamma gathers the drift and the stabilisation of the closures. Rows may be redundant: with D = diag(G)^{-1/2}
/// the system (D G D) y = D rhs is solved by proximal iterations (Carpentier, Budhiraja, Mansard, RSS 2021)
///     y <- y + (D G D + mu I)^{-1} (D rhs - D G D y), (3)
/// which converge to the least-squares, minimum-norm y; lambda = D y. Accelerations and generalized constraint forces
/// J^T lambda do not depend on the choice of rows. Where D G D is well conditioned it is factorised directly.
///
/// Derivatives: at fixed a and lambda let dID = d(M a + b - J^T lambda - tau)/dz and da_c = d a_c/dz. Then
///     dlambda/dz = G^+ (J M^{-1} dID - da_c),     da/dz = M^{-1} (J^T dlambda/dz - dID). (4)
/// With redundant rows dlambda/dz is right up to the null space of J^T.
#include <Eigen/Cholesky>

#include "bielle/dynamics/closure.h"

namespace bielle {

struct ConstrainedOptions {
  double proximal = 1e-7;          ///< mu of Eq. (3), relative to the unit diagonal of D G D
  int max_iterations = 30;         ///< of Eq. (3)
  double tolerance = 1e-13;        ///< stop when a correction is below this, relative to the solution
  double direct_threshold = 1e-5;  ///< smallest pivot of D G D for which it is factorised directly
};

enum class DynamicsStatus { Ok, MassMatrixSingular, NotFinite };
const char* getMessage(DynamicsStatus status);

/// Memory of one constrained solve; sized for a constraint set at first use, reused without allocation afterwards.
struct ConstrainedWorkspace {
  MatrixXd J;              ///< rows x nv
  VectorXd gamma;          ///< rows
  VectorXd a;              ///< nv, accelerations
  VectorXd lambda;         ///< rows, closure and contact forces, each in its frame 1
  double residual = 0;     ///< largest |J a + gamma|: not small when redundant rows contradict each other
  bool redundant = false;  ///< whether Eq. (3) was needed

  MatrixXd da_dq, da_dv;            ///< nv x nv
  MatrixXd da_du;                   ///< nv x nu
  MatrixXd dlambda_dq, dlambda_dv;  ///< rows x nv
  MatrixXd dlambda_du;              ///< rows x nu

  // Intermediate
  Eigen::LLT<MatrixXd> M_llt, G_llt;
  MatrixXd W;     ///< nv x rows: L^{-1} J^T D, L the Cholesky factor of M
  MatrixXd G;     ///< rows x rows: D G D
  MatrixXd Ginv;  ///< rows x rows, (pseudo-)inverse of D G D
  VectorXd D;     ///< rows
  VectorXd rhs, correction, force;
  MatrixXd dc_dq, dc_dv;        ///< rows x nv, derivatives of the constraint acceleration
  MatrixXd T1, T3;              ///< rows x rows
  MatrixXd T2;                  ///< rows x nv
  std::vector<Vector6d> f_ext;  ///< nb
};

/// Accelerations and forces for generalized forces tau (nv) at (q, v). Fills `ws` up to the accelerations.
DynamicsStatus updateConstrainedDynamics(const Model& model, Workspace& ws, ConstrainedWorkspace& cws,
                                         const ConstraintSet& constraints, ConstVectorRef q, ConstVectorRef v,
                                         ConstVectorRef tau, const ConstrainedOptions& options = {});

/// Derivatives (4) at the solution held by the workspaces; to be called after updateConstrainedDynamics.
DynamicsStatus updateConstrainedDerivatives(const Model& model, Workspace& ws, ConstrainedWorkspace& cws,
                                            const ConstraintSet& constraints, const ConstrainedOptions& options = {});

/// Generalized forces of motor torques u (nu).
void calcMotorForces(const Model& model, ConstVectorRef u, VectorRef tau);
VectorXd calcMotorForces(const Model& model, ConstVectorRef u);

/// Rank of the closure Jacobian at q and the mobility nv - rank.
struct Mobility {
  int rows = 0, rank = 0, mobility = 0;
  VectorXd singular_values;
};
/// \param tolerance singular values below it times the largest count as zero
Mobility calcMobility(const Model& model, ConstVectorRef q, double tolerance = 1e-6);

}  // namespace bielle
