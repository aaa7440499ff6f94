#include "motion/posture_lift.h"

#include <cmath>

#include "math/largest.h"
#include "model/number_text.h"

namespace bielle {
namespace {

constexpr double kTolerance = 1e-12;  // of joints, rad
constexpr double kLongestStep = 0.3;  // of any dof, rad or m
constexpr int kMaxIterations = 100;
constexpr int kMaxHalvings = 20;

}  // namespace

PostureLift::PostureLift(const Model& closed, const SerialModel& serial)
    : closed_(closed), serial_(serial.model), q_(serial.q_reference) {
  const Reduction reduction = makeReduction(closed, q_);
  for (const SerialModel::Replacement& replacement : serial.replacements) {
    const Linkage linkage = makeLinkage(closed, reduction, replacement.joints);
    Drive drive{linkage, ClusterPoint(*linkage.cluster), ClusterPoint(*linkage.cluster), {}, {}};
    for (const std::string& name : linkage.joint_names) {
      const Joint& joint = serial_.joints()[serial_.findJoint(name)];
      drive.serial_positions.push_back(joint.idx_q);
      drive.serial_dofs.push_back(joint.idx_v);
    }
    drives_.push_back(std::move(drive));
  }
  for (int i : reduction.free_joints) free_joints_.emplace_back(i, serial_.findJoint(closed.joints()[i].name));
}

NumericalStatus PostureLift::setConfiguration(const VectorXd& q_s, double singular) {
  for (const auto& [closed, serial] : free_joints_) {
    const Joint &to = closed_.joints()[closed], &from = serial_.joints()[serial];
    q_.segment(to.idx_q, to.nq) = q_s.segment(from.idx_q, from.nq);
  }
  for (Drive& drive : drives_) {
    VectorXd target(drive.linkage.size()), q_cluster(drive.linkage.cluster->model.nq());
    for (int j = 0; j < target.size(); ++j) target[j] = q_s[drive.serial_positions[j]];
    gatherConfiguration(closed_, *drive.linkage.cluster, q_, q_cluster);
    if (!drive.here.update(*drive.linkage.cluster, q_cluster))
      return fail(NumericalStatus::NearDeadPoint, drive.linkage.joint_names.front(),
                  drive.here.describeFailure(*drive.linkage.cluster));
    const NumericalStatus status = closeDrive(drive, target);
    if (status != NumericalStatus::Ok) return status;
    scatterConfiguration(closed_, *drive.linkage.cluster, drive.here.basis().q, q_);
  }
  return checkMargin(singular);
}

NumericalStatus PostureLift::setClosedConfiguration(const VectorXd& q, double singular) {
  q_ = q;
  for (Drive& drive : drives_) {
    VectorXd q_cluster(drive.linkage.cluster->model.nq());
    gatherConfiguration(closed_, *drive.linkage.cluster, q_, q_cluster);
    if (!drive.here.update(*drive.linkage.cluster, q_cluster))
      return fail(NumericalStatus::NearDeadPoint, drive.linkage.joint_names.front(),
                  drive.here.describeFailure(*drive.linkage.cluster));
  }
  return checkMargin(singular);
}

// Newton steps along the closed configurations towards the target, as long as the distance decreases.
NumericalStatus PostureLift::closeDrive(Drive& drive, const VectorXd& target) {
  const Linkage& linkage = drive.linkage;
  const auto calcMiss = [&](const ClusterPoint& point) {
    VectorXd miss = target;
    for (int j = 0; j < linkage.size(); ++j) miss[j] -= point.basis().q[linkage.joint_positions[j]];
    return miss;
  };
  VectorXd miss = calcMiss(drive.here);
  MatrixXd T;
  for (int i = 0; i < kMaxIterations && !(calcLargest(miss) <= kTolerance); ++i) {
    if (!calcLinkageTangent(linkage, drive.here, T)) break;
    VectorXd d = T * miss;
    d *= std::min(1.0, kLongestStep / d.cwiseAbs().maxCoeff());
    bool nearer = false;
    for (int halving = 0; halving < kMaxHalvings && !nearer; ++halving, d /= 2)
      nearer = drive.next.close(*linkage.cluster, drive.here.basis(), d, VectorXd()) &&
               calcMiss(drive.next).norm() < miss.norm();
    if (!nearer) break;
    std::swap(drive.here, drive.next);
    miss = calcMiss(drive.here);
  }
  if (calcLargest(miss) <= 1e3 * kTolerance) return NumericalStatus::Ok;
  Eigen::Index worst;
  miss.cwiseAbs().maxCoeff(&worst);
  TextStream text;
  text << "joint '" << linkage.joint_names[worst] << "' must reach " << target[worst]
       << ", but its linkage only reaches " << target[worst] - miss[worst];
  return fail(NumericalStatus::NotClosed, linkage.joint_names[worst], text.str());
}

NumericalStatus PostureLift::fail(NumericalStatus status, const std::string& joint, const std::string& why) {
  joint_ = joint;
  why_ = why;
  return status;
}

NumericalStatus PostureLift::checkMargin(double singular) {
  margin_ = 1;
  for (const Drive& drive : drives_) {
    MatrixXd T;
    double margin = 0;
    calcLinkageTangent(drive.linkage, drive.here, T, &margin);
    margin_ = std::min(margin_, margin);
    if (margin > singular) continue;
    const std::string& joint = drive.linkage.joint_names.front();
    return fail(NumericalStatus::NearDeadPoint, joint,
                "the linkage of joint '" + joint + "' is at a dead point of the joint");
  }
  return NumericalStatus::Ok;
}

VectorXd PostureLift::liftVelocity(const VectorXd& v_s) { return calcTangent() * v_s; }

void PostureLift::liftMotion(const VectorXd& v_s, const VectorXd& a_s, VectorXd& v, VectorXd& a) {
  v.setZero(closed_.nv());
  a.setZero(closed_.nv());
  for (const auto& [closed, serial] : free_joints_) {
    const Joint &to = closed_.joints()[closed], &from = serial_.joints()[serial];
    v.segment(to.idx_v, to.nv) = v_s.segment(from.idx_v, from.nv);
    a.segment(to.idx_v, to.nv) = a_s.segment(from.idx_v, from.nv);
  }
  for (Drive& drive : drives_) {
    const int m = drive.linkage.size();
    VectorXd v_J(m), a_J(m), v_cluster, a_cluster;
    for (int j = 0; j < m; ++j) v_J[j] = v_s[drive.serial_dofs[j]], a_J[j] = a_s[drive.serial_dofs[j]];
    if (!calcLinkageMotion(drive.linkage, drive.here, v_J, a_J, v_cluster, a_cluster)) continue;  // see checkMargin
    scatterVelocity(*drive.linkage.cluster, v_cluster, v);
    scatterVelocity(*drive.linkage.cluster, a_cluster, a);
  }
}

MatrixXd PostureLift::calcTangent() const {
  MatrixXd out = MatrixXd::Zero(closed_.nv(), serial_.nv());
  for (const auto& [closed, serial] : free_joints_) {
    const Joint &to = closed_.joints()[closed], &from = serial_.joints()[serial];
    out.block(to.idx_v, from.idx_v, to.nv, to.nv).setIdentity();
  }
  MatrixXd T;
  for (const Drive& drive : drives_) {
    if (!calcLinkageTangent(drive.linkage, drive.here, T)) continue;
    for (int j = 0; j < drive.linkage.size(); ++j)
      for (size_t k = 0; k < drive.linkage.cluster->dofs.size(); ++k)
        out(drive.linkage.cluster->dofs[k], drive.serial_dofs[j]) = T(k, j);
  }
  return out;
}

}  // namespace bielle
