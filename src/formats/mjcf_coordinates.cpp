#include "formats/mjcf_coordinates.h"

#include <Eigen/Geometry>

namespace bielle {
namespace {

Eigen::Quaterniond toQuaternion(ConstVectorRef xyzw) {
  return Eigen::Quaterniond(xyzw[3], xyzw[0], xyzw[1], xyzw[2]).normalized();
}

// Where the quaternion of a joint begins in q, -1 without one.
int findQuaternion(const Joint& joint) {
  if (joint.kind == JointKind::Spherical) return 0;
  return joint.kind == JointKind::FreeFlyer ? 3 : -1;
}

// The quaternion that MuJoCo's is relative to.
Eigen::Quaterniond getOrigin(const Joint& joint, ConstVectorRef q_ref) {
  return isMjcfFree(joint) ? Eigen::Quaterniond::Identity() : toQuaternion(q_ref.segment<4>(findQuaternion(joint)));
}

}  // namespace

bool isMjcfFree(const Joint& joint) {
  return joint.kind == JointKind::FreeFlyer && joint.parent == 0 && joint.X_PJ.p.isZero(0) &&
         joint.X_PJ.R.isIdentity(0);
}

std::string getMjcfName(const Joint& joint) {
  if (joint.kind == JointKind::Universal) return joint.name + ".angle1";
  const bool has_slides = joint.kind == JointKind::Planar || joint.kind == JointKind::FreeFlyer;
  return has_slides && !isMjcfFree(joint) ? joint.name + ".x" : joint.name;
}

void calcMjcfPosition(const Joint& joint, ConstVectorRef q_ref, ConstVectorRef q, VectorRef qpos) {
  qpos = q;
  const int k = findQuaternion(joint);
  if (k < 0) return;
  const Eigen::Quaterniond r = getOrigin(joint, q_ref).conjugate() * toQuaternion(q.segment<4>(k));
  qpos.segment<4>(k) << r.w(), r.x(), r.y(), r.z();
}

void calcPositionFromMjcf(const Joint& joint, ConstVectorRef q_ref, ConstVectorRef qpos, VectorRef q) {
  q = qpos;
  const int k = findQuaternion(joint);
  if (k < 0) return;
  const Eigen::Quaterniond r(qpos[k], qpos[k + 1], qpos[k + 2], qpos[k + 3]);
  q.segment<4>(k) = (getOrigin(joint, q_ref) * r.normalized()).coeffs();
}

void calcMjcfVelocity(const Joint& joint, ConstVectorRef q, ConstVectorRef v, VectorRef qvel) {
  qvel = v;
  if (joint.kind == JointKind::Planar) qvel.head<2>() = Eigen::Rotation2Dd(q[2]) * Eigen::Vector2d(v.head<2>());
  if (joint.kind == JointKind::FreeFlyer) qvel.head<3>() = toQuaternion(q.segment<4>(3)) * Vector3d(v.head<3>());
}

void calcVelocityFromMjcf(const Joint& joint, ConstVectorRef q, ConstVectorRef qvel, VectorRef v) {
  v = qvel;
  if (joint.kind == JointKind::Planar) v.head<2>() = Eigen::Rotation2Dd(-q[2]) * Eigen::Vector2d(qvel.head<2>());
  if (joint.kind == JointKind::FreeFlyer)
    v.head<3>() = toQuaternion(q.segment<4>(3)).conjugate() * Vector3d(qvel.head<3>());
}

void calcMjcfVelocityRate(const Joint& joint, ConstVectorRef q, ConstVectorRef v, VectorRef rate) {
  rate.setZero();
  if (joint.kind == JointKind::Planar)
    rate.head<2>() = v[2] * (Eigen::Rotation2Dd(q[2]) * Eigen::Vector2d(-v[1], v[0]));
  if (joint.kind == JointKind::FreeFlyer)
    rate.head<3>() = toQuaternion(q.segment<4>(3)) * Vector3d(v.tail<3>()).cross(Vector3d(v.head<3>()));
}

}  // namespace bielle
