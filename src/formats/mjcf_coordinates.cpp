#include "formats/mjcf_coordinates.h"

#include <Eigen/Geometry>
#include <cmath>

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

// Eq. (1), solved for its angles; c fits a, which is known less and less where b comes near a right angle, and any there.
Vector3d calcHingeAngles(const Matrix3d& R) {
  const double a = std::atan2(-R(1, 2), R(2, 2)), b = std::atan2(R(0, 2), std::hypot(R(0, 0), R(0, 1)));
  const Eigen::RowVector3d y = std::cos(a) * R.row(1) + std::sin(a) * R.row(2);  // of Rx(a)^T R = Ry(b) Rz(c)
  return {a, b, std::atan2(y.x(), y.y())};
}

// Eq. (2), solved for the rates.
Vector3d calcHingeRates(const Vector3d& angles, const Vector3d& w) {
  const double cb = std::cos(angles[1]), sb = std::sin(angles[1]), cc = std::cos(angles[2]), sc = std::sin(angles[2]);
  Matrix3d E;
  E << cb * cc, sc, 0, -cb * sc, cc, 0, sb, 0, 1;
  return E.inverse() * w;
}

bool isWrittenAsHinges(const Joint& joint, MjcfRotations rotations) {
  return rotations == MjcfRotations::Hinges && findQuaternion(joint) >= 0 && !isMjcfFree(joint);
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

std::vector<int> listMjcfBodies(const Model& model) {
  std::vector<std::vector<int>> children(model.numBodies());
  for (int i = 1; i < model.numBodies(); ++i) children[model.joints()[i].parent].push_back(i);
  std::vector<int> order, ahead(children[0].rbegin(), children[0].rend());
  while (!ahead.empty()) {
    const int i = ahead.back();
    ahead.pop_back();
    order.push_back(i);
    ahead.insert(ahead.end(), children[i].rbegin(), children[i].rend());
  }
  return order;
}

std::vector<std::string> listMjcfJoints(const Model& model, MjcfRotations rotations) {
  std::vector<std::string> names;
  for (int i : listMjcfBodies(model)) {
    const Joint& joint = model.joints()[i];
    const auto add = [&](std::initializer_list<const char*> suffixes) {
      for (const char* suffix : suffixes) names.push_back(joint.name + suffix);
    };
    if (joint.kind == JointKind::FreeFlyer && !isMjcfFree(joint)) add({".x", ".y", ".z"});
    if (isWrittenAsHinges(joint, rotations))
      add({".rx", ".ry", ".rz"});
    else if (joint.kind == JointKind::Universal)
      add({".angle1", ".angle2"});
    else if (joint.kind == JointKind::Planar)
      add({".x", ".y", ".angle"});
    else if (joint.nv > 0)
      add({""});
  }
  return names;
}

VectorXd calcMjcfQpos(const Model& model, ConstVectorRef q_ref, ConstVectorRef q, MjcfRotations rotations) {
  VectorXd all(model.nq());
  Eigen::Index size = 0;
  for (int i : listMjcfBodies(model)) {
    const Joint& joint = model.joints()[i];
    auto qpos = all.segment(size, joint.nq);
    calcMjcfPosition(joint, q_ref.segment(joint.idx_q, joint.nq), q.segment(joint.idx_q, joint.nq), qpos);
    size += joint.nq;
    if (!isWrittenAsHinges(joint, rotations)) continue;
    const auto wxyz = qpos.tail<4>();
    const Vector3d angles = calcHingeAngles(Eigen::Quaterniond(wxyz[0], wxyz[1], wxyz[2], wxyz[3]).toRotationMatrix());
    qpos.segment<3>(joint.nq - 4) = angles;
    size -= 1;
  }
  return all.head(size);
}

VectorXd calcMjcfQvel(const Model& model, ConstVectorRef q_ref, ConstVectorRef q, ConstVectorRef v,
                      MjcfRotations rotations) {
  const VectorXd all = calcMjcfQpos(model, q_ref, q, rotations);
  VectorXd out(model.nv());
  Eigen::Index at_q = 0, at_v = 0;
  for (int i : listMjcfBodies(model)) {
    const Joint& joint = model.joints()[i];
    const bool has_hinges = isWrittenAsHinges(joint, rotations);
    auto qvel = out.segment(at_v, joint.nv);
    calcMjcfVelocity(joint, q.segment(joint.idx_q, joint.nq), v.segment(joint.idx_v, joint.nv), qvel);
    at_q += has_hinges ? joint.nv : joint.nq;
    at_v += joint.nv;
    if (has_hinges) qvel.tail<3>() = calcHingeRates(all.segment<3>(at_q - 3), qvel.tail<3>()).eval();
  }
  return out;
}

VectorXd calcHingeMargins(const Model& model, ConstVectorRef q_ref, ConstVectorRef q) {
  VectorXd margins = VectorXd::Ones(model.numBodies());
  for (int i = 1; i < model.numBodies(); ++i) {
    const Joint& joint = model.joints()[i];
    if (!isWrittenAsHinges(joint, MjcfRotations::Hinges)) continue;
    VectorXd qpos(joint.nq);
    calcMjcfPosition(joint, q_ref.segment(joint.idx_q, joint.nq), q.segment(joint.idx_q, joint.nq), qpos);
    const auto wxyz = qpos.tail<4>();
    const Matrix3d R = Eigen::Quaterniond(wxyz[0], wxyz[1], wxyz[2], wxyz[3]).toRotationMatrix();
    margins[i] = std::hypot(R(0, 0), R(0, 1));
  }
  return margins;
}

}  // namespace bielle
