#pragma once
/// \file Reduced coordinates: the manifold of closed configurations, loop cluster by loop cluster.
///
/// A loop cluster involves few dofs (Bipetto's knee: 7, with 6 closure rows). Relative to the body that carries it, it
/// is a small mechanism, here a `ReducedCluster` with its own massless Model whose world is that body. At a closed
/// configuration, let J (rank x n) be independent rows of its closure Jacobian, chosen by pivoting, W the metric of the
/// cluster (diagonal, constant), and
///     J N = 0,   N^T W N = I,   J^+ = W^{-1} J^T (J W^{-1} J^T)^{-1}                                               (1)
/// N (n x (n - rank)) is an orthonormal basis of the tangent space and (W N)^T reads its coordinates. It is chosen anew
/// at every point, without a chart: a dead point of a linkage, where motor or joint coordinates break down, is a
/// regular point. Only a change of rank is singular. The choice is insensitive to rounding: a point has one basis,
/// however it is reached.
///
/// To move on the manifold from a point q_0 by a displacement d (n), close along the rows at q_0:
///     q = q_0 (+) (d - W^{-1} J(q_0)^T zeta)    with zeta such that q is closed                                    (2)
/// so that (W N)(q_0)^T (q (-) q_0) = (W N)(q_0)^T d: (2) inverts the difference in reduced coordinates exactly.
///
/// **Idle spins.** A rod on two balls turns about its own line, and nothing else moves. Of a cluster, the joints behind one joint (dofs
/// D) have such a spin s if it is the only motion with
///     J_D s = 0,   v_p(s) = 0,   s = 0 on motors and serial joints                                                 (3)
/// at a closed configuration and beside it, where v_p are the velocities of all their bodies at the centre p of that joint: with
/// ends that are held by closures, they turn about a line; and bodies that carry other joints or soles are at rest. In a
/// linkage (linkage.h) the rows s^T v = 0 are added to J, without residual or drift: s(q) changes neither motors nor output.
///
/// W is the inertia that each dof moves at the configuration of the reduction: corrections move light rods rather than
/// legs, as constraint impulses do. It also sets the scale between metres and radians.
#include <string>
#include <vector>

#include "bielle/dynamics/closure.h"
#include "math/small_dense.h"

namespace bielle {

/// Dofs [begin, end) of a cluster that move each other's axes: those of one joint, or one of a universal joint.
struct DofGroup {
  int begin = 0, end = 0;
  int parent = -1;        ///< last dof of the group before it on the path to the root, -1: none
  int parent_group = -1;  ///< that group
};

/// A closure row whose remainder after the rows before it is below this, relative to the first row, counts as
/// dependent.
constexpr double kRankTolerance = 1e-6;

/// A motion of Eq. (3).
struct IdleSpin {
  std::vector<int> dofs;    ///< of the cluster's joints that have a part in it
  std::vector<int> bodies;  ///< of its model that turn
};

/// One loop cluster as a separate mechanism.
struct ReducedCluster {
  Model model;                       ///< joints and closures of the cluster, massless, over their common root
  ConstraintSet closures;            ///< of `model`, without stabilisation
  std::vector<int> closure_indices;  ///< their indices in the whole model
  std::vector<Closure> placed;       ///< the same closures with bodies and dofs of the whole model
  int root = 0;                      ///< body of the whole model that carries the cluster
  std::vector<int> joints;           ///< joint indices in the whole model, in the order of `model`
  std::vector<int> dofs;             ///< velocity coordinates in the whole model (n)
  std::vector<int> own_dofs;         ///< 0, 1, .. n - 1
  std::vector<DofGroup> groups;      ///< parents first
  std::vector<int> body_dof;         ///< per body of `model`, the last dof on its path, -1 for the root
  VectorXd metric;                   ///< n, diagonal of W
  VectorXd inverse_metric;           ///< n, diagonal of W^{-1}
  VectorXd inverse_root;             ///< n, diagonal of W^{-1/2}
  std::vector<IdleSpin> spins;       ///< those found by Eq. (3)
  bool holds_spins = false;          ///< whether they are left aside, by a row each after those of the closures
  int rank = 0;                      ///< of J
  int offset = 0, size = 0;          ///< reduced coordinates [offset, offset + size), size = n - rank

