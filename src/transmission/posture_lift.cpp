#include "transmission/posture_lift.h"

#include <cmath>
#include <sstream>

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
    Unit unit{linkage, BlockPoint(linkage.block), BlockPoint(linkage.block), {}, {}};
    for (const std::string& name : linkage.joint_names) {
      const Joint& joint = serial_.joints()[serial_.findJoint(name)];
      unit.serial_positions.push_back(joint.idx_q);
      unit.serial_dofs.push_back(joint.idx_v);
    }
    units_.push_back(std::move(unit));
  }
  for (int i : reduction.free_joints) free_joints_.emplace_back(i, serial_.findJoint(closed.joints()[i].name));
}

LiftStatus PostureLift::setConfiguration(const VectorXd& q_s, double singular) {
  for (const auto& [closed, serial] : free_joints_) {
    const Joint &to = closed_.joints()[closed], &from = serial_.joints()[serial];
    q_.segment(to.idx_q, to.nq) = q_s.segment(from.idx_q, from.nq);
  }
  for (Unit& unit : units_) {
    VectorXd target(unit.linkage.size()), q_block(unit.linkage.block.model.nq());
    for (int j = 0; j < target.size(); ++j) target[j] = q_s[unit.serial_positions[j]];
    gatherConfiguration(closed_, unit.linkage.block, q_, q_block);
    if (!unit.here.update(unit.linkage.block, q_block)) {
      why_ = unit.here.describeFailure(unit.linkage.block);
      return LiftStatus::SingularLinkage;
    }
    const LiftStatus status = closeUnit(unit, target);
    if (status != LiftStatus::Lifted) return status;
    scatterConfiguration(closed_, unit.linkage.block, unit.here.basis().q, q_);
  }
  return checkMargin(singular);
}

LiftStatus PostureLift::setClosedConfiguration(const VectorXd& q, double singular) {
  q_ = q;
  for (Unit& unit : units_) {
    VectorXd q_block(unit.linkage.block.model.nq());
    gatherConfiguration(closed_, unit.linkage.block, q_, q_block);
    if (unit.here.update(unit.linkage.block, q_block)) continue;
    why_ = unit.here.describeFailure(unit.linkage.block);
    return LiftStatus::SingularLinkage;
  }
  return checkMargin(singular);
}

// Newton steps along the closed configurations towards the target, as long as they come nearer.
LiftStatus PostureLift::closeUnit(Unit& unit, const VectorXd& target) {
  const Linkage& linkage = unit.linkage;
  const auto calcMiss = [&](const BlockPoint& point) {
    VectorXd miss = target;
    for (int j = 0; j < linkage.size(); ++j) miss[j] -= point.basis().q[linkage.joint_positions[j]];
    return miss;
  };
  VectorXd miss = calcMiss(unit.here);
  MatrixXd T;
  for (int i = 0; i < kMaxIterations && miss.cwiseAbs().maxCoeff() > kTolerance; ++i) {
    if (!calcLinkageTangent(linkage, unit.here, T)) break;
    VectorXd d = T * miss;
    d *= std::min(1.0, kLongestStep / d.cwiseAbs().maxCoeff());
    bool nearer = false;
    for (int halving = 0; halving < kMaxHalvings && !nearer; ++halving, d /= 2)
      nearer =
          unit.next.close(linkage.block, unit.here.basis(), d, VectorXd()) && calcMiss(unit.next).norm() < miss.norm();
    if (!nearer) break;
    std::swap(unit.here, unit.next);
    miss = calcMiss(unit.here);
  }
  if (miss.cwiseAbs().maxCoeff() <= 1e3 * kTolerance) return LiftStatus::Lifted;
  Eigen::Index worst;
  miss.cwiseAbs().maxCoeff(&worst);
  std::ostringstream text;
  text << "joint '" << linkage.joint_names[worst] << "' is asked for " << target[worst] << ", its linkage comes to "
       << target[worst] - miss[worst];
  why_ = text.str();
  return LiftStatus::UnreachablePosture;
}

LiftStatus PostureLift::checkMargin(double singular) {
  margin_ = 1;
  for (const Unit& unit : units_) {
    MatrixXd T;
    double margin = 0;
    calcLinkageTangent(unit.linkage, unit.here, T, &margin);
    margin_ = std::min(margin_, margin);
    if (margin > singular) continue;
    why_ = "the linkage of joint '" + unit.linkage.joint_names.front() + "' is at a dead point of the joint";
    return LiftStatus::SingularLinkage;
  }
  return LiftStatus::Lifted;
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
  for (Unit& unit : units_) {
    const int m = unit.linkage.size();
    VectorXd v_J(m), a_J(m), v_block, a_block;
    for (int j = 0; j < m; ++j) v_J[j] = v_s[unit.serial_dofs[j]], a_J[j] = a_s[unit.serial_dofs[j]];
    if (!calcLinkageMotion(unit.linkage, unit.here, v_J, a_J, v_block, a_block)) continue;  // seen by checkMargin
    scatterVelocity(unit.linkage.block, v_block, v);
    scatterVelocity(unit.linkage.block, a_block, a);
  }
}

MatrixXd PostureLift::calcTangent() const {
  MatrixXd out = MatrixXd::Zero(closed_.nv(), serial_.nv());
  for (const auto& [closed, serial] : free_joints_) {
    const Joint &to = closed_.joints()[closed], &from = serial_.joints()[serial];
    out.block(to.idx_v, from.idx_v, to.nv, to.nv).setIdentity();
  }
  MatrixXd T;
  for (const Unit& unit : units_) {
    if (!calcLinkageTangent(unit.linkage, unit.here, T)) continue;
    for (int j = 0; j < unit.linkage.size(); ++j)
      for (size_t k = 0; k < unit.linkage.block.dofs.size(); ++k)
        out(unit.linkage.block.dofs[k], unit.serial_dofs[j]) = T(k, j);
  }
  return out;
}

}  // namespace bielle
