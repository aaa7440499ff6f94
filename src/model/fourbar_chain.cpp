#include "bielle/model/fourbar_chain.h"

#include <cmath>

#include "bielle/model/builder.h"

namespace bielle {
namespace {

// A slender rod from the origin along x.
Inertia makeRod(double length, double density) {
  Inertia rod;
  rod.mass = density * length;
  rod.com = {length / 2, 0, 0};
  const double across = rod.mass * length * length / 12;
  rod.I_com = Vector3d(0, across, across).asDiagonal();
  return rod;
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
    throw ModelError("", "four-bar chain",
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
  ModelBuilder builder("chain of four-bars");
  std::string ground = "world";
  for (int i = 1; i <= o.count; ++i) {
    const std::string n = std::to_string(i), rocker = "rocker" + n, crank = "crank" + n, coupler = "coupler" + n;
    builder.addLink(rocker, ground, makeHinge(rocker, o.ground), makeRod(o.rocker, o.density));
    builder.addLink(crank, ground, makeHinge(crank, 0), makeRod(o.crank, o.density));
    builder.addLink(coupler, crank, makeHinge(coupler, o.crank), makeRod(o.coupler, o.density));
    builder.addFrame("end of " + coupler, coupler, {Matrix3d::Identity(), {o.coupler, 0, 0}});
    builder.addFrame("end of " + rocker, rocker, {Matrix3d::Identity(), {o.rocker, 0, 0}});
    builder.addClosure("loop" + n, ClosureKind::Hinge5D, "end of " + coupler, "end of " + rocker, Vector3d::UnitY());
    builder.addMotor(o.motor == FourBarMotor::Crank ? crank : rocker);
    ground = coupler;
  }
  return {builder.build(), q.replicate(o.count, 1)};
}

}  // namespace bielle
