#pragma once
/// \file A robot in reduced coordinates (src/dynamics/reduction.h), moved step by step: loops are closed at every step.
///
/// With the bases N at q, v = N w, and the joints outside all clusters as the case N = 1,
///
///     M^ w' = N^T (tau + sum J_b^T W_b - b - M a_d),   a = N w' + a_d                                              (1)
///
/// where a_d, minus the pseudo-inverse of the closures times their drift, keeps the loops closed. The steps are those of
/// robot_problem.h, Eq. (4).
///
/// T is double, or Lanes for as many robots at once. Lanes never mix: what a function does to one robot is the same to the last bit
/// whatever the others do, since those that a mask leaves out stay as they are.
#include <array>
#include <string>
#include <utility>
#include <vector>

#include "bielle/dynamics/workspace.h"
#include "dynamics/closure_change.h"
#include "dynamics/reduced_tree.h"
#include "dynamics/reduction.h"
#include "math/lane_masks.h"

namespace bielle::worlds {

/// No function allocates after the constructor, except to describe a failure.
template <typename T>
class ClosedTreeOf {
 public:
  using Vector = VectorX<T>;
  using Mask = MaskOf<T>;

  /// What there is to remember of robots while others use the tree.
  struct State {
    Vector q, turns, v, w;                    ///< nq, nq, nv, size
    std::vector<ClusterStateOf<T>> clusters;  ///< at q
    std::vector<Vector> drifts;               ///< rank: (J W^{-1} J^T)^{-1} times the drift of the closures
    std::vector<Vector> thirds;     ///< rank: what beyond that closed them last, over the cube of the duration
    Vector mass_factors, armature;  ///< numBodies, empty where all are 1; nv
    std::vector<ClosureChangeOf<T>> changes;  ///< of the closures; empty where all are those of the model
  };

  /// \param q  closed configuration at which ranks are determined   \param tips  bodies
  /// whose velocities and loads are of interest
  /// \throws InputError as makeReduction() does
  ClosedTreeOf(const Model& model, ConstVectorRef q, const std::vector<int>& tips);
  ClosedTreeOf(const ClosedTreeOf&) = delete;
  ClosedTreeOf& operator=(const ClosedTreeOf&) = delete;

  /// Sets closed configurations of the robots of the mask, and the velocities nearest to v that keep them closed. Loops with
  /// closures of their own are closed from there, by Eq. (2) of reduction.h.
  /// \returns false where that fails or linkages are singular; failure() then names a closure, also below
  Mask set(const Vector& q, const Vector& v, const Mask& which);
  /// Masses and inertias of bodies are those of the model times factors (numBodies), rotors have an armature (nv), from now on. W of
  /// reduction.h stays that of the model.
  void setInertias(const Vector& mass_factors, const Vector& armature, const Mask& which);
  /// Robots of the mask have these closures (of the model, all) from their next set() on.
  void setClosures(const std::vector<ClosureChangeOf<T>>& changes, const Mask& which);
  /// Robots of the mask move with the present velocity for a duration h, not zero: where a loop does not close, by two halves, which
  /// are divided again up to kMostHalvings times. Those that do not are somewhere on the way: restore() them.
  Mask drift(const T& h, const Mask& which, int halvings = kMostHalvings);
  static constexpr int kMostHalvings = 6;
  /// Keeps configuration and velocity, and returns to those that were kept last. Whole turns of far angles are left out.
  void keep(const Mask& which);
  void restore(const Mask& which);
  /// M^, and the columns of the tips, at q.
  void updateMassMatrix();
  /// The part N^T (tau - b - M a_d) of Eq. (1) at the velocity w + dw (size), less dampers and friction of joints, and the
  /// drift for the next drift() of those of the mask.
  void updateLoads(const Vector& tau, const Vector& dw, const Mask& which);
  /// Sizes of the forces of closures, without their moments, N, in a step of length h that changes w by dw. Where rows
  /// are redundant they are those of least norm. Needs updateLoads().
  /// \param on_bodies  numBodies, wrenches (world)   \param on_dofs  nv, what else acts there beside tau and springs
  /// \param closures  of the model, those of interest   \param sizes  one each
  void updateClosureForces(const T& h, const Vector& dw, const std::vector<Vector6<T>>& on_bodies,
                           const Vector& on_dofs, const std::vector<int>& closures, Vector& sizes);
  /// w <- w + dw
  void kick(const Vector& dw, const Mask& which);
  /// Exchanges the robots for others. Placements and all that is updated are those of the former until the next drift().
  void swap(State& state) {
    std::swap(state_, state);
    ws_.armature = state_.armature;
  }
  const State& state() const { return state_; }

