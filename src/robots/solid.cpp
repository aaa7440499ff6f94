#include "robots/solid.h"

#include "math/direction.h"

namespace bielle {
namespace {

Joint makeJoint(JointKind kind, const std::string& name, const Vector3d& place) {
  Joint joint;
  joint.kind = kind;
  joint.name = name;
  joint.X_PJ.p = place;
  return joint;
}

}  // namespace

Solid makeBox(const Vector3d& center, const Vector3d& edges, double mass, const Eigen::Vector4d& rgba) {
  return {Visual::Shape::Box, edges, {Matrix3d::Identity(), center}, mass, rgba};
}

Solid makeSphere(const Vector3d& center, double radius, double mass, const Eigen::Vector4d& rgba) {
  return {Visual::Shape::Sphere, {radius, 0, 0}, {Matrix3d::Identity(), center}, mass, rgba};
}

Solid makeCylinder(const Vector3d& center, const Vector3d& axis, double radius, double length, double mass,
                   const Eigen::Vector4d& rgba) {
  const Matrix3d R = calcRotationOfZ(axis);
  return {Visual::Shape::Cylinder, {radius, length, 0}, {R, center}, mass, rgba};
}

Solid makeRod(const Vector3d& a, const Vector3d& b, double radius, double density, const Eigen::Vector4d& rgba) {
  const double length = (b - a).norm();
  return makeCylinder((a + b) / 2, b - a, radius, length, density * length, rgba);
}

Inertia calcInertia(const Solid& solid) {
  const Vector3d square = solid.size.cwiseAbs2();
  Vector3d moments;
  switch (solid.shape) {
    case Visual::Shape::Box:
      moments = Vector3d(square.y() + square.z(), square.x() + square.z(), square.x() + square.y()) / 12;
      break;
    case Visual::Shape::Cylinder:
      moments = Vector3d::Constant(square.x() / 4 + square.y() / 12);
      moments.z() = square.x() / 2;
      break;
    case Visual::Shape::Sphere:
      moments = Vector3d::Constant(0.4 * square.x());
      break;
    case Visual::Shape::Mesh:
      throw InputError("", "solid", "the inertia of a mesh is not computed", "use a box, a cylinder or a sphere");
  }
  const Matrix3d I = (solid.mass * moments).asDiagonal();
  return Inertia{solid.mass, Vector3d::Zero(), I}.transformed(solid.X_LS);
}

Inertia calcInertia(const std::vector<Solid>& solids) {
  Inertia sum;
  for (const Solid& solid : solids) sum = sum + calcInertia(solid);
  return sum;
}

Visual makeVisual(const Solid& solid) {
  Visual visual;
  visual.shape = solid.shape;
  visual.X_BV = solid.X_LS;
  visual.size = solid.size;
  visual.rgba = solid.rgba;
  return visual;
}

void addSolidLink(const std::string& link, const std::string& parent, const Joint& joint,
                  const std::vector<Solid>& solids, ModelBuilder& builder) {
  builder.addLink(link, parent, joint, {});
  addSolids(link, solids, builder);
}

void addSolids(const std::string& link, const std::vector<Solid>& solids, ModelBuilder& builder) {
  builder.addInertia(link, calcInertia(solids));
  for (const Solid& solid : solids) builder.addVisual(link, makeVisual(solid));
}

Joint makeRevolute(const std::string& name, const Vector3d& place, const Vector3d& axis) {
  Joint joint = makeJoint(JointKind::Revolute, name, place);
  joint.axis = axis;
  return joint;
}

Joint makeUniversal(const std::string& name, const Vector3d& place, const Vector3d& axis1, const Vector3d& axis2) {
  Joint joint = makeJoint(JointKind::Universal, name, place);
  joint.axis = axis1;
  joint.axis2 = axis2;
  return joint;
}

Joint makeSpherical(const std::string& name, const Vector3d& place) {
  return makeJoint(JointKind::Spherical, name, place);
}

}  // namespace bielle
