#pragma once
/// \file Conditioning of a linkage: how well its motors determine it.
#include <vector>

#include "dynamics/reduction.h"

namespace bielle {

/// With Q an orthonormal basis of the closed motions of a loop cluster and Q_M its rows of motors, 1 / sigma_min(Q_M):
/// the largest motion of the linkage per unit motion of its motors. 1 or more; infinite if the motors do not determine
/// the linkage. Clusters with fewer motors than mobility are omitted.
class LinkageConditioning {
 public:
  /// The model must outlive it.
  /// \param q  closed configuration at which ranks are determined. \throws ModelError as makeReduction
  LinkageConditioning(const Model& model, ConstVectorRef q);
  LinkageConditioning(const LinkageConditioning&) = delete;
  LinkageConditioning& operator=(const LinkageConditioning&) = delete;
  /// The worst cluster at a closed configuration; infinite if one has lost rank.
  double calc(ConstVectorRef q);

 private:
  struct Entry {
    const ReducedCluster* cluster;
    std::vector<int> motors;  // positions among the dofs of the cluster
    ClusterPoint point;
    VectorXd q;
  };
  const Model& model_;
  Reduction reduction_;
  std::vector<Entry> entries_;
};

}  // namespace bielle
