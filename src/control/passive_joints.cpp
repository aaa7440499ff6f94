#include "control/passive_joints.h"

#include <algorithm>

#include "bielle/model/error.h"

namespace bielle {
namespace {

constexpr int kMaxSteps = 12;
constexpr double kTolerance = 1e-11;  // of a motor's position, rad or m
constexpr double kLongestStep = 0.2;  // of a motor, rad or m

ReducedCluster makeUnweighted(ReducedCluster cluster) {
  cluster.metric.setOnes();
  cluster.inverse_metric.setOnes();
  cluster.inverse_root.setOnes();
  return cluster;
}

}  // namespace

PassiveJoints::Follower::Follower(const ReducedCluster& c)
    : cluster(makeUnweighted(c)),
      scratch(cluster),
      state(cluster),
      next(cluster),
      svd(cluster.size, cluster.size, Eigen::ComputeFullU | Eigen::ComputeFullV) {
  for (MatrixXd* x : {&N_m, &scaled, &inverse}) x->setZero(cluster.size, cluster.size);
  T.setZero(cluster.model.nv(), cluster.size);
  gap.setZero(cluster.size);
  for (VectorXd* x : {&step, &d}) x->setZero(cluster.model.nv());
}

PassiveJoints::PassiveJoints(const Model& model, ConstVectorRef q) : model_(model), places_(model.nv()) {
  const Reduction reduction = makeReduction(model, q);
  followers_.reserve(reduction.clusters.size());
  for (const ReducedCluster& cluster : reduction.clusters) {
    Follower& follower = followers_.emplace_back(cluster);
    for (int m = 0; m < model.nu(); ++m) {
      const auto found = std::find(cluster.joints.begin(), cluster.joints.end(), model.motors()[m].joint);
      if (found == cluster.joints.end()) continue;
      const Joint& joint = cluster.model.joints()[found - cluster.joints.begin() + 1];  // the first one is the world
      follower.motors.push_back(m);
      follower.dofs.push_back(joint.idx_v);
      follower.positions.push_back(joint.idx_q);
    }
    const std::string closure = model.closures()[cluster.closure_indices.front()].name;
    if (static_cast<int>(follower.motors.size()) != cluster.size)
      throw ModelError(model.name(), "closure '" + closure + "'",
                       "its linkage has " + std::to_string(follower.motors.size()) + " motors and mobility " +
                           std::to_string(cluster.size),
                       "an estimator needs as many motors as mobility");
    for (size_t k = 0; k < cluster.dofs.size(); ++k)
      places_[cluster.dofs[k]] = {static_cast<int>(followers_.size()) - 1, static_cast<int>(k)};
  }
  for (int i : reduction.free_joints) {
    const Joint& joint = model.joints()[i];
    const int motor = model.findMotor(joint.name);
    if (joint.kind == JointKind::FreeFlyer && i == 1) continue;
    if (motor < 0)
      throw ModelError(model.name(), "joint '" + joint.name + "'", "no motor determines its position",
                       "an estimator needs a motor, or a linkage driven by motors");
    places_[joint.idx_v] = {-1, motor};
  }
  reset(q);
}

bool PassiveJoints::reset(ConstVectorRef q) {
  bool regular = true;
  for (Follower& f : followers_) {
    gatherConfiguration(model_, f.cluster, q, f.state.basis.q);
    f.next.basis.q = f.state.basis.q;
    regular = updateClusterState<double>(f.cluster, f.scratch, f.next.basis.q, f.state) && regular;
    updateTangent(f);
  }
  return regular;
}

// T, and the smallest singular value of N_m.
double PassiveJoints::updateTangent(Follower& f) {
  for (size_t m = 0; m < f.dofs.size(); ++m) f.N_m.row(m) = f.state.basis.N.row(f.dofs[m]);
  f.svd.compute(f.N_m);
  const auto& sigma = f.svd.singularValues();
  const double least = sigma[sigma.size() - 1];
  const double damping = std::max(0.0, kDeadPointMargin * kDeadPointMargin - least * least);
  f.scaled = f.svd.matrixV();
  for (Eigen::Index i = 0; i < sigma.size(); ++i) f.scaled.col(i) *= sigma[i] / (sigma[i] * sigma[i] + damping);
  f.inverse.noalias() = f.scaled * f.svd.matrixU().transpose();
  f.T.noalias() = f.state.basis.N * f.inverse;
  return least;
}

// False if it does not close; the last closed state is kept.
bool PassiveJoints::follow(Follower& f, ConstVectorRef positions) {
  for (int i = 0; i < kMaxSteps; ++i) {
    for (size_t m = 0; m < f.motors.size(); ++m) f.gap[m] = positions[f.motors[m]] - f.state.basis.q[f.positions[m]];
    const double largest = f.gap.cwiseAbs().maxCoeff();
    if (!(largest < std::numeric_limits<double>::infinity())) return false;
    if (largest < kTolerance) return true;
    if (largest > kLongestStep) f.gap *= kLongestStep / largest;
    f.d.noalias() = f.T * f.gap;
    if (!closeCluster<double>(f.cluster, f.scratch, f.state.basis, f.d, no_guess_, f.next)) return false;
    std::swap(f.state, f.next);
    updateTangent(f);
  }
  return f.svd.singularValues().minCoeff() < kDeadPointMargin;
}

ClosingStatus PassiveJoints::update(ConstVectorRef positions, VectorRef q) {
  ClosingStatus status = ClosingStatus::Closed;
  margin_ = 1;
  for (Follower& f : followers_) {
    if (!follow(f, positions)) status = ClosingStatus::NotClosed;
    const double least = f.svd.singularValues()[f.cluster.size - 1];
    if (least < margin_) {
      margin_ = least;
      weakest_ = &f.cluster.closures.closures.front().name;
    }
    scatterConfiguration(model_, f.cluster, f.state.basis.q, q);
  }
  if (margin_ < kDeadPointMargin && status == ClosingStatus::Closed) status = ClosingStatus::NearDeadPoint;
  for (int m = 0; m < model_.nu(); ++m) {
    const Motor& motor = model_.motors()[m];
    if (places_[motor.dof].cluster < 0) q[model_.joints()[motor.joint].idx_q] = positions[m];
  }
  return status;
}

void PassiveJoints::expand(ConstVectorRef velocities, VectorRef v) const {
  for (int k = model_.hasFreeFlyer() ? 6 : 0; k < model_.nv(); ++k) {
    v[k] = 0;
    visitRow(k, [&](int motor, double entry) { v[k] += entry * velocities[motor]; });
  }
}

}  // namespace bielle
