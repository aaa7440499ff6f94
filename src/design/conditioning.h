#pragma once
/// \file Conditioning of a linkage: how well its motors determine it.
#include <vector>

#include "dynamics/linkage_workspace.h"

namespace bielle {

/// What a linkage is determined by.
enum class LinkageSide {
  Motors,
  Joints  ///< serial joints; the inverse is their least motion in a unit motion of the linkage, 0 at a dead point
};

/// With Q an orthonormal basis of the closed motions of a loop cluster and Q_M its rows of motors, 1 / sigma_min(Q_M):
/// the largest motion of the linkage per unit motion of its motors. 1 or more; infinite if the motors do not determine
/// the linkage. Clusters with fewer motors than mobility are omitted. The same for joints.
class LinkageConditioning {
 public:
  /// \param q  closed configuration at which ranks are determined. \throws InputError as makeReduction
  LinkageConditioning(const Model& model, ConstVectorRef q, LinkageSide side = LinkageSide::Motors);
  /// The worst cluster at a closed configuration; infinite if one has lost rank.
  double calc(ConstVectorRef q);
  /// The inverse of each cluster, in their order: sigma_min(Q_M), 0 if it has lost rank.
  VectorXd calcInverses(ConstVectorRef q);

 private:
  struct Entry {
    std::shared_ptr<const ReducedCluster> cluster;
    std::vector<int> dofs;  // of the cluster
    ClusterPoint point;
    VectorXd q;
  };
  Model model_;
  std::vector<Entry> entries_;
};

}  // namespace bielle