  int numRows() const { return closures.rows + (holds_spins ? static_cast<int>(spins.size()) : 0); }
};

/// A free joint or a cluster: a node of the reduced tree. Parents come first.
struct ReducedJoint {
  int joint = -1, cluster = -1;  ///< either a joint of the whole model, or an index into Reduction::clusters
  int offset = 0, size = 0;      ///< reduced coordinates
  int parent = -1;               ///< reduced joint that carries it, -1: the world
  std::vector<int> path;         ///< dofs of the parent reduced joint that move it: positions among the parent's dofs
  std::vector<int> outer;        ///< reduced coordinates of all reduced joints on its path to the root
};

/// How the velocity coordinates of a model split into clusters and free dofs.
struct Reduction {
  std::vector<ReducedCluster> clusters;
  std::vector<int> free_joints;   ///< joints outside all loops
  std::vector<int> free_offsets;  ///< first reduced coordinate of each
  std::vector<ReducedJoint> joints;
  std::vector<int> joint_of_body;  ///< per body of the whole model, -1 for the world
  int size = 0;                    ///< reduced coordinates: the mobility of the robot
};

/// \param q closed configuration at which ranks are determined
/// \throws InputError when q is not closed (to 1e-8), the points of a point spring are closer than kShortestSpring or the
/// model has no mobility
Reduction makeReduction(const Model& model, ConstVectorRef q);

/// Parent, path and outer coordinates of a frame fixed to a body (without coordinates of its own).
ReducedJoint makeTip(const Model& model, const Reduction& reduction, int body);

/// Bases (1) at a closed configuration of a cluster; T is double, or Lanes for several nodes at once.
template <typename T>
struct ClusterBasisOf {
  explicit ClusterBasisOf(const ReducedCluster& cluster);
  VectorX<T> q;                                  ///< nq of the cluster
  MatrixX<T> N;                                  ///< n x size
  MatrixX<T> WN;                                 ///< n x size
  MatrixX<T> J;                                  ///< rank x n, independent rows
  MatrixX<T> L;                                  ///< rank x rank, Cholesky factor of J W^{-1} J^T
  std::vector<typename LogicOf<T>::Index> rows;  ///< indices of the closure rows in J
};
using ClusterBasis = ClusterBasisOf<double>;

/// (J W^{-1} J^T)^{-1} X in place (rank x k).
template <typename T, typename Matrix>
void solveGram(const ClusterBasisOf<T>& basis, Matrix&& X) {
  solveSmallCholesky(basis.L, X);
}
/// out = s J^+ X = s W^{-1} J^T (J W^{-1} J^T)^{-1} X for X (rank x k), which is overwritten; out n x k.
template <typename T>
void applyPseudoInverse(const ReducedCluster& cluster, const ClusterBasisOf<T>& basis, double s,
                        typename ArgumentsOf<T>::Matrix X, typename ArgumentsOf<T>::Matrix out);

template <typename T>
struct ClosureChangeOf;  // closure_change.h

/// Scratch memory for updating and closing a cluster, one per thread.
template <typename T>
struct ClusterScratchOf {
  explicit ClusterScratchOf(const ReducedCluster& cluster);
  using Index = typename LogicOf<T>::Index;
  WorkspaceOf<T> ws;                                         ///< of the cluster's model
  const std::vector<ClosureChangeOf<T>>* changes = nullptr;  ///< of the whole model's closures; null or empty: none
  VectorX<T> residual, correction;
  MatrixX<T> J_all, J, JW;   // all rows; independent ones at the iterate; J W^{-1} at the start
  MatrixX<T> newton, fresh;  // factors of Newton's matrix; of a new one
  std::vector<Index> pivots, fresh_pivots;
  MatrixX<T> reflected, reflectors;    // of J W^{-1/2}; Householder vectors
  VectorX<T> beta, products, rest;     // their scales; scratch; squared norms of the remainders of the rows
  typename LogicOf<T>::Mask closed{};  // whether the last closing reached the bases
};
using ClusterScratch = ClusterScratchOf<double>;

/// A closed configuration of a cluster with its derived data; with Lanes one for each lane.
template <typename T>
struct ClusterStateOf {
  explicit ClusterStateOf(const ReducedCluster& cluster);
  ClusterBasisOf<T> basis;
  std::vector<SE3Of<T>> placements;  ///< of the bodies of the cluster's model, relative to its root
  VectorX<T> zeta;                   ///< rank, of the closing that produced it
  VectorX<T> step;                   ///< n, its d - W^{-1} J(q_0)^T zeta
};
using ClusterState = ClusterStateOf<double>;

/// Kinematics, Jacobian and bases (1) at q (cluster's nq), which also stay in the scratch. False if the rank is not
/// that of the cluster. No allocation.
template <typename T>
typename LogicOf<T>::Mask updateClusterState(const ReducedCluster& cluster, ClusterScratchOf<T>& scratch,
                                             typename ArgumentsOf<T>::ConstVector q, ClusterStateOf<T>& out);
/// Closes from `start` by Eq. (2) and updates the state. False if it does not close or the rank changes. No allocation.
/// \param zeta_guess  rank, initial guess of zeta, or empty
template <typename T>
typename LogicOf<T>::Mask closeCluster(const ReducedCluster& cluster, ClusterScratchOf<T>& scratch,
                                       const ClusterBasisOf<T>& start, typename ArgumentsOf<T>::ConstVector d,
                                       const VectorX<T>& zeta_guess, ClusterStateOf<T>& out);
/// Writes the rows of J that hold spins, after those of the closures. \param J  numRows() x n. No allocation.
void updateSpinRows(const ReducedCluster& cluster, MatrixXd& J);
/// Loads placements and columns of a state into the scratch.
void loadClusterState(const ReducedCluster& cluster, const ClusterState& state, ClusterScratch& scratch);
/// Why the last of these functions returned false, naming a closure; needs the scratch as that function left it.
/// \param lane  of Lanes; 0 for double
template <typename T>
std::string describeFailure(const ReducedCluster& cluster, const ClusterScratchOf<T>& scratch, int lane = 0);

/// A ClusterState with its own scratch: simpler where there are few of them.
class ClusterPoint {
 public:
  explicit ClusterPoint(const ReducedCluster& cluster) : scratch_(cluster), state_(cluster) {}
  bool update(const ReducedCluster& cluster, ConstVectorRef q) {
    return updateClusterState(cluster, scratch_, q, state_);
  }
  bool close(const ReducedCluster& cluster, const ClusterBasis& start, ConstVectorRef d, const VectorXd& zeta_guess) {
    return closeCluster(cluster, scratch_, start, d, zeta_guess, state_);
  }
  const ClusterBasis& basis() const { return state_.basis; }
  std::string describeFailure(const ReducedCluster& cluster) const {
    return bielle::describeFailure(cluster, scratch_);
  }
  Workspace& workspace() { return scratch_.ws; }  ///< positions are those of the last update() or close()
  void solveGram(MatrixRef X) const { bielle::solveGram(basis(), X); }
  /// Independent rows out of all rows (m x k -> rank x k).
  void selectIndependent(const MatrixXd& all, MatrixXd& out) const;

