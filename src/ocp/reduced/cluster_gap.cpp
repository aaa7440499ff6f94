#include "ocp/reduced/cluster_gap.h"

#include "model/joint.h"

namespace bielle {

template <typename T>
ClusterGapOf<T>::ClusterGapOf(const ReducedCluster& cluster) {
  const int n = cluster.model.nv(), r = cluster.size;
  q.setZero(cluster.model.nq());
  for (VectorX<T>* x : {&v, &d_, &w_}) x->setZero(n);
  for (VectorX<T>* x : {&y, &y_v}) x->setZero(r);
  for (MatrixX<T>* x : {&WN, &JdN_}) x->setZero(n, r);
  for (MatrixX<T>* x : {&P_q, &P_v, &P_z}) x->setZero(r, r);
}

template <typename T>
void ClusterGapOf<T>::update(const ReducedCluster& cluster, const ClusterBasisOf<T>& next, const VectorX<T>& v_next,
                             const MatrixX<T>& Z) {
  w_ = v_next - v;
  JdN_ = next.N;
  for (const Joint& joint : cluster.model.joints()) {
    if (joint.nv == 0) continue;
    const int i = joint.idx_v, n = joint.nv;
    calcJointDifference(joint, q.segment(joint.idx_q, joint.nq), next.q.segment(joint.idx_q, joint.nq),
                        d_.segment(i, n));
    if (!isCurved(joint)) continue;
    JointMatrixOf<T> J(n, n);
    calcJointDifferenceJacobian(joint, d_.segment(i, n), J);
    JdN_.middleRows(i, n) = J.lazyProduct(next.N.middleRows(i, n));
  }
  for (VectorX<T>* x : {&y, &y_v}) x->setZero();
  for (MatrixX<T>* x : {&P_q, &P_v, &P_z}) x->setZero();
  addSmallProductTransposed(WN, d_, y);
  addSmallProductTransposed(WN, w_, y_v);
  addSmallProductTransposed(WN, JdN_, P_q);
  addSmallProductTransposed(WN, next.N, P_v);
  addSmallProductTransposed(WN, Z, P_z);
}

template struct ClusterGapOf<double>;
template struct ClusterGapOf<Lanes>;

}  // namespace bielle
