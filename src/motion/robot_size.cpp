#include "motion/robot_size.h"

#include <algorithm>
#include <cmath>

#include "math/direction.h"
#include "math/upright.h"
#include "motion/motor_scale.h"

namespace bielle {

bool hasSprings(const Model& model) {
  return !model.pointSprings().empty() || std::any_of(model.jointForces().begin(), model.jointForces().end(),
                                                      [](const JointForce& force) { return force.stiffness != 0; });
}

namespace {

// \param q  where it stands
RobotSize calcSize(const Model& model, ConstVectorRef q, double height) {
  RobotSize size;
  if (!model.hasFreeFlyer()) return size;
  const Eigen::Quaterniond base(q[6], q[3], q[4], q[5]);
  const Vector3d up = base.toRotationMatrix().row(2);
  const Matrix3d right = findUprightAxes(up);
  size.upright = right * calcRotationOfZ(right.transpose() * up);
  if (hasSprings(model)) return size;
  const double gravity = model.gravity().norm();
  if (!(height > 0 && gravity > 0 && model.mass() > 0)) return size;
  size.length = height / kReferenceHeight;
  size.time = std::sqrt(size.length * kReferenceGravity / gravity);
  size.torque = model.mass() / kReferenceMass * gravity / kReferenceGravity * size.length;
  return size;
}

}  // namespace

RobotSize calcRobotSize(const Model& model, const Stance& stance) {
  return calcSize(model, stance.q, stance.com.z() - stance.middle.p.z());
}

RobotSize calcRobotSize(const Model& model, const StandingRobot& standing) {
  if (standing.contacts.empty()) return {};
  double sole = 0;
  for (const SE3& contact : standing.contacts) sole += contact.p.z() / static_cast<double>(standing.contacts.size());
  return calcSize(model, standing.q, standing.com.z() - sole);
}

void scaleWeights(const RobotSize& size, MotionOptions& o) {
  for (double* weight : {&o.state_weight, &o.control_weight, &o.force_weight, &o.pressure_weight}) *weight /= size.time;
  o.control_weight /= size.torque * size.torque;
}

void scaleWeights(const RobotSize& size, LocomotionOptions& o) {
  scaleWeights(size, static_cast<MotionOptions&>(o));
  const double length = size.length, velocity = size.velocity();
  for (double* weight : {&o.com_weight, &o.com_height_weight, &o.swing_weight, &o.foothold_weight, &o.terminal_weight})
    *weight /= length * length * size.time;
  for (double* weight : {&o.com_velocity_weight, &o.swing_velocity_weight}) *weight /= velocity * velocity * size.time;
  o.swing_rotation_weight /= size.time;
}

VectorXd makeControlWeights(const Model& model, const RobotSize& size) {
  const double arm = kScrewArm * size.length;
  VectorXd weights(model.nu());
  for (int m = 0; m < model.nu(); ++m) weights[m] = isLinear(model, model.motors()[m]) ? arm * arm : 1;
  return weights;
}

void scaleStateWeights(const Model& model, const RobotSize& size, VectorXd& weights) {
  const int nv = model.nv();
  if (const Matrix3d right = findUprightAxes(size.upright.col(2)); model.hasFreeFlyer())
    for (int part : {0, 3, nv, nv + 3})
      weights.segment<3>(part) = Vector3d(right.cwiseAbs() * weights.segment<3>(part));
  for (const Joint& joint : model.joints()) {
    const int linear = joint.kind == JointKind::FreeFlyer   ? 3
                       : joint.kind == JointKind::Planar    ? 2
                       : joint.kind == JointKind::Prismatic ? 1
                                                            : 0;
    for (double* part : {&weights[joint.idx_v], &weights[nv + joint.idx_v]})
      for (int i = 0; i < linear; ++i) part[i] /= size.length * size.length;
  }
  weights.tail(nv) *= size.time * size.time;
}

Matrix3d calcWeightAxes(const RobotSize& size) {
  return findUprightAxes(size.upright.col(2)) * size.upright.transpose();
}

}  // namespace bielle
