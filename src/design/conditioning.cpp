#include "bielle/design/conditioning.h"

#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <limits>

namespace bielle {
namespace {

std::vector<int> findMotors(const Model& model, const LoopBlock& block) {
  std::vector<int> positions;
  for (size_t i = 0; i < block.dofs.size(); ++i)
    for (const Motor& motor : model.motors())
      if (motor.dof == block.dofs[i]) positions.push_back(static_cast<int>(i));
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
  for (const LoopBlock& block : reduction_.blocks) {
    const std::vector<int> motors = findMotors(model, block);
    if (block.size > 0 && static_cast<int>(motors.size()) >= block.size)
      clusters_.push_back({&block, motors, BlockPoint(block), VectorXd(block.model.nq())});
  }
}

double LinkageConditioning::calc(ConstVectorRef q) {
  double worst = 1;
  for (Cluster& cluster : clusters_) {
    gatherConfiguration(model_, *cluster.block, q, cluster.q);
    if (!cluster.point.update(*cluster.block, cluster.q)) return std::numeric_limits<double>::infinity();
    worst = std::max(worst, calcConditioning(cluster.point.basis().N, cluster.motors));
  }
  return worst;
}

}  // namespace bielle
