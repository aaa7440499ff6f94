#include "bielle/robots/fourbar_chain.h"

#include <cmath>

#include "bielle/model/builder.h"
#include "math/direction.h"

namespace bielle {
namespace {

// A round rod from the origin along x, slender without a radius.
Inertia calcRodInertia(double length, double density, double radius) {
  Inertia rod;
  rod.mass = density * length;
  rod.com = {length / 2, 0, 0};
  const double across = rod.mass * (length * length / 12 + radius * radius / 4);
  rod.I_com = Vector3d(rod.mass * radius * radius / 2, across, across).asDiagonal();
  return rod;
}

void addRod(const std::string& link, const std::string& parent, const Joint& joint, double length,
            const FourBarChainOptions& o, ModelBuilder& builder) {
  builder.addLink(link, parent, joint, calcRodInertia(length, o.density, o.radius));
  if (o.radius == 0) return;
  Visual visual;
  visual.shape = Visual::Shape::Cylinder;
  visual.X_BV = {calcRotationOfZ(Vector3d::UnitX()), {length / 2, 0, 0}};
  visual.size = {o.radius, length, 0};
  builder.addVisual(link, visual);
}

Joint makeHinge(const std::string& name, double x) {
  Joint joint;
  joint.name = name;
  joint.kind = JointKind::Continuous;
  joint.axis = -Vector3d::UnitY();
  joint.X_PJ.p = {x, 0, 0};
  return joint;
}

// theta4, theta2, theta3 - theta2 by Eq. (2)
Vector3d closeFourBar(const FourBarChainOptions& o) {
  const double px = o.crank * std::cos(o.crank_angle), pz = o.crank * std::sin(o.crank_angle);
  const double wx = o.ground - px, wz = -pz, l = std::hypot(wx, wz);
  const double h = (l * l + o.coupler * o.coupler - o.rocker * o.rocker) / (2 * l);
  const double square = o.coupler * o.coupler - h * h;
  if (!(o.count >= 1 && o.density > 0 && l > 0 && square >= 0))
    throw InputError("", "four-bar chain",
                     "crank, coupler and rocker do not meet at a crank angle of " + std::to_string(o.crank_angle) +
                         " rad, or its count or density is not positive",
                     "change the lengths or the angle");
  const double s = std::sqrt(square);
  const double qx = px + (h * wx - s * wz) / l, qz = pz + (h * wz + s * wx) / l;
  return {std::atan2(qz, qx - o.ground), o.crank_angle, std::atan2(qz - pz, qx - px) - o.crank_angle};
}

}  // namespace

FourBarChain makeFourBarChain(const FourBarChainOptions& o) {
  const Vector3d q = closeFourBar(o);
  ModelBuilder builder("fourbar_chain");
  Reference closed;
  closed.name = "closed";
  std::string ground = "world";
  for (int i = 1; i <= o.count; ++i) {
    const std::string n = std::to_string(i), rocker = "rocker" + n, crank = "crank" + n, coupler = "coupler" + n;
    addRod(rocker, ground, makeHinge(rocker, o.ground), o.rocker, o, builder);
    addRod(crank, ground, makeHinge(crank, 0), o.crank, o, builder);
    addRod(coupler, crank, makeHinge(coupler, o.crank), o.coupler, o, builder);
    builder.addFrame("end of " + coupler, coupler, {Matrix3d::Identity(), {o.coupler, 0, 0}});
    builder.addFrame("end of " + rocker, rocker, {Matrix3d::Identity(), {o.rocker, 0, 0}});
    builder.addClosure("loop" + n, ClosureKind::Hinge5D, "end of " + coupler, "end of " + rocker, Vector3d::UnitY());
    builder.addMotor(o.motor == FourBarMotor::Crank ? crank : rocker);
    closed.joints[rocker] = {q[0]};
    closed.joints[crank] = {q[1]};
    closed.joints[coupler] = {q[2]};
    ground = coupler;
  }
  builder.addReference(closed);
  return {builder.build(), q.replicate(o.count, 1)};
}

}  // namespace bielle
