#include "bielle/dynamics/block_motion.h"

namespace bielle {
namespace {

SE3 getFrame1(const BlockView& view, const Closure& c) { return view.ws.X_WB[c.body1] * c.X_B1; }

// Difference of a path sum of coordinate c between the bodies of a closure of the block.
Vector6d calcDifference(const BlockMotion& motion, const Matrix6Xd& sums, const Closure& own, int c) {
  const int n = static_cast<int>(motion.block.dofs.size());
  const int dof1 = motion.block.body_dof[own.body1], dof2 = motion.block.body_dof[own.body2];
  Vector6d out = Vector6d::Zero();
  if (dof1 >= 0) out = sums.col(n * c + dof1);
  if (dof2 >= 0) out -= sums.col(n * c + dof2);
  return out;
}

// Path sums of what `add` adds for dof k of the block, coordinate c.
template <typename Add>
void sumPaths(const LoopBlock& block, Matrix6Xd& sums, const Add& add) {
  const int n = static_cast<int>(block.dofs.size());
  for (int c = 0; c < block.size; ++c)
    for (const DofGroup& group : block.groups) {
      Vector6d sum = Vector6d::Zero();
      if (group.parent >= 0) sum = sums.col(n * c + group.parent);
      for (int k = group.begin; k < group.end; ++k) add(k, c, sum);
      for (int k = group.begin; k < group.end; ++k) sums.col(n * c + k) = sum;
    }
}

// out = -J^+ K for all closure rows K (m x r).
void applyMinusPlus(BlockMotion& motion, const MatrixXd& K, MatrixXd& out) {
  const BlockBasis& basis = *motion.basis;
  for (Eigen::Index c = 0; c < K.cols(); ++c)
    for (size_t i = 0; i < basis.rows.size(); ++i) motion.X(i, c) = K(basis.rows[i], c);
  applyPseudoInverse(motion.block, basis, -1, motion.X, out);
}

}  // namespace

BlockMotion::BlockMotion(const LoopBlock& l) : block(l) {
  const int n = l.model.nv(), m = l.closures.rows, r = l.size;
  for (MatrixXd* x : {&Z, &dy, &dv}) x->setZero(n, r);
  for (Matrix6Xd* x : {&J, &dV, &dA, &dW}) x->setZero(6, n * r);
  for (MatrixXd* x : {&K_q, &K_v}) x->setZero(m, r);
  X.setZero(l.rank, r);
}

void updateTwists(const BlockView& view, const BlockBasis& basis, BlockMotion& motion) {
  motion.basis = &basis;
  sumPaths(motion.block, motion.J,
           [&](int k, int c, Vector6d& sum) { sum += basis.N(k, c) * view.ws.J.col(view.dofs[k]); });
}

void updateVelocityLift(const BlockView& view, BlockMotion& motion) {
  const LoopBlock& block = motion.block;
  const MatrixXd& N = motion.basis->N;
  sumPaths(block, motion.dV, [&](int k, int c, Vector6d& sum) { sum += N(k, c) * view.ws.dV.col(view.dofs[k]); });
  for (size_t i = 0; i < view.closures.size(); ++i) {
    const Closure &placed = view.closures[i], &own = block.closures.closures[i];
    const SE3 X_W1 = getFrame1(view, placed);
    const int row = block.closures.offsets[i], rows = getRows(own.kind);
    for (int c = 0; c < block.size; ++c) {
      const Vector6d dnu = calcDifference(motion, motion.dV, own, c) +
                           crossMotion(calcDifference(motion, motion.J, own, c), view.ws.V[placed.body2]);
      motion.K_q.col(c).segment(row, rows) = selectRows(placed, X_W1.actInvMotion(dnu));
    }
  }
  applyMinusPlus(motion, motion.K_q, motion.Z);
  sumPaths(block, motion.dV, [&](int k, int c, Vector6d& sum) {
    sum += N(k, c) * view.ws.dV.col(view.dofs[k]) + motion.Z(k, c) * view.ws.J.col(view.dofs[k]);
  });
}

void updateAccelerationLift(const BlockView& view, BlockMotion& motion) {
  const LoopBlock& block = motion.block;
  const Workspace& ws = view.ws;
  const MatrixXd &N = motion.basis->N, &Z = motion.Z;
  const auto getTurn = [&](int k) { return ws.dJ.col(view.dofs[k]) + ws.dV.col(view.dofs[k]); };
  sumPaths(block, motion.dA,
           [&](int k, int c, Vector6d& sum) { sum += N(k, c) * ws.dA.col(view.dofs[k]) + Z(k, c) * getTurn(k); });
  sumPaths(block, motion.dW, [&](int k, int c, Vector6d& sum) { sum += N(k, c) * getTurn(k); });
  for (size_t i = 0; i < view.closures.size(); ++i) {
    const Closure &placed = view.closures[i], &own = block.closures.closures[i];
    const SE3 X_W1 = getFrame1(view, placed);
    const Vector6d &V1 = ws.V[placed.body1], &V2 = ws.V[placed.body2], &A2 = ws.A[placed.body2];
    const Vector6d V12 = V1 + V2;
    const int row = block.closures.offsets[i], rows = getRows(own.kind);
    for (int c = 0; c < block.size; ++c) {
      const Vector6d J = calcDifference(motion, motion.J, own, c), dV = calcDifference(motion, motion.dV, own, c);
      const Vector6d dq = calcDifference(motion, motion.dA, own, c) - crossMotion(V12, dV) + crossMotion(J, A2) -
                          crossMotion(V1, crossMotion(J, V2));
      const Vector6d dv = calcDifference(motion, motion.dW, own, c) - crossMotion(V12, J);
      motion.K_q.col(c).segment(row, rows) = selectRows(placed, X_W1.actInvMotion(dq));
      motion.K_v.col(c).segment(row, rows) = selectRows(placed, X_W1.actInvMotion(dv));
    }
  }
  applyMinusPlus(motion, motion.K_q, motion.dy);
  applyMinusPlus(motion, motion.K_v, motion.dv);
  sumPaths(block, motion.dA, [&](int k, int c, Vector6d& sum) {
    sum += N(k, c) * ws.dA.col(view.dofs[k]) + Z(k, c) * getTurn(k) + motion.dy(k, c) * ws.J.col(view.dofs[k]);
  });
  sumPaths(block, motion.dW, [&](int k, int c, Vector6d& sum) {
    sum += N(k, c) * getTurn(k) + motion.dv(k, c) * ws.J.col(view.dofs[k]);
  });
}

void calcForceLift(const BlockView& view, const BlockMotion& motion, ConstVectorRef forces, MatrixRef out) {
  const LoopBlock& block = motion.block;
  const int n = static_cast<int>(block.dofs.size());
  out.setZero();
  for (size_t i = 0; i < view.closures.size(); ++i) {
    const Closure& own = block.closures.closures[i];
    const Vector6d W =
        calcClosureWrench(view.ws, view.closures[i], forces.segment(block.closures.offsets[i], getRows(own.kind)));
    const int dof1 = block.body_dof[own.body1];
    for (int c = 0; c < block.size; ++c) {
      Vector6d twist1 = Vector6d::Zero();
      if (dof1 >= 0) twist1 = motion.J.col(n * c + dof1);
      for (size_t d = 0; d < own.dofs.size(); ++d) {
        const int k = own.dofs[d];
        const Vector6d moved = crossForce(twist1 - motion.J.col(n * c + k), W);
        out(k, c) += own.signs[d] * view.ws.J.col(view.dofs[k]).dot(moved);
      }
    }
  }
}

void calcBlockDrift(const BlockView& view, const LoopBlock& block, const BlockBasis& basis, VectorRef rows,
                    VectorRef drift) {
  for (size_t c = 0; c < view.closures.size(); ++c)
    rows.segment(block.closures.offsets[c], getRows(view.closures[c].kind)) =
        calcClosureAcceleration(view.ws, view.closures[c]);
  for (size_t i = 0; i < basis.rows.size(); ++i) drift[i] = rows[basis.rows[i]];
}

}  // namespace bielle
