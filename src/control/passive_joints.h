#pragma once
/// \file What the joints of a closed robot do when its motors are known.
///
/// A cluster of as many motors as freedoms follows its motors: with the basis N of its closed motions (reduction.h, here in
/// the metric W = 1) and the rows N_m of the motors,
///     v = T v_m,   T = N N_m^-1                                                                                     (1)
/// and its configuration by Newton steps, d = T (q_m - q) closed again by reduction.h, Eq. (2). The smallest singular value
/// of N_m, the least that the motors move in a unit motion of the cluster, is zero at a dead point, where the linkage
/// moves though its motors stand. Near one, N_m^-1 is damped (LinkageTangent).
#include <string>
#include <vector>

#include "dynamics/linkage_workspace.h"

namespace bielle {

/// No function allocates but the constructor.
class PassiveJoints {
 public:
  /// Below this transmission of motors to joints a linkage is near a dead point.
  static constexpr double kLeastTransmission = 0.02;

  /// \param q  closed configuration at which ranks are determined
  /// \throws InputError when motors do not determine a joint other than the free-flyer of the trunk
  PassiveJoints(const Model& model, ConstVectorRef q);

  /// Starts from a closed configuration.
  bool reset(ConstVectorRef q);
  /// \param positions  of the motors (nu)   \param q  nq: all but the free-flyer is written
  /// \return NearDeadPoint: closed, but some linkage hardly follows its motors; NotClosed: no closed configuration was
  /// found near the last one, which is kept
  NumericalStatus update(ConstVectorRef positions, VectorRef q);

  /// v of Eq. (1) at the last configuration. \param v  nv: all but the free-flyer is written
  void expand(ConstVectorRef velocities, VectorRef v) const;
  /// T of Eq. (1) at the last configuration, row by row: calls visit(motor, entry) for the entries of a dof.
  template <typename Visit>
  void visitRow(int dof, const Visit& visit) const {
    const Place& place = places_[dof];
    if (place.cluster < 0) {
      if (place.index >= 0) visit(place.index, 1.0);
      return;
    }
    const Follower& follower = followers_[place.cluster];
    for (int m = 0; m < follower.linkage.size(); ++m)
      visit(follower.linkage.motors[m], follower.tangent.T()(place.index, m));
  }
  /// Whether a joint belongs to a linkage.
  bool isLinked(const Joint& joint) const { return places_[joint.idx_v].cluster >= 0; }
  /// Smallest singular value of N_m of all clusters, 1 if there are none; and the name of a closure of the weakest.
  double margin() const { return margin_; }
  std::string weakest() const { return weakest_ ? *weakest_ : ""; }

 private:
  struct Follower {
    explicit Follower(Linkage of);
    void updateTangent() { margin = tangent.update(state.basis.N, linkage.motor_dofs, kLeastTransmission); }
    Linkage linkage;
    const ReducedCluster& cluster;  // of the linkage
    ClusterScratch scratch;
    ClusterState state, next;
    LinkageTangent tangent;  // T
    double margin = 0;       // the smallest singular value of N_m
    VectorXd gap, d;         // size; n
  };
  struct Place {
    int cluster = -1, index = -1;  // row of T of a cluster; without one, a motor, or nothing for a free-flyer
  };
  bool follow(Follower& follower, ConstVectorRef positions);

  Model model_;
  std::vector<Follower> followers_;
  std::vector<Place> places_;  // per dof
  VectorXd no_guess_;
  double margin_ = 1;
  const std::string* weakest_ = nullptr;
};

}  // namespace bielle