 private:
  ClusterScratch scratch_;
  ClusterState state_;
};

/// Expands forces on the independent rows to all rows (m).
template <typename T>
void expandIndependent(const ClusterBasisOf<T>& basis, typename ArgumentsOf<T>::ConstVector independent,
                       typename ArgumentsOf<T>::Vector all);

/// Copy the segments of a cluster from and to vectors of the whole model.
template <typename T>
void gatherConfiguration(const Model& model, const ReducedCluster& cluster, typename ArgumentsOf<T>::ConstVector q,
                         typename ArgumentsOf<T>::Vector q_cluster);
template <typename T>
void scatterConfiguration(const Model& model, const ReducedCluster& cluster,
                          typename ArgumentsOf<T>::ConstVector q_cluster, typename ArgumentsOf<T>::Vector q);
inline void gatherConfiguration(const Model& model, const ReducedCluster& cluster, ConstVectorRef q,
                                VectorRef q_cluster) {
  gatherConfiguration<double>(model, cluster, q, q_cluster);
}
inline void scatterConfiguration(const Model& model, const ReducedCluster& cluster, ConstVectorRef q_cluster,
                                 VectorRef q) {
  scatterConfiguration<double>(model, cluster, q_cluster, q);
}
void gatherVelocity(const ReducedCluster& cluster, ConstVectorRef v, VectorRef v_cluster);
void scatterVelocity(const ReducedCluster& cluster, ConstVectorRef v_cluster, VectorRef v);

}  // namespace bielle
