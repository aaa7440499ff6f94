#pragma once
// A state cost in the coordinates of reduced_node.h, of one node (T = double) or of several at once (T = Lanes).
//
// With d = q (-) q_ref, J_d its Jacobian by q, e = v - v_ref, and the weights W_q and W_v (diagonal),
//     l = 1/2 (d.W_q d + e.W_v e)
// A reduced joint (reduction.h) with bases N and Z of Eq. (a) (a free joint: N = 1, Z = 0) has, with H = J_d^T W_q J_d by Gauss-Newton,
//     l_y  = N^T J_d^T W_q d + Z^T W_v e,     l_v  = N^T W_v e
//     l_yy = N^T H N + Z^T W_v Z,             l_vy = N^T W_v Z,         l_vv = N^T W_v N                              (h)
#include "bielle/dynamics/reduced_tree.h"
#include "node_model.h"

namespace bielle {

// Gradient (2 size), and reduced joint by reduced joint l_yy and the diagonal of l_vv of the free joints, l_yy, l_vy and l_vv of the clusters.
template <typename T>
struct StateCostModelOf {
  explicit StateCostModelOf(const Model& model, const Reduction& reduction);
  VectorX<T> gradient, hessian;
};
using StateCostModel = StateCostModelOf<double>;

// out += scale times it: the lower triangle of lxx.
void addStateCostModel(const Model& model, const Reduction& reduction, const StateCostModel& cost, double scale,
                       StageModel& out);

template <typename T>
class ReducedStateCostOf {
 public:
  ReducedStateCostOf(const Model& model, const Reduction& reduction);

  VectorX<T> q_ref, v_ref, weights;  // nq, nv, 2 nv: W_q, W_v
  VectorX<T> difference;             // nv, d

  // The value at (q, v), and d.
  T update(const VectorX<T>& q, const VectorX<T>& v);
  // Eq. (h) where d is that of the state whose lifts these are, up to the velocities.
  const StateCostModelOf<T>& differentiate(const VectorX<T>& v, const std::vector<ClusterLiftOf<T>>& lifts);

 private:
  using JointMatrix = Eigen::Matrix<T, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, 6, 6>;
  JointMatrix differentiateJoint(const Joint& joint);
  void differentiateFree(const Joint& joint, int offset, T* hessian);
  struct Cluster {
    VectorX<T> gradient_q, gradient_v;  // n
    MatrixX<T> HN, WZ, WN;              // n x r: H N, W_v Z, W_v N
  };
  void differentiateCluster(const ReducedCluster& loop, const ClusterMotionOf<T>& motion, Cluster& cluster, T* hessian);

  const Model& model_;
  const Reduction& reduction_;
  VectorX<T> gradient_q_, gradient_v_;  // nv, J_d^T W_q d and W_v e
  std::vector<Cluster> clusters_;
  StateCostModelOf<T> derivatives_;
};

}  // namespace bielle
