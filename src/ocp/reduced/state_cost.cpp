#include "ocp/reduced/state_cost.h"

#include "model/joint.h"

namespace bielle {
namespace {

// Number of stored Hessian entries of a reduced joint.
int countFree(const Joint& joint) { return 2 * joint.nv * joint.nv; }
int countCluster(const ReducedCluster& loop) { return 3 * loop.size * loop.size; }

// out += scale times the lower triangle of a matrix (n x n).
void addLower(const double* numbers, int n, double scale, Eigen::Block<MatrixMap> out) {
  for (int c = 0; c < n; ++c)
    for (int r = c; r < n; ++r) out(r, c) += scale * numbers[c * n + r];
}

}  // namespace

template <typename T>
StateCostModelOf<T>::StateCostModelOf(const Model& model, const Reduction& reduction) {
  int numbers = 0;
  for (int i : reduction.free_joints) numbers += countFree(model.joints()[i]);
  for (const ReducedCluster& loop : reduction.clusters) numbers += countCluster(loop);
  gradient.setZero(2 * reduction.size);
  hessian.setZero(numbers);
}

void addStateCostModel(const Model& model, const Reduction& reduction, const StateCostModel& cost, double scale,
                       StageModel& out) {
  const int nr = reduction.size;
  MatrixMap all = out.lxx();
  const Eigen::Index first = all.rows() - 2 * nr;  // after a time scale
  MatrixMap lxx(&all(first, first), 2 * nr, 2 * nr, Eigen::OuterStride<>(all.outerStride()));
  out.lx.tail(2 * nr) += scale * cost.gradient;
  const double* hessian = cost.hessian.data();
  for (size_t i = 0; i < reduction.free_joints.size(); ++i) {
    const Joint& joint = model.joints()[reduction.free_joints[i]];
    const int o = reduction.free_offsets[i], n = joint.nv;
    addLower(hessian, n, scale, lxx.block(o, o, n, n));
    addLower(hessian + n * n, n, scale, lxx.block(nr + o, nr + o, n, n));
    hessian += countFree(joint);
  }
  for (const ReducedCluster& loop : reduction.clusters) {
    const int o = loop.offset, n = loop.size;
    addLower(hessian, n, scale, lxx.block(o, o, n, n));
    lxx.block(nr + o, o, n, n) += scale * Eigen::Map<const MatrixXd>(hessian + n * n, n, n);
    addLower(hessian + 2 * n * n, n, scale, lxx.block(nr + o, nr + o, n, n));
    hessian += countCluster(loop);
  }
}

ReducedStateCost::ReducedStateCost(const Model& model, const Reduction& reduction)
    : model_(model), reduction_(reduction), derivatives_(model, reduction) {
  q_ref.setZero(model.nq());
  weights.setZero(2 * model.nv());
  for (Matrix3<Lanes>& coupling : couplings) coupling.setZero();
  for (VectorX<Lanes>* x : {&v_ref, &difference, &gradient_q_, &gradient_v_}) x->setZero(model.nv());
  for (const ReducedCluster& loop : reduction.clusters) {
    const int n = loop.model.nv(), r = loop.size;
    const VectorX<Lanes> column = VectorX<Lanes>::Zero(n);
    const MatrixX<Lanes> columns = MatrixX<Lanes>::Zero(n, r);
    clusters_.push_back({column, column, columns, columns, columns});
  }
}

Lanes ReducedStateCost::update(const VectorX<Lanes>& q, const VectorX<Lanes>& v) {
  for (const Joint& joint : model_.joints()) {
    if (joint.nv == 0) continue;
    calcJointDifference(joint, q_ref.segment(joint.idx_q, joint.nq), q.segment(joint.idx_q, joint.nq),
                        difference.segment(joint.idx_v, joint.nv));
  }
  Lanes of_q = 0, of_v = 0;
  const int nv = model_.nv();
  for (int k = 0; k < nv; ++k) {
    const Lanes d = difference[k], e = v[k] - v_ref[k];
    of_q += weights[k] * d * d;
    of_v += weights[nv + k] * e * e;
  }
  for (int k = 0; model_.hasFreeFlyer() && k < 2; ++k) {
    const Vector3<Lanes> d = difference.segment<3>(3 * k), e = v.segment<3>(3 * k) - v_ref.segment<3>(3 * k);
    of_q += d.dot(couplings[k] * d);
    of_v += e.dot(couplings[2 + k] * e);
  }
  return 0.5 * (of_q + of_v);
}

const StateCostModelOf<Lanes>& ReducedStateCost::differentiate(const VectorX<Lanes>& v,
                                                               const std::vector<ClusterLiftOf<Lanes>>& lifts) {
  const int nv = model_.nv();
  for (int k = 0; k < nv; ++k) {
    gradient_q_[k] = weights[k] * difference[k];
    gradient_v_[k] = weights[nv + k] * (v[k] - v_ref[k]);
  }
  for (int k = 0; model_.hasFreeFlyer() && k < 2; ++k) {
    const Vector3<Lanes> d = difference.segment<3>(3 * k), e = v.segment<3>(3 * k) - v_ref.segment<3>(3 * k);
    gradient_q_.segment<3>(3 * k) += couplings[k] * d;
    gradient_v_.segment<3>(3 * k) += couplings[2 + k] * e;
  }
  Lanes* hessian = derivatives_.hessian.data();
  for (size_t i = 0; i < reduction_.free_joints.size(); ++i) {
    const Joint& joint = model_.joints()[reduction_.free_joints[i]];
    differentiateFree(joint, reduction_.free_offsets[i], hessian);
    hessian += countFree(joint);
  }
  for (size_t i = 0; i < reduction_.clusters.size(); ++i) {
    differentiateCluster(reduction_.clusters[i], *lifts[i].motion, clusters_[i], hessian);
    hessian += countCluster(reduction_.clusters[i]);
  }
  return derivatives_;
}

// J_d^T W_q J_d of a joint whose J_d is not the identity; the gradient of its coordinates becomes J_d^T W_q d.
ReducedStateCost::JointMatrix ReducedStateCost::differentiateJoint(const Joint& joint) {
  const int k = joint.idx_v, n = joint.nv;
  JointMatrix J(n, n);
  calcJointDifferenceJacobian(joint, difference.segment(k, n), J);
  JointMatrix WJ = weights.segment(k, n).asDiagonal() * J;
  for (int i = 0; isBase(joint) && i < 2; ++i) WJ.middleRows<3>(3 * i) += couplings[i] * J.middleRows<3>(3 * i);
  Eigen::Matrix<Lanes, Eigen::Dynamic, 1, Eigen::ColMajor, 6, 1> gradient =
      J.transpose().lazyProduct(gradient_q_.segment(k, n));
  gradient_q_.segment(k, n) = gradient;
  return J.transpose().lazyProduct(WJ);
}

void ReducedStateCost::differentiateFree(const Joint& joint, int offset, Lanes* hessian) {
  const int k = joint.idx_v, n = joint.nv;
  Eigen::Map<MatrixX<Lanes>> yy(hessian, n, n), vv(hessian + n * n, n, n);
  if (isCurved(joint))
    yy = differentiateJoint(joint);
  else
    yy = weights.segment(k, n).asDiagonal();
  vv = weights.segment(model_.nv() + k, n).asDiagonal();
  for (int i = 0; isBase(joint) && i < 2; ++i) vv.block<3, 3>(3 * i, 3 * i) += couplings[2 + i];
  derivatives_.gradient.segment(offset, n) = gradient_q_.segment(k, n);
  derivatives_.gradient.segment(reduction_.size + offset, n) = gradient_v_.segment(k, n);
}

void ReducedStateCost::differentiateCluster(const ReducedCluster& loop, const ClusterMotionOf<Lanes>& motion,
                                            Cluster& cluster, Lanes* hessian) {
  const int r = loop.size, nv = model_.nv();
  const MatrixX<Lanes>&N = motion.basis->N, &Z = motion.Z;
  for (size_t j = 0; j < loop.joints.size(); ++j) {
    const Joint &joint = model_.joints()[loop.joints[j]], &own = loop.model.joints()[j + 1];
    const auto rows = N.middleRows(own.idx_v, own.nv);
    if (isCurved(joint))
      cluster.QN.middleRows(own.idx_v, own.nv) = differentiateJoint(joint).lazyProduct(rows);
    else
      cluster.QN.middleRows(own.idx_v, own.nv) = weights.segment(joint.idx_v, joint.nv).asDiagonal() * rows;
  }
  for (size_t k = 0; k < loop.dofs.size(); ++k) {
    const int dof = loop.dofs[k];
    cluster.gradient_q[k] = gradient_q_[dof];
    cluster.gradient_v[k] = gradient_v_[dof];
    for (int c = 0; c < r; ++c) {
      cluster.WZ(k, c) = weights[nv + dof] * Z(k, c);
      cluster.WN(k, c) = weights[nv + dof] * N(k, c);
    }
  }
  auto l_y = derivatives_.gradient.segment(loop.offset, r),
       l_v = derivatives_.gradient.segment(reduction_.size + loop.offset, r);
  Eigen::Map<MatrixX<Lanes>> yy(hessian, r, r), vy(hessian + r * r, r, r), vv(hessian + 2 * r * r, r, r);
  for (auto* x : {&l_y, &l_v}) x->setZero();
  for (auto* x : {&yy, &vy, &vv}) x->setZero();
  addSmallProductTransposed(N, cluster.gradient_q, l_y);
  addSmallProductTransposed(Z, cluster.gradient_v, l_y);
  addSmallProductTransposed(N, cluster.gradient_v, l_v);
  addSmallProductTransposed(N, cluster.QN, yy);
  addSmallProductTransposed(Z, cluster.WZ, yy);
  addSmallProductTransposed(N, cluster.WZ, vy);
  addSmallProductTransposed(N, cluster.WN, vv);
}

template struct StateCostModelOf<double>;
template struct StateCostModelOf<Lanes>;

}  // namespace bielle
