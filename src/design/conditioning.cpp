#include "design/conditioning.h"

#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <limits>

namespace bielle {
namespace {

std::vector<int> findMotors(const Model& model, const ReducedCluster& cluster) {
  std::vector<int> positions;
  for (size_t i = 0; i < cluster.dofs.size(); ++i)
    for (const Motor& motor : model.motors())
      if (motor.dof == cluster.dofs[i]) positions.push_back(static_cast<int>(i));
  return positions;
}

double calcConditioning(const MatrixXd& N, const std::vector<int>& motors) {
  const MatrixXd Q = Eigen::HouseholderQR<MatrixXd>(N).householderQ() * MatrixXd::Identity(N.rows(), N.cols());
  MatrixXd Q_M(motors.size(), Q.cols());
  for (size_t i = 0; i < motors.size(); ++i) Q_M.row(static_cast<Eigen::Index>(i)) = Q.row(motors[i]);
  const double least = Eigen::JacobiSVD<MatrixXd>(Q_M).singularValues().tail<1>()[0];
  return least > 0 ? 1 / least : std::numeric_limits<double>::infinity();
}

}  // namespace

LinkageConditioning::LinkageConditioning(const Model& model, ConstVectorRef q) : model_(model) {
  if (model.closures().empty()) return;
  reduction_ = makeReduction(model, q);
  for (const ReducedCluster& cluster : reduction_.clusters) {
    const std::vector<int> motors = findMotors(model, cluster);
    if (cluster.size > 0 && static_cast<int>(motors.size()) >= cluster.size)
      entries_.push_back({&cluster, motors, ClusterPoint(cluster), VectorXd(cluster.model.nq())});
  }
}

double LinkageConditioning::calc(ConstVectorRef q) {
  double worst = 1;
  for (Entry& entry : entries_) {
    gatherConfiguration(model_, *entry.cluster, q, entry.q);
    if (!entry.point.update(*entry.cluster, entry.q)) return std::numeric_limits<double>::infinity();
    worst = std::max(worst, calcConditioning(entry.point.basis().N, entry.motors));
  }
  return worst;
}

}  // namespace bielle
