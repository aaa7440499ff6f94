#include "design/conditioning.h"

#include <algorithm>
#include <limits>

#include "math/decompositions.h"

namespace bielle {
namespace {

std::vector<int> findRows(const Model& model, const ReducedCluster& cluster, LinkageSide side) {
  std::vector<int> positions;
  for (size_t i = 0; i < cluster.dofs.size(); ++i) {
    const auto has = [&](int dof) { return dof == cluster.dofs[i]; };
    bool found = false;
    if (side == LinkageSide::Motors)
      for (const Motor& motor : model.motors()) found = found || has(motor.dof);
    else
      for (int joint : model.serialJoints()) {
        const Joint& j = model.joints()[joint];
        for (int k = 0; k < j.nv; ++k) found = found || has(j.idx_v + k);
      }
    if (found) positions.push_back(static_cast<int>(i));
  }
  return positions;
}

double calcInverse(const MatrixXd& N, const std::vector<int>& rows) {
  const MatrixXd Q = Eigen::HouseholderQR<MatrixXd>(N).householderQ() * MatrixXd::Identity(N.rows(), N.cols());
  MatrixXd Q_M(rows.size(), Q.cols());
  for (size_t i = 0; i < rows.size(); ++i) Q_M.row(static_cast<Eigen::Index>(i)) = Q.row(rows[i]);
  return Eigen::JacobiSVD<MatrixXd>(Q_M).singularValues().tail<1>()[0];
}

}  // namespace

LinkageConditioning::LinkageConditioning(const Model& model, ConstVectorRef q, LinkageSide side) : model_(model) {
  if (model.closures().empty()) return;
  reduction_ = makeReduction(model, q);
  for (const ReducedCluster& cluster : reduction_.clusters) {
    const std::vector<int> rows = findRows(model, cluster, side);
    if (cluster.size > 0 && static_cast<int>(rows.size()) >= cluster.size)
      entries_.push_back({&cluster, rows, ClusterPoint(cluster), VectorXd(cluster.model.nq())});
  }
}

VectorXd LinkageConditioning::calcInverses(ConstVectorRef q) {
  VectorXd out = VectorXd::Zero(static_cast<Eigen::Index>(entries_.size()));
  for (size_t i = 0; i < entries_.size(); ++i) {
    Entry& entry = entries_[i];
    gatherConfiguration(model_, *entry.cluster, q, entry.q);
    if (entry.point.update(*entry.cluster, entry.q))
      out[static_cast<Eigen::Index>(i)] = calcInverse(entry.point.basis().N, entry.rows);
  }
  return out;
}

double LinkageConditioning::calc(ConstVectorRef q) {
  if (entries_.empty()) return 1;
  const double least = calcInverses(q).minCoeff();
  return least > 0 ? std::max(1.0, 1 / least) : std::numeric_limits<double>::infinity();
}

}  // namespace bielle
