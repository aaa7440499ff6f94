#include "bielle/dynamics/linkage.h"

#include <algorithm>

#include "bielle/dynamics/kinematics.h"
#include "bielle/model/error.h"
#include "dynamics/idle_spins.h"
#include "dynamics/linkage_workspace.h"
#include "model/listing.h"

namespace bielle {
namespace {

// The coordinates of a joint with index i in the whole model.
void addCoordinates(const ReducedCluster& cluster, int i, std::vector<int>& dofs, std::vector<int>& positions) {
  const int at = static_cast<int>(std::find(cluster.joints.begin(), cluster.joints.end(), i) - cluster.joints.begin());
  const Joint& joint = cluster.model.joints()[at + 1];  // the first one is the root
  for (int k = 0; k < joint.nv; ++k) {
    dofs.push_back(joint.idx_v + k);
    positions.push_back(joint.nv == 1 ? joint.idx_q : -1);
  }
}

Linkage selectLinkage(const Model& model, const ReducedCluster& cluster, int index, std::vector<int> joints) {
  Linkage out;
  const std::shared_ptr<ReducedCluster> unweighted = makeUnweighted(cluster);
  holdSpins(model, joints, *unweighted);
  out.cluster = unweighted;
  out.index = index;
  for (int m = 0; m < model.nu(); ++m) {
    const Motor& motor = model.motors()[m];
    if (!contains(cluster.joints, motor.joint)) continue;
    out.motors.push_back(m);
    out.motor_names.push_back(motor.name);
    addCoordinates(cluster, motor.joint, out.motor_dofs, out.motor_positions);
  }
  out.joints = std::move(joints);
  for (int i : out.joints) {
    out.joint_names.push_back(model.joints()[i].name);
    addCoordinates(cluster, i, out.joint_dofs, out.joint_positions);
  }
  out.output = listItems(out.joint_names);
  return out;
}

int findScalarJoint(const Model& model, const std::string& name) {
  const std::string element = "joint '" + name + "'";
  const int index = model.findJoint(name);
  if (index < 0)
    throw InputError(
        model.name(), element, "there is no moving joint of this name",
        "`bielle info` lists the joints; the serial ones are: " + [&model] {
          std::vector<std::string> serial;
          for (int i : model.serialJoints()) serial.push_back(model.joints()[i].name);
          return listItems(serial);
        }());
  const Joint& joint = model.joints()[index];
  if (joint.nv != 1)
    throw InputError(
        model.name(), element,
        "it is a " + std::string(getName(joint.kind)) + " joint of " + std::to_string(joint.nv) + " coordinates",
        "a ratio needs joints of one coordinate");
  return index;
}

Linkage makeDirectLinkage(const Model& model, int joint) {
  Linkage linkage;
  const std::string& name = model.joints()[joint].name;
  const int motor = model.findMotor(name);
  if (motor < 0)
    throw InputError(model.name(), "joint '" + name + "'", "nothing drives it: it is in no loop and has no motor",
                     "name a joint that a motor moves");
  linkage.joints = {joint};
  linkage.motors = {motor};
  linkage.joint_names = {name};
  linkage.motor_names = {model.motors()[motor].name};
  linkage.output = name;
  linkage.cluster = std::make_shared<ReducedCluster>();
  return linkage;
}

// With further serial joints, up to the mobility.
Linkage makeLoopLinkage(const Model& model, const ReducedCluster& whole, int index, std::vector<int> joints) {
  const std::string element = "joint '" + model.joints()[joints.front()].name + "'";
  ReducedCluster cluster = whole;
  holdSpins(model, joints, cluster);
  for (int i : model.serialJoints())
    if (static_cast<int>(joints.size()) < cluster.size && contains(cluster.joints, i) && !contains(joints, i) &&
        model.joints()[i].nv == 1)
      joints.push_back(i);
  Linkage linkage = selectLinkage(model, whole, index, std::move(joints));
  const std::string mobility = "its linkage has mobility " + std::to_string(cluster.size),
                    motors = listItems(linkage.motor_names);
  if (linkage.size() != cluster.size)
    throw InputError(model.name(), element,
                     mobility + " and " + std::to_string(linkage.size()) + " motors (" + motors + ")",
                     "a ratio needs as many motors as mobility, less idle spins");
  if (static_cast<int>(linkage.joints.size()) != cluster.size)
    throw InputError(model.name(), element,
                     mobility + ", driven by " + motors + "; " + std::to_string(linkage.joints.size()) +
                         " of its joints are named or listed as serial joints",
                     "name " + std::to_string(cluster.size) + " joints of this linkage");
  return linkage;
}

}  // namespace

bool Linkage::isDirect() const { return cluster->joints.empty(); }

std::shared_ptr<ReducedCluster> makeUnweighted(const ReducedCluster& cluster) {
  const auto out = std::make_shared<ReducedCluster>(cluster);
  for (VectorXd* x : {&out->metric, &out->inverse_metric, &out->inverse_root}) x->setOnes();
  return out;
}

std::vector<Linkage> selectLinkages(const Model& model, const Reduction& reduction) {
  std::vector<Linkage> out;
  for (const ReducedCluster& cluster : reduction.clusters) {
    std::vector<int> serial;
    for (int i : model.serialJoints())
      if (contains(cluster.joints, i)) serial.push_back(i);
    out.push_back(selectLinkage(model, cluster, static_cast<int>(out.size()), std::move(serial)));
  }
  return out;
}

Linkage makeLinkage(const Model& model, const Reduction& reduction, const std::vector<std::string>& names) {
  std::vector<int> joints;
  int cluster = -1;
  for (const std::string& name : names) {
    const int joint = findScalarJoint(model, name);
    int owner = -1;
    for (size_t b = 0; b < reduction.clusters.size(); ++b)
      if (contains(reduction.clusters[b].joints, joint)) owner = static_cast<int>(b);
    if (!joints.empty() && (owner != cluster || owner < 0))
      throw InputError(model.name(), "joint '" + name + "'",
                       "it is not in the linkage of '" + model.joints()[joints.front()].name + "'",
                       "name joints of one linkage at a time");
    if (contains(joints, joint)) throw InputError(model.name(), "joint '" + name + "'", "it is named twice", "");
    cluster = owner;
    joints.push_back(joint);
  }
  if (joints.empty()) throw InputError(model.name(), "joints", "none are named", "name a joint");
  return cluster < 0 ? makeDirectLinkage(model, joints.front())
                     : makeLoopLinkage(model, reduction.clusters[cluster], cluster, std::move(joints));
}

Linkage makeLinkage(const Model& model, ConstVectorRef q, const std::vector<std::string>& joints) {
  return makeLinkage(model, makeReduction(model, q), joints);
}

LinkageTangent::LinkageTangent(const ReducedCluster& cluster)
    : svd_(cluster.size, cluster.size, Eigen::ComputeFullU | Eigen::ComputeFullV) {
  for (MatrixXd* x : {&N_X_, &scaled_, &inverse_}) x->setZero(cluster.size, cluster.size);
  T_.setZero(cluster.model.nv(), cluster.size);
}

double LinkageTangent::update(const MatrixXd& N, const std::vector<int>& dofs, double damped) {
  for (size_t i = 0; i < dofs.size(); ++i) N_X_.row(static_cast<Eigen::Index>(i)) = N.row(dofs[i]);
  svd_.compute(N_X_);
  const auto& sigma = svd_.singularValues();
  const double least = sigma[sigma.size() - 1], damping = std::max(0.0, damped * damped - least * least);
  scaled_ = svd_.matrixV();
  for (Eigen::Index i = 0; i < sigma.size(); ++i) scaled_.col(i) *= sigma[i] / (sigma[i] * sigma[i] + damping);
  inverse_.noalias() = scaled_ * svd_.matrixU().transpose();
  T_.noalias() = N * inverse_;
  return least;
}

double calcLeastMotion(const MatrixXd& N, const std::vector<int>& dofs) {
  MatrixXd N_X(dofs.size(), N.cols());
  for (size_t i = 0; i < dofs.size(); ++i) N_X.row(static_cast<Eigen::Index>(i)) = N.row(dofs[i]);
  return Eigen::JacobiSVD<MatrixXd>(N_X).singularValues().tail<1>()[0];
}

void updateDrift(const ReducedCluster& cluster, Workspace& ws, ConstVectorRef v, MatrixXd& drift) {
  updateVelocities(cluster.model, ws, v);
  drift.setZero();
  for (size_t c = 0; c < cluster.closures.closures.size(); ++c) {
    const Closure& closure = cluster.closures.closures[c];
    calcClosureVelocityDerivative(ws, closure, drift.middleRows(cluster.closures.offsets[c], getRows(closure.kind)));
  }
}

}  // namespace bielle
