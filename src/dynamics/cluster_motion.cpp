#include "dynamics/cluster_motion.h"

#include "dynamics/closure_rows.h"

namespace bielle {
namespace {

// Difference of a path sum of coordinate c between the bodies of a closure of the cluster.
template <typename T>
Vector6<T> calcDifference(const ClusterMotionOf<T>& motion, const Matrix6X<T>& sums, const Closure& own, int c) {
  const int n = static_cast<int>(motion.cluster.dofs.size());
  const int dof1 = motion.cluster.body_dof[own.body1], dof2 = motion.cluster.body_dof[own.body2];
  Vector6<T> out = Vector6<T>::Zero();
  if (dof1 >= 0) out = sums.col(n * c + dof1);
  if (dof2 >= 0) out -= sums.col(n * c + dof2);
  return out;
}

// Sum over the terms of a coupler, with k their dofs in the cluster: that of closure.h, Eq. (6), times a column of N or Z.
template <typename T, typename Calc>
T sumTerms(const Closure& placed, const Closure& own, const Calc& calc) {
  T sum = 0;
  for (size_t i = 0; i < own.terms.size(); ++i)
    if (!own.terms[i].isLinear()) sum += calc(placed.terms[i], own.terms[i].dof);
  return sum;
}

// Path sums of the terms that `add` contributes for dof k of the cluster, coordinate c.
template <typename T, typename Add>
void sumPaths(const ReducedCluster& cluster, Matrix6X<T>& sums, const Add& add) {
  const int n = static_cast<int>(cluster.dofs.size());
  for (int c = 0; c < cluster.size; ++c)
    for (const DofGroup& group : cluster.groups) {
      Vector6<T> sum = Vector6<T>::Zero();
      if (group.parent >= 0) sum = sums.col(n * c + group.parent);
      for (int k = group.begin; k < group.end; ++k) add(k, c, sum);
      for (int k = group.begin; k < group.end; ++k) sums.col(n * c + k) = sum;
    }
}

// out = -J^+ K for all closure rows K (m x r).
template <typename T>
void applyMinusPlus(ClusterMotionOf<T>& motion, const MatrixX<T>& K, MatrixX<T>& out) {
  const ClusterBasisOf<T>& basis = *motion.basis;
  for (Eigen::Index c = 0; c < K.cols(); ++c)
    for (size_t i = 0; i < basis.rows.size(); ++i) motion.X(i, c) = getEntry(&K(0, c), basis.rows[i]);
  applyPseudoInverse<T>(motion.cluster, basis, -1, motion.X, out);
}

}  // namespace

template <typename T>
ClusterMotionOf<T>::ClusterMotionOf(const ReducedCluster& l) : cluster(l) {
  const int n = l.model.nv(), m = l.closures.rows, r = l.size;
  for (MatrixX<T>* x : {&Z, &dy, &dv}) x->setZero(n, r);
  for (Matrix6X<T>* x : {&J, &dV, &dA, &dW}) x->setZero(6, n * r);
  for (MatrixX<T>* x : {&C_q, &C_v}) x->setZero(m, r);
  X.setZero(l.rank, r);
}

template <typename T>
void updateTwists(const ClusterViewOf<T>& view, const ClusterBasisOf<T>& basis, ClusterMotionOf<T>& motion) {
  motion.basis = &basis;
  sumPaths(motion.cluster, motion.J,
           [&](int k, int c, Vector6<T>& sum) { sum += basis.N(k, c) * view.ws.J.col(view.dofs[k]); });
}

template <typename T>
void updateVelocityLift(const ClusterViewOf<T>& view, ClusterMotionOf<T>& motion) {
  const ReducedCluster& cluster = motion.cluster;
  const MatrixX<T>& N = motion.basis->N;
  sumPaths(cluster, motion.dV, [&](int k, int c, Vector6<T>& sum) { sum += N(k, c) * view.ws.dV.col(view.dofs[k]); });
  for (size_t i = 0; i < view.closures.size(); ++i) {
    const Closure &placed = view.closures[i], &own = cluster.closures.closures[i];
    const int row = cluster.closures.offsets[i];
    if (own.kind == ClosureKind::Coupler) {
      for (int c = 0; c < cluster.size; ++c)
        motion.C_q(row, c) = sumTerms<T>(placed, own, [&](const CouplerTerm& term, int k) {
          return T(term.calcDerivative(2, view.ws.q[term.idx_q]) * view.ws.v[term.dof] * N(k, c));
        });
      continue;
    }
    const ClosureRows<T> rows(view.ws, placed);
    for (int c = 0; c < cluster.size; ++c) {
      const Vector6<T> J = calcDifference(motion, motion.J, own, c);
      const Vector6<T> dnu = calcDifference(motion, motion.dV, own, c) + crossMotion(J, view.ws.V[placed.body2]);
      rows.writeVelocityChange(1, J, dnu, &motion.C_q(row, c));
    }
  }
  applyMinusPlus(motion, motion.C_q, motion.Z);
  sumPaths(cluster, motion.dV, [&](int k, int c, Vector6<T>& sum) {
    sum += N(k, c) * view.ws.dV.col(view.dofs[k]) + motion.Z(k, c) * view.ws.J.col(view.dofs[k]);
  });
}

template <typename T>
void updateAccelerationLift(const ClusterViewOf<T>& view, ClusterMotionOf<T>& motion) {
  const ReducedCluster& cluster = motion.cluster;
  const WorkspaceOf<T>& ws = view.ws;
  const MatrixX<T>&N = motion.basis->N, &Z = motion.Z;
  const auto getTurn = [&](int k) -> Vector6<T> { return ws.dJ.col(view.dofs[k]) + ws.dV.col(view.dofs[k]); };
  sumPaths(cluster, motion.dA,
           [&](int k, int c, Vector6<T>& sum) { sum += N(k, c) * ws.dA.col(view.dofs[k]) + Z(k, c) * getTurn(k); });
  sumPaths(cluster, motion.dW, [&](int k, int c, Vector6<T>& sum) { sum += N(k, c) * getTurn(k); });
  for (size_t i = 0; i < view.closures.size(); ++i) {
    const Closure &placed = view.closures[i], &own = cluster.closures.closures[i];
    const ClosureRows<T> rows(ws, placed);
    const Vector6<T>&V1 = ws.V[placed.body1], &V2 = ws.V[placed.body2], &A2 = ws.A[placed.body2];
    const Vector6<T> V12 = V1 + V2;
    const int row = cluster.closures.offsets[i];
    if (own.kind == ClosureKind::Coupler) {
      for (int c = 0; c < cluster.size; ++c) {
        motion.C_q(row, c) = sumTerms<T>(placed, own, [&](const CouplerTerm& term, int k) {
          const T &q = ws.q[term.idx_q], &v = ws.v[term.dof], curvature = term.calcDerivative(2, q);
          return T((curvature * ws.a[term.dof] + term.calcDerivative(3, q) * v * v) * N(k, c) +
                   2 * curvature * v * Z(k, c));
        });
        motion.C_v(row, c) = sumTerms<T>(placed, own, [&](const CouplerTerm& term, int k) {
          return T(2 * term.calcDerivative(2, ws.q[term.idx_q]) * ws.v[term.dof] * N(k, c));
        });
      }
      continue;
    }
    for (int c = 0; c < cluster.size; ++c) {
      const Vector6<T> J = calcDifference(motion, motion.J, own, c), dV = calcDifference(motion, motion.dV, own, c);
      const Vector6<T> J_V2 = crossMotion(J, V2), dnu = dV + J_V2;
      const Vector6<T> dq =
          calcDifference(motion, motion.dA, own, c) - crossMotion(V12, dV) + crossMotion(J, A2) - crossMotion(V1, J_V2);
      const Vector6<T> dv = calcDifference(motion, motion.dW, own, c) - crossMotion(V12, J);
      rows.writeAccelerationChange(1, J, dnu, dq, &motion.C_q(row, c));
      rows.writeAccelerationChange(1, Vector6<T>::Zero(), J, dv, &motion.C_v(row, c));
    }
  }
  applyMinusPlus(motion, motion.C_q, motion.dy);
  applyMinusPlus(motion, motion.C_v, motion.dv);
  sumPaths(cluster, motion.dA, [&](int k, int c, Vector6<T>& sum) {
    sum += N(k, c) * ws.dA.col(view.dofs[k]) + Z(k, c) * getTurn(k) + motion.dy(k, c) * ws.J.col(view.dofs[k]);
  });
  sumPaths(cluster, motion.dW, [&](int k, int c, Vector6<T>& sum) {
    sum += N(k, c) * getTurn(k) + motion.dv(k, c) * ws.J.col(view.dofs[k]);
  });
}

template <typename T>
void calcGeometricStiffness(const ClusterViewOf<T>& view, const ClusterMotionOf<T>& motion,
                            typename ArgumentsOf<T>::ConstVector forces, typename ArgumentsOf<T>::Matrix out) {
  const ReducedCluster& cluster = motion.cluster;
  const int n = static_cast<int>(cluster.dofs.size());
  out.setZero();
  for (size_t i = 0; i < view.closures.size(); ++i) {
    const Closure &placed = view.closures[i], &own = cluster.closures.closures[i];
    const int row = cluster.closures.offsets[i];
    for (size_t t = 0; t < own.terms.size(); ++t)
      if (const CouplerTerm& term = placed.terms[t]; !term.isLinear())
        for (int c = 0, k = own.terms[t].dof; c < cluster.size; ++c)
          out(k, c) += term.calcDerivative(2, view.ws.q[term.idx_q]) * forces[row] * motion.basis->N(k, c);
    if (own.kind == ClosureKind::Coupler) continue;
    const Vector6<T> W = calcClosureWrench(view.ws, placed, forces.segment(row, getRows(own.kind)));
    const ClosureRows<T> rows(view.ws, placed);
    const int dof1 = cluster.body_dof[own.body1];
    for (int c = 0; c < cluster.size; ++c) {
      Vector6<T> turned = Vector6<T>::Zero();
      if (own.kind == ClosureKind::Distance) turned = rows.calcTurned(W, calcDifference(motion, motion.J, own, c));
      Vector6<T> twist1 = Vector6<T>::Zero();
      if (dof1 >= 0) twist1 = motion.J.col(n * c + dof1);
      for (size_t d = 0; d < own.dofs.size(); ++d) {
        const int k = own.dofs[d];
        const Vector6<T> moved = crossForce(twist1 - motion.J.col(n * c + k), W) + turned;
        out(k, c) += own.signs[d] * view.ws.J.col(view.dofs[k]).dot(moved);
      }
    }
  }
}

template <typename T>
void calcClusterDrift(const ClusterViewOf<T>& view, const ReducedCluster& cluster, const ClusterBasisOf<T>& basis,
                      typename ArgumentsOf<T>::Vector rows, typename ArgumentsOf<T>::Vector drift,
                      const std::vector<ClosureChangeOf<T>>& changes) {
  for (size_t c = 0; c < view.closures.size(); ++c) {
    const ClosureChangeOf<T>* change =
        changes.empty() ? nullptr : &changes[static_cast<size_t>(cluster.closure_indices[c])];
    rows.segment(cluster.closures.offsets[c], getRows(view.closures[c].kind)) =
        calcClosureAcceleration(view.ws, view.closures[c], change);
  }
  for (size_t i = 0; i < basis.rows.size(); ++i) drift[i] = getEntry(rows.data(), basis.rows[i]);
}

template struct ClusterMotionOf<double>;
template void calcClusterDrift(const ClusterViewOf<double>&, const ReducedCluster&, const ClusterBasisOf<double>&,
                               ArgumentsOf<double>::Vector, ArgumentsOf<double>::Vector,
                               const std::vector<ClosureChangeOf<double>>&);
template void updateTwists(const ClusterViewOf<double>&, const ClusterBasisOf<double>&, ClusterMotionOf<double>&);
template void updateVelocityLift(const ClusterViewOf<double>&, ClusterMotionOf<double>&);
template void updateAccelerationLift(const ClusterViewOf<double>&, ClusterMotionOf<double>&);
template void calcGeometricStiffness(const ClusterViewOf<double>&, const ClusterMotionOf<double>&,
                                     ArgumentsOf<double>::ConstVector, ArgumentsOf<double>::Matrix);
template struct ClusterMotionOf<Lanes>;
template void calcClusterDrift(const ClusterViewOf<Lanes>&, const ReducedCluster&, const ClusterBasisOf<Lanes>&,
                               ArgumentsOf<Lanes>::Vector, ArgumentsOf<Lanes>::Vector,
                               const std::vector<ClosureChangeOf<Lanes>>&);
template void updateTwists(const ClusterViewOf<Lanes>&, const ClusterBasisOf<Lanes>&, ClusterMotionOf<Lanes>&);
template void updateVelocityLift(const ClusterViewOf<Lanes>&, ClusterMotionOf<Lanes>&);
template void updateAccelerationLift(const ClusterViewOf<Lanes>&, ClusterMotionOf<Lanes>&);
template void calcGeometricStiffness(const ClusterViewOf<Lanes>&, const ClusterMotionOf<Lanes>&,
                                     ArgumentsOf<Lanes>::ConstVector, ArgumentsOf<Lanes>::Matrix);

}  // namespace bielle
