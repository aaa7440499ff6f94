#include "control/passive_joints.h"

#include "bielle/model/error.h"

namespace bielle {
namespace {

constexpr int kMaxSteps = 12;
constexpr double kTolerance = 1e-11;  // of a motor's position, rad or m
constexpr double kLongestStep = 0.2;  // of a motor, rad or m

}  // namespace

PassiveJoints::Follower::Follower(Linkage of)
    : linkage(std::move(of)),
      cluster(*linkage.cluster),
      scratch(cluster),
      state(cluster),
      next(cluster),
      tangent(cluster),
      gap(VectorXd::Zero(cluster.size)),
      d(VectorXd::Zero(cluster.model.nv())) {}

PassiveJoints::PassiveJoints(const Model& model, ConstVectorRef q) : model_(model), places_(model.nv()) {
  const Reduction reduction = makeReduction(model, q);
  followers_.reserve(reduction.clusters.size());
  for (Linkage& linkage : selectLinkages(model, reduction)) {
    const ReducedCluster& cluster = *linkage.cluster;
    if (linkage.size() != cluster.size)
      throw InputError(
          model.name(), "closure '" + model.closures()[cluster.closure_indices.front()].name + "'",
          "its linkage has " + std::to_string(linkage.size()) + " motors and mobility " + std::to_string(cluster.size),
          "an estimator needs as many motors as mobility, less idle spins");
    followers_.emplace_back(std::move(linkage));
    for (size_t k = 0; k < cluster.dofs.size(); ++k)
      places_[cluster.dofs[k]] = {static_cast<int>(followers_.size()) - 1, static_cast<int>(k)};
  }
  for (int i : reduction.free_joints) {
    const Joint& joint = model.joints()[i];
    const int motor = model.findMotor(joint.name);
    if (joint.kind == JointKind::FreeFlyer && i == 1) continue;
    if (motor < 0)
      throw InputError(model.name(), "joint '" + joint.name + "'", "no motor determines its position",
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
    f.updateTangent();
  }
  return regular;
}

// False if it does not close; the last closed state is kept.
bool PassiveJoints::follow(Follower& f, ConstVectorRef positions) {
  for (int i = 0; i < kMaxSteps; ++i) {
    for (int m = 0; m < f.linkage.size(); ++m)
      f.gap[m] = positions[f.linkage.motors[m]] - f.state.basis.q[f.linkage.motor_positions[m]];
    const double largest = f.gap.cwiseAbs().maxCoeff();
    if (!(largest < std::numeric_limits<double>::infinity())) return false;
    if (largest < kTolerance) return true;
    if (largest > kLongestStep) f.gap *= kLongestStep / largest;
    f.d.noalias() = f.tangent.T() * f.gap;
    if (!closeCluster<double>(f.cluster, f.scratch, f.state.basis, f.d, no_guess_, f.next)) return false;
    std::swap(f.state, f.next);
    f.updateTangent();
  }
  return f.margin < kLeastTransmission;
}

NumericalStatus PassiveJoints::update(ConstVectorRef positions, VectorRef q) {
  NumericalStatus status = NumericalStatus::Ok;
  margin_ = 1;
  for (Follower& f : followers_) {
    if (!follow(f, positions)) status = NumericalStatus::NotClosed;
    if (f.margin < margin_) {
      margin_ = f.margin;
      weakest_ = &f.cluster.closures.closures.front().name;
    }
    scatterConfiguration(model_, f.cluster, f.state.basis.q, q);
  }
  if (margin_ < kLeastTransmission && status == NumericalStatus::Ok) status = NumericalStatus::NearDeadPoint;
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
