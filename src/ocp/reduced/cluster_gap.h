#pragma once
// Change of coordinates where a node state q_k, with basis N_k, is not the next state q+ of the node before it: from
// the coordinates of the basis N' at q+ to those about q_k. With d = q+ (-) q_k, w = v+ - v_k, J_d the derivative of d
// with respect to q+ and Z' of cluster_motion.h at q+,
//     gap = ((W N_k)^T d, (W N_k)^T w),
//     dy+ <- P_q dy+,   dy_v+ <- P_v dy_v+ + P_z dy+,                                                               (1)
//     P_q = (W N_k)^T J_d N',   P_v = (W N_k)^T N',   P_z = (W N_k)^T Z'
#include "dynamics/cluster_motion.h"
#include "ocp/transcription.h"

namespace bielle {

// Gap of a loop cluster with n dofs and r reduced coordinates; T is double, or Lanes for several nodes at once.
template <typename T>
struct ClusterGapOf {
  explicit ClusterGapOf(const ReducedCluster& cluster);

  VectorX<T> q, v;  // to be filled: the node state, nq and n
  MatrixX<T> WN;    // to be filled: of its basis, n x r

  VectorX<T> y, y_v;         // r: the gap
  MatrixX<T> P_q, P_v, P_z;  // r x r

  // \param next, v_next  q+ and v+   \param Z  Z' (n x r)
  void update(const ReducedCluster& cluster, const ClusterBasisOf<T>& next, const VectorX<T>& v_next,
              const MatrixX<T>& Z);

 private:
  VectorX<T> d_, w_;  // n
  MatrixX<T> JdN_;    // n x r
};

}  // namespace bielle
