#pragma once
/// \file A robot in reduced coordinates (src/dynamics/reduction.h), moved step by step: loops are closed at every step.
///
/// With the bases N at q, v = N w, and the joints outside all clusters as the case N = 1,
///
///     M^ w' = N^T (tau + sum J_b^T W_b - b - M a_d),   a = N w' + a_d                                              (1)
///
/// where a_d, minus the pseudo-inverse of the closures times their drift, keeps the loops closed. The steps are those of
/// robot_problem.h, Eq. (4).
#include <string>
#include <vector>

#include "bielle/dynamics/workspace.h"
#include "dynamics/reduced_tree.h"
#include "dynamics/reduction.h"

namespace bielle::worlds {

/// No function allocates after the constructor, except to describe a failure.
class ClosedTree {
 public:
  /// \param q  closed configuration at which ranks are determined   \param tips  bodies
  /// whose velocities and loads are of interest
  /// \throws InputError as makeReduction() does
  ClosedTree(const Model& model, ConstVectorRef q, const std::vector<int>& tips);
  ClosedTree(const ClosedTree&) = delete;
  ClosedTree& operator=(const ClosedTree&) = delete;

  /// Sets a closed configuration, and the velocity nearest to v that keeps it closed.
  /// \returns false where the linkages are singular; failure() then names a closure, also below
  bool set(ConstVectorRef q, ConstVectorRef v);
  /// Moves with the present velocity for a duration h, not zero: where a loop does not close, by two halves, which are
  /// divided again up to kMostHalvings times. If that does not help, the state is somewhere on the way: restore() it.
  bool drift(double h, int halvings = kMostHalvings);
  static constexpr int kMostHalvings = 6;
  /// Keeps configuration and velocity, and returns to those that were kept last. Whole turns of far angles are left out.
  void keep();
  void restore();
  /// M^, and the columns of the tips, at q.
  void updateMassMatrix();
  /// The part N^T (tau - b - M a_d) of Eq. (1) at the velocity w + dw (size).
  void updateLoads(ConstVectorRef tau, const VectorXd& dw);
  /// w <- w + dw
  void kick(const VectorXd& dw);

  double calcPotential() const;  ///< of gravity and springs of the model, J
  double calcEnergy();           ///< that and the kinetic one, J

  int size() const { return reduction_.size; }
  const MatrixXd& massMatrix() const { return M_; }
  const VectorXd& loads() const { return loads_; }
  const VectorXd& reducedVelocity() const { return w_; }  ///< w
  const VectorXd& configuration() const { return q_; }    ///< nq, without turns()
  const VectorXd& turns() const { return turns_; }        ///< nq, whole turns of hinges that nothing counts, rad
  const VectorXd& velocity() const { return v_; }         ///< nv
  const SE3& getPlacement(int body) const { return ws_.X_WB[body]; }
  /// Columns J_b N of a tip, about the origin of the world; `outer` are their indices into w.
  const ReducedTree::Columns& getTip(int index) const { return tree_.getTip(index); }
  /// Row `dof` of N: calls visit(index into w, entry) for entries that may differ from zero.
  template <typename Visit>
  void visitRow(int dof, const Visit& visit) const {
    const DofPlace& place = places_[dof];
    if (place.cluster < 0) {
      visit(place.index, 1.0);
      return;
    }
    const ReducedCluster& cluster = reduction_.clusters[place.cluster];
    for (int c = 0; c < cluster.size; ++c)
      visit(cluster.offset + c, clusters_[place.cluster].state.basis.N(place.index, c));
  }
  /// Why set() or drift() has just failed, with the closure and how far it is open.
  std::string failure() const;

 private:
  struct Cluster {
    explicit Cluster(const ReducedCluster& cluster);
    const ReducedCluster& cluster;
    ClusterScratch scratch;
    ClusterState state, next, kept;
    ClusterMotion motion;
    // n; n; m; rank: (J W^{-1} J^T)^{-1} times the drift of the closures; rank
    VectorXd d, a_d, rows, drift, zeta;
  };
  struct DofPlace {
    int cluster = -1, index = 0;  // row of N of the cluster; without one, index into w
  };
  bool driftAtOnce(double h);
  void updateTree();
  void addReduced(const VectorXd& dw, VectorXd& v) const;

  Model model_;
  const Reduction reduction_;
  std::vector<Cluster> clusters_;
  std::vector<ClusterLift> lifts_;
  std::vector<DofPlace> places_;
  ReducedTree tree_;
  Workspace ws_;
  MatrixXd M_;  // size x size
  const std::vector<int> free_turns_;
  VectorXd turns_;                   // nq
  VectorXd q_, q_next_, v_;          // nq, nq, nv
  VectorXd v_foreseen_, a_d_;        // nv
  VectorXd w_, w_foreseen_, loads_;  // size
  VectorXd q_kept_, w_kept_;         // nq, size
  size_t failed_ = 0;                // cluster
};

}  // namespace bielle::worlds