  T calcMass() const;       ///< kg
  T calcPotential() const;  ///< of gravity and springs of the model, J
  T calcEnergy();           ///< that and the kinetic one, J

  const Reduction& reduction() const { return reduction_; }
  int size() const { return reduction_.size; }
  const MatrixX<T>& massMatrix() const { return M_; }
  const Vector& loads() const { return loads_; }
  const Vector& reducedVelocity() const { return state_.w; }  ///< w
  const Vector& configuration() const { return state_.q; }    ///< nq, without turns()
  const Vector& turns() const { return state_.turns; }        ///< nq, whole turns of hinges that nothing counts, rad
  const Vector& velocity() const { return state_.v; }         ///< nv
  const Matrix6X<T>& columns() const { return ws_.J; }        ///< 6 x nv, twists per unit of each velocity (world)
  const SE3Of<T>& getPlacement(int body) const { return ws_.X_WB[body]; }
  /// Columns J_b N of a tip, about the origin of the world; `outer` are their indices into w.
  const typename ReducedTreeOf<T>::Columns& getTip(int index) const { return tree_.getTip(index); }
  /// Row `dof` of N: calls visit(index into w, entry) for entries that may differ from zero.
  template <typename Visit>
  void visitRow(int dof, const Visit& visit) const {
    const DofPlace& place = places_[dof];
    if (place.cluster < 0) {
      visit(place.index, T(1));
      return;
    }
    const ReducedCluster& cluster = reduction_.clusters[place.cluster];
    for (int c = 0; c < cluster.size; ++c)
      visit(cluster.offset + c, state_.clusters[place.cluster].basis.N(place.index, c));
  }
  /// Why set() or drift() failed last, with the closure and how far it is open.
  const std::string& failure(int lane = 0) const { return failures_[lane]; }

 private:
  struct Cluster {
    explicit Cluster(const ReducedCluster& cluster);
    const ReducedCluster& cluster;
    ClusterScratchOf<T> scratch;
    ClusterStateOf<T> next;
    ClusterMotionOf<T> motion;
    Vector d, a_d, rows, drift, zeta;  // n; n; m; rank; rank
    MatrixX<T> JW, B, BB;              // rank x n, J W^{-1}; rank x m, J W^{-1} J_all^T; B B^T
    Vector y, lambda;                  // rank; m
    std::vector<typename LogicOf<T>::Index> pivots;
  };
  struct DofPlace {
    int cluster = -1, index = 0;  // row of N of the cluster; without one, index into w
  };
  Mask driftAtOnce(const T& h, const Mask& which, bool is_last);
  Mask renew(size_t cluster, const Mask& which);
  Mask findChanged(size_t cluster) const;
  Mask closeChanged(size_t cluster, const Mask& which);
  void updateTree(const Mask& which);
  void addReduced(const Vector& dw, Vector& v) const;
  void takeNext(const Mask& which, size_t cluster);
  bool leaveOutTurns(const Mask& which);
  void describe(size_t cluster, const Mask& which);

  Model model_;
  const Reduction reduction_;
  std::vector<Cluster> clusters_;
  std::vector<ClusterLiftOf<T>> lifts_;
  std::vector<DofPlace> places_;
  ReducedTreeOf<T> tree_;
  WorkspaceOf<T> ws_;
  State state_;
  MatrixX<T> M_;  // size x size
  const std::vector<int> free_turns_;
  Vector q_next_, v_next_, w_next_;  // nq, nv, size
  Vector v_foreseen_, a_d_, loads_;  // nv, nv, size
  Vector forces_, rates_;            // nv: tau - b - M a_d with springs alone; w'
  std::vector<Vector6<T>> changes_;  // numBodies, of their twists
  Vector q_kept_, w_kept_;           // nq, size
  std::array<std::string, kLanesOf<T>> failures_;
};

}  // namespace bielle::worlds
