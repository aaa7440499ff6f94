#pragma once
// A state cost in the coordinates of reduced_kernel.h.
//
// With d = q (-) q_ref, J_d its Jacobian by q, e = v - v_ref, and the weights W_q and W_v (diagonal but for blocks of a free base),
//     l = 1/2 (d.W_q d + e.W_v e)
// By Gauss-Newton, with Q = J_d^T W_q J_d, a reduced joint (reduction.h) with bases N and Z of Eq. (a) (outside all
// clusters N = 1, Z = 0) contributes
//     l_y  = N^T J_d^T W_q d + Z^T W_v e,     l_v  = N^T W_v e
//     l_yy = N^T Q N + Z^T W_v Z,             l_vy = N^T W_v Z,         l_vv = N^T W_v N                            (h)
#include <array>

#include "dynamics/reduced_tree.h"
#include "ocp/transcription.h"

namespace bielle {

// Gradient (2 size), and the Hessian joint by joint: l_yy and the diagonal of l_vv of each joint outside all clusters,
// then l_yy, l_vy and l_vv of each cluster.
template <typename T>
struct StateCostModelOf {
  explicit StateCostModelOf(const Model& model, const Reduction& reduction);
  VectorX<T> gradient, hessian;
};
using StateCostModel = StateCostModelOf<double>;

// Adds scale times the cost to `out`: the gradient, and the lower triangle of lxx.
void addStateCostModel(const Model& model, const Reduction& reduction, const StateCostModel& cost, double scale,
                       StageModel& out);

class ReducedStateCost {
 public:
  ReducedStateCost(const Model& model, const Reduction& reduction);

  VectorX<Lanes> q_ref, v_ref, weights;  // nq, nv, 2 nv: W_q, W_v
  // What the axes of StateCost add to those of a free base: of its place and rotation, and of their rates.
  std::array<Matrix3<Lanes>, 4> couplings;
  VectorX<Lanes> difference;  // nv, d

  // Computes the value at (q, v), and d.
  Lanes update(const VectorX<Lanes>& q, const VectorX<Lanes>& v);
  // Computes Eq. (h) for the last d, given the lifts of the same state up to the velocities.
  const StateCostModelOf<Lanes>& differentiate(const VectorX<Lanes>& v, const std::vector<ClusterLiftOf<Lanes>>& lifts);

 private:
  using JointMatrix = Eigen::Matrix<Lanes, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, 6, 6>;
  bool isBase(const Joint& joint) const { return joint.idx_v == 0 && model_.hasFreeFlyer(); }
  JointMatrix differentiateJoint(const Joint& joint);
  void differentiateFree(const Joint& joint, int offset, Lanes* hessian);
  struct Cluster {
    VectorX<Lanes> gradient_q, gradient_v;  // n
    MatrixX<Lanes> QN, WZ, WN;              // n x r: Q N, W_v Z, W_v N
  };
  void differentiateCluster(const ReducedCluster& loop, const ClusterMotionOf<Lanes>& motion, Cluster& cluster,
                            Lanes* hessian);

  Model model_;
  const Reduction& reduction_;
  VectorX<Lanes> gradient_q_, gradient_v_;  // nv, J_d^T W_q d and W_v e
  std::vector<Cluster> clusters_;
  StateCostModelOf<Lanes> derivatives_;
};

}  // namespace bielle
