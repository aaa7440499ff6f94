#include "transmission/linkage.h"

#include <algorithm>

#include "bielle/dynamics/constrained.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/rnea.h"
#include "bielle/model/error.h"
#include "math/decompositions.h"
#include "model/listing.h"

namespace bielle {
namespace {

constexpr double kSingular = 1e-12;  // singular values of N_J, whose rows are at most of unit length

int findScalarJoint(const Model& model, const std::string& name) {
  const std::string element = "joint '" + name + "'";
  const int index = model.findJoint(name);
  if (index < 0)
    throw ModelError(
        model.name(), element, "there is no moving joint of this name",
        "`bielle info` lists the joints; the serial ones are: " + [&model] {
          std::vector<std::string> serial;
          for (int i : model.serialJoints()) serial.push_back(model.joints()[i].name);
          return listItems(serial);
        }());
  const Joint& joint = model.joints()[index];
  if (joint.nv != 1)
    throw ModelError(
        model.name(), element,
        "it is a " + std::string(getName(joint.kind)) + " joint of " + std::to_string(joint.nv) + " coordinates",
        "a ratio needs joints of one coordinate");
  return index;
}

// Position within the cluster of the joint with index i in the whole model.
void addPlaces(const Linkage& linkage, int i, std::vector<int>& dofs, std::vector<int>& positions) {
  const std::vector<int>& joints = linkage.cluster->joints;
  const int at = static_cast<int>(std::find(joints.begin(), joints.end(), i) - joints.begin());
  const Joint& joint = linkage.cluster->model.joints()[at + 1];  // the first one is the world
  dofs.push_back(joint.idx_v);
  positions.push_back(joint.idx_q);
}

Linkage makeDirectLinkage(const Model& model, int joint) {
  Linkage linkage;
  const int motor = model.findMotor(model.joints()[joint].name);
  if (motor < 0)
    throw ModelError(model.name(), "joint '" + model.joints()[joint].name + "'",
                     "nothing drives it: it is in no loop and has no motor", "name a joint that a motor moves");
  linkage.joints = {joint};
  linkage.motors = {motor};
  linkage.cluster = std::make_shared<ReducedCluster>();
  return linkage;
}

Linkage makeLoopLinkage(const Model& model, const ReducedCluster& cluster, std::vector<int> joints) {
  Linkage linkage;
  const auto unweighted = std::make_shared<ReducedCluster>(cluster);
  unweighted->metric.setOnes();  // purely geometric: light bodies must not move far per step
  unweighted->inverse_metric.setOnes();
  unweighted->inverse_root.setOnes();
  linkage.cluster = unweighted;
  const std::string element = "joint '" + model.joints()[joints.front()].name + "'";
  for (int i : model.serialJoints())
    if (static_cast<int>(joints.size()) < cluster.size && contains(cluster.joints, i) && !contains(joints, i) &&
        model.joints()[i].nv == 1)
      joints.push_back(i);
  std::vector<std::string> motor_names;
  for (int m = 0; m < model.nu(); ++m)
    if (contains(cluster.joints, model.motors()[m].joint)) {
      linkage.motors.push_back(m);
      motor_names.push_back(model.motors()[m].name);
    }
  const std::string mobility = "its linkage has mobility " + std::to_string(cluster.size);
  if (static_cast<int>(linkage.motors.size()) != cluster.size)
    throw ModelError(
        model.name(), element,
        mobility + " and " + std::to_string(linkage.motors.size()) + " motors (" + listItems(motor_names) + ")",
        "a ratio needs as many motors as mobility");
  if (static_cast<int>(joints.size()) != cluster.size)
    throw ModelError(model.name(), element,
                     mobility + ", driven by " + listItems(motor_names) + "; " + std::to_string(joints.size()) +
                         " of its joints are named or listed as serial joints",
                     "name " + std::to_string(cluster.size) + " joints of this linkage");
  linkage.joints = std::move(joints);
  for (int i : linkage.joints) addPlaces(linkage, i, linkage.joint_dofs, linkage.joint_positions);
  for (int m : linkage.motors) addPlaces(linkage, model.motors()[m].joint, linkage.motor_dofs, linkage.motor_positions);
  return linkage;
}

MatrixXd selectRowsOf(const MatrixXd& N, const std::vector<int>& dofs) {
  MatrixXd rows(dofs.size(), N.cols());
  for (size_t i = 0; i < dofs.size(); ++i) rows.row(i) = N.row(dofs[i]);
  return rows;
}

// a of Eq. (2) at the velocity v = T w of the cluster (n).
VectorXd calcDriftAcceleration(const Linkage& linkage, ClusterPoint& point, const MatrixXd& T, const VectorXd& v) {
  const ReducedCluster& cluster = *linkage.cluster;
  Workspace& ws = point.workspace();
  updateVelocities(cluster.model, ws, v);
  updateAccelerations(cluster.model, ws, VectorXd::Zero(cluster.model.nv()));
  MatrixXd gamma(cluster.closures.rows, 1), independent(cluster.rank, 1);
  for (size_t c = 0; c < cluster.closures.closures.size(); ++c) {
    const Closure& closure = cluster.closures.closures[c];
    gamma.block(cluster.closures.offsets[c], 0, getRows(closure.kind), 1) = calcClosureAcceleration(ws, closure);
  }
  point.selectIndependent(gamma, independent);
  point.solveGram(independent);
  const VectorXd a = -(cluster.inverse_metric.asDiagonal() * (point.basis().J.transpose() * independent));
  return a - T * selectRowsOf(a, linkage.joint_dofs);
}

}  // namespace

Linkage makeLinkage(const Model& model, const Reduction& reduction, const std::vector<std::string>& names) {
  std::vector<int> joints;
  int cluster = -1;
  for (const std::string& name : names) {
    const int joint = findScalarJoint(model, name);
    int owner = -1;
    for (size_t b = 0; b < reduction.clusters.size(); ++b)
      if (contains(reduction.clusters[b].joints, joint)) owner = static_cast<int>(b);
    if (!joints.empty() && (owner != cluster || owner < 0))
      throw ModelError(model.name(), "joint '" + name + "'",
                       "it is not in the linkage of '" + model.joints()[joints.front()].name + "'",
                       "name joints of one linkage at a time");
    if (contains(joints, joint)) throw ModelError(model.name(), "joint '" + name + "'", "it is named twice", "");
    cluster = owner;
    joints.push_back(joint);
  }
  if (joints.empty()) throw ModelError(model.name(), "joints", "none are named", "name a joint");
  Linkage linkage = cluster < 0 ? makeDirectLinkage(model, joints.front())
                                : makeLoopLinkage(model, reduction.clusters[cluster], std::move(joints));
  for (int i : linkage.joints) linkage.joint_names.push_back(model.joints()[i].name);
  for (int m : linkage.motors) linkage.motor_names.push_back(model.motors()[m].name);
  return linkage;
}

Linkage makeLinkage(const Model& model, ConstVectorRef q, const std::vector<std::string>& joints) {
  return makeLinkage(model, makeReduction(model, q), joints);
}

VectorXd carryLinkage(const Model& model, const Linkage& linkage, const RatioSample& sample, ConstVectorRef q) {
  VectorXd whole = q;
  if (!linkage.isDirect()) scatterConfiguration(model, *linkage.cluster, sample.q, whole);
  return whole;
}

bool Linkage::isDirect() const { return cluster->joints.empty(); }

bool calcLinkageTangent(const Linkage& linkage, const ClusterPoint& point, MatrixXd& T, double* margin) {
  const MatrixXd& N = point.basis().N;
  const Eigen::JacobiSVD<MatrixXd> svd(selectRowsOf(N, linkage.joint_dofs), Eigen::ComputeThinU | Eigen::ComputeThinV);
  const VectorXd& sigma = svd.singularValues();
  if (margin) *margin = sigma[sigma.size() - 1];
  if (!(sigma[sigma.size() - 1] > kSingular)) return false;
  T = N * (svd.matrixV() * sigma.cwiseInverse().asDiagonal() * svd.matrixU().transpose());
  return true;
}

bool calcLinkageRatio(const Linkage& linkage, ClusterPoint& point, LinkageRatio& out) {
  const int m = linkage.size();
  out.R = MatrixXd::Identity(m, m);
  out.dR.assign(m, MatrixXd::Zero(m, m));
  out.condition = 1;
  if (linkage.isDirect()) return true;
  MatrixXd T;
  if (!calcLinkageTangent(linkage, point, T)) return false;
  out.R = selectRowsOf(T, linkage.motor_dofs);  // Eq. (1)
  const Eigen::JacobiSVD<MatrixXd> svd(out.R);
  out.condition = svd.singularValues()[0] / svd.singularValues()[m - 1];

  const auto calcMotorAcceleration = [&](const VectorXd& w) {
    return VectorXd(selectRowsOf(calcDriftAcceleration(linkage, point, T, T * w), linkage.motor_dofs));
  };
  std::vector<VectorXd> alone;
  for (int j = 0; j < m; ++j) alone.push_back(calcMotorAcceleration(VectorXd::Unit(m, j)));
  for (int j = 0; j < m; ++j)
    for (int k = 0; k <= j; ++k) {  // Eq. (3), symmetric in j and k
      const VectorXd mixed = calcMotorAcceleration(VectorXd::Unit(m, j) + VectorXd::Unit(m, k));
      out.dR[k].col(j) = (mixed - alone[j] - alone[k]) / 2;
      out.dR[j].col(k) = out.dR[k].col(j);
    }
  return out.R.allFinite();
}

bool calcLinkageMotion(const Linkage& linkage, ClusterPoint& point, ConstVectorRef v_J, ConstVectorRef a_J, VectorXd& v,
                       VectorXd& a) {
  MatrixXd T;
  if (!calcLinkageTangent(linkage, point, T)) return false;
  v = T * v_J;
  a = T * a_J + calcDriftAcceleration(linkage, point, T, v);
  return true;
}

double calcBalanceError(const Model& model, const Linkage& linkage, ConstVectorRef q, const MatrixXd& R) {
  Workspace ws(model);
  ConstrainedWorkspace cws;
  const ConstraintSet loops = makeConstraintSet(model);
  const VectorXd rest = VectorXd::Zero(model.nv());
  updatePositions(model, ws, q);
  updateVelocities(model, ws, rest);
  updateBias(model, ws);
  const VectorXd gravity = ws.b;
  const auto calcAcceleration = [&](const VectorXd& tau) {
    const bool ok = updateConstrainedDynamics(model, ws, cws, loops, q, rest, gravity + tau) == DynamicsStatus::Ok;
    return ok ? cws.a : VectorXd::Constant(model.nv(), std::numeric_limits<double>::infinity());
  };
  double error = 0;
  for (int i = 0; i < linkage.size(); ++i) {
    VectorXd motor = rest, joints = rest;
    motor[model.motors()[linkage.motors[i]].dof] = 1;
    double alone = calcAcceleration(motor).norm();
    for (int j = 0; j < linkage.size(); ++j) {
      VectorXd joint = rest;
      joint[model.joints()[linkage.joints[j]].idx_v] = 1;
      joints -= R(i, j) * joint;
      alone = std::max(alone, std::max(1.0, std::abs(R(i, j))) * calcAcceleration(joint).norm());
    }
    // A motor on its own joint balances itself: nothing to compare.
    if (alone > 0) error = std::max(error, calcAcceleration(motor + joints).norm() / alone);
  }
  return error;
}

}  // namespace bielle
