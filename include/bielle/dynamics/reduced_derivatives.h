#pragma once
/// \file Derivatives of inverse dynamics in reduced coordinates, without ever forming those of full size.
///
/// A change (dy, dy_v) of a unit moves its dofs by dq = N dy, dv = N dy_v + Z dy and, at fixed reduced accelerations, da =
/// d_y dy + d_v dy_v. The factors of rnea.h are linear in these, so that each unit needs a few columns only. Seen from a
/// unit further out, with sums over the dofs k of the path between:
///     J~ = sum J_k N_k,                          dV~ = sum dV_k N_k + J_k Z_k,
///     dA~ = sum dA_k N_k + (dJ + dV)_k Z_k + J_k d_y,k,      dW~ = sum (dJ + dV)_k N_k + J_k d_v,k                    (1)
/// and, seen from a unit further in, with sums over all its dofs j:
///     (YJ)~ = sum YJ_j N_j,   (BtJ)~ = sum BtJ_j N_j,
///     G~_y = sum Gq_j N_j + Gv_j Z_j + YJ_j d_y,j,           G~_v = sum Gv_j N_j + YJ_j d_v,j                         (2)
/// Then, for a coordinate alpha further out and beta further in on its path, by Eqs. (7) to (9) of rnea.h,
///     A_y(alpha, beta) = (YJ)~_alpha . dA~_beta + (BtJ)~_alpha . dV~_beta,    A_y(beta, alpha) = J~_beta . G~_y,alpha
///     A_v(alpha, beta) = (YJ)~_alpha . dW~_beta + (BtJ)~_alpha . J~_beta,     A_v(beta, alpha) = J~_beta . G~_v,alpha (3)
/// Within a unit, with D_q, D_v, M the entries between its own dofs and H = d(J^T lambda)/dq of its loop forces,
///     A_y = N^T ((D_q - H) N + D_v Z + M d_y),     A_v = N^T (D_v N + M d_v).                                         (4)
/// The loop forces have no other effect: inner to the block, they cancel in every sum that leaves it.
#include "bielle/dynamics/reduction.h"

namespace bielle {

/// What a block contributes: its basis and the derivatives that lift a reduced change to its dofs (n x size each), and H.
struct BlockLift {
  const MatrixXd *N = nullptr, *Z = nullptr, *dy = nullptr, *dv = nullptr;
  const MatrixXd* H = nullptr;  ///< n x n
};

class ReducedDerivatives {
 public:
  ReducedDerivatives(const Model& model, const Reduction& reduction);

  /// A_y and A_v (size x size) at the acceleration of the workspace, whose inverse dynamics factors are updated.
  /// \param f_ext per body (nb), world wrenches of the contacts   \param lifts per block
  void update(Workspace& ws, const std::vector<Vector6d>& f_ext, const std::vector<BlockLift>& lifts, MatrixRef A_y,
              MatrixRef A_v);

 private:
  struct Unit {
    std::vector<int> dofs;
    Matrix6Xd J, dV, dA, dW;    // 6 x (outer + own): Eq. (1) of the outer coordinates
    Matrix6Xd YJ, BtJ, Gy, Gv;  // 6 x size, Eq. (2)
    MatrixXd Dq, Dv, DqN, DvN;  // n x n, n x size
  };
  void updateOuter(const Workspace& ws, const std::vector<BlockLift>& lifts, int index);
  void updateInner(const Workspace& ws, const BlockLift* lift, Unit& unit) const;
  void addWithin(const Workspace& ws, const BlockLift* lift, const ReducedUnit& place, Unit& unit, MatrixRef A_y,
                 MatrixRef A_v) const;

  const Model& model_;
  const Reduction& reduction_;
  std::vector<Unit> units_;
};

}  // namespace bielle
