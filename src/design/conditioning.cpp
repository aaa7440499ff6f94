#include "design/conditioning.h"

#include <algorithm>
#include <limits>

namespace bielle {

LinkageConditioning::LinkageConditioning(const Model& model, ConstVectorRef q, LinkageSide side) : model_(model) {
  if (model.closures().empty()) return;
  for (const Linkage& linkage : selectLinkages(model, makeReduction(model, q))) {
    const std::vector<int>& dofs = side == LinkageSide::Motors ? linkage.motor_dofs : linkage.joint_dofs;
    const ReducedCluster& cluster = *linkage.cluster;
    if (cluster.size > 0 && static_cast<int>(dofs.size()) >= cluster.size)
      entries_.push_back({linkage.cluster, dofs, ClusterPoint(cluster), VectorXd(cluster.model.nq())});
  }
}

VectorXd LinkageConditioning::calcInverses(ConstVectorRef q) {
  VectorXd out = VectorXd::Zero(static_cast<Eigen::Index>(entries_.size()));
  for (size_t i = 0; i < entries_.size(); ++i) {
    Entry& entry = entries_[i];
    gatherConfiguration(model_, *entry.cluster, q, entry.q);
    if (entry.point.update(*entry.cluster, entry.q))
      out[static_cast<Eigen::Index>(i)] = calcLeastMotion(entry.point.basis().N, entry.dofs);
  }
  return out;
}

double LinkageConditioning::calc(ConstVectorRef q) {
  if (entries_.empty()) return 1;
  const double least = calcInverses(q).minCoeff();
  return least > 0 ? std::max(1.0, 1 / least) : std::numeric_limits<double>::infinity();
}

}  // namespace bielle
