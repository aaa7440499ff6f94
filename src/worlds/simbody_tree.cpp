#include "worlds/simbody_tree.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <stdexcept>

#include "bielle/model/error.h"
#include "model/ball_leaf.h"
#include "model/joint.h"

namespace bielle {
namespace {

using SimTK::MobilizedBody;
using SimTK::Transform;
using SimTK::UnitVec3;
using SimTK::Vec3;

SimTK::Body::Rigid makeBody(const Model& model, int i) {
  const Body& body = model.bodies()[i];
  const Inertia& inertia = body.inertia;
  const Matrix3d& I = inertia.I_com;
  try {
    const SimTK::Inertia central(Vec3(I(0, 0), I(1, 1), I(2, 2)), Vec3(I(0, 1), I(0, 2), I(1, 2)));
    const Vec3 com = toSimTK(inertia.com);
    return SimTK::Body::Rigid(
        SimTK::MassProperties(inertia.mass, com, central.shiftFromMassCenter(-com, inertia.mass)));
  } catch (const SimTK::Exception::Base&) {
    throw InputError(model.name(), "body '" + body.name + "'",
                     "Simbody refuses moments of inertia that no body can have",
                     "correct its inertia, or compare with MuJoCo, or use another world");
  }
}

// Rotation whose column `axis` is the given direction.
Transform alignAxis(const Vector3d& direction, SimTK::CoordinateAxis axis) {
  return SimTK::Rotation(UnitVec3(toSimTK(direction)), axis);
}

bool arePerpendicular(const Joint& joint) { return std::abs(joint.axis.dot(joint.axis2)) < 1e-14; }

Transform makeUniversalFrame(const Joint& joint) {
  Matrix3d R;
  R << joint.axis, joint.axis2, joint.axis.cross(joint.axis2);
  return toSimTKRotation(R);
}

// (e1, e2, normal): the axes along which a planar joint measures x and y.
Transform makePlanarFrame(const Joint& joint) { return toSimTKRotation(makePlaneBasis(joint.axis)); }

Matrix3d toRotation(ConstVectorRef xyzw) {
  return Eigen::Quaterniond(xyzw[3], xyzw[0], xyzw[1], xyzw[2]).normalized().toRotationMatrix();
}

Eigen::Matrix2d rotation2(double angle) { return Eigen::Rotation2Dd(angle).toRotationMatrix(); }

// Of a coupler: sum of its polynomials less the offset.
class SumOfPolynomials : public SimTK::Function {
 public:
  explicit SumOfPolynomials(const Closure& coupler) : coupler_(coupler) {}
  double calcValue(const SimTK::Vector& x) const override {
    double sum = -coupler_.offset;
    for (int i = 0; i < getArgumentSize(); ++i) sum += derive(i, 0, x);
    return sum;
  }
  double calcDerivative(const SimTK::Array_<int>& components, const SimTK::Vector& x) const override {
    const bool is_mixed =
        std::adjacent_find(components.begin(), components.end(), std::not_equal_to<>()) != components.end();
    return is_mixed ? 0 : derive(components[0], static_cast<int>(components.size()), x);
  }
  int getArgumentSize() const override { return static_cast<int>(coupler_.terms.size()); }
  int getMaxDerivativeOrder() const override { return std::numeric_limits<int>::max(); }

 private:
  // The sum of c_k k!/(k - n)! x^(k - n).
  double derive(int i, int n, const SimTK::Vector& x) const {
    const CouplerTerm& term = coupler_.terms[static_cast<size_t>(i)];
    double sum = 0;
    for (int k = std::max(n, 1); k <= static_cast<int>(term.higher.size()) + 1; ++k) {
      const double c = k == 1 ? term.coefficient : term.higher[static_cast<size_t>(k) - 2];
      sum += c * std::tgamma(k + 1) / std::tgamma(k - n + 1) * std::pow(x[i], k - n);
    }
    return sum;
  }

  Closure coupler_;
};

// What Simbody has no element for: a constant force with its potential, and friction made smooth (model.h).
class PreloadAndFriction : public SimTK::Force::Custom::Implementation {
 public:
  PreloadAndFriction(const JointForce& force, const MobilizedBody& body) : force_(force), body_(body) {}
  void calcForce(const SimTK::State& state, SimTK::Vector_<SimTK::SpatialVec>&, SimTK::Vector_<Vec3>&,
                 SimTK::Vector& mobility_forces) const override {
    const double u = body_.getOneU(state, 0), friction = force_.friction * u / std::hypot(u, force_.friction_speed);
    body_.applyOneMobilityForce(state, 0, force_.preload - friction, mobility_forces);
  }
  SimTK::Real calcPotentialEnergy(const SimTK::State& state) const override {
    return -force_.preload * (body_.getOneQ(state, 0) - force_.rest);
  }

 private:
  JointForce force_;
  MobilizedBody body_;
};

// Simbody's constant force between two points has no potential.
class PointPreload : public SimTK::Force::Custom::Implementation {
 public:
  PointPreload(const PointSpring& spring, const MobilizedBody& body1, const MobilizedBody& body2)
      : spring_(spring), body1_(body1), body2_(body2) {}
  void calcForce(const SimTK::State& state, SimTK::Vector_<SimTK::SpatialVec>& body_forces, SimTK::Vector_<Vec3>&,
                 SimTK::Vector&) const override {
    const Vec3 force = spring_.preload * findLine(state).normalize();
    body1_.applyForceToBodyPoint(state, toSimTK(spring_.point1), force, body_forces);
    body2_.applyForceToBodyPoint(state, toSimTK(spring_.point2), -force, body_forces);
  }
  SimTK::Real calcPotentialEnergy(const SimTK::State& state) const override {
    return spring_.preload * (findLine(state).norm() - spring_.rest);
  }

 private:
  Vec3 findLine(const SimTK::State& state) const {
    return body2_.findStationLocationInGround(state, toSimTK(spring_.point2)) -
           body1_.findStationLocationInGround(state, toSimTK(spring_.point1));
  }
  PointSpring spring_;
  MobilizedBody body1_, body2_;
};

}  // namespace

SimbodyTree::SimbodyTree(const Model& m, const std::vector<Closure>& c, LoopCut cut)
    : model(m), closures(c), matter(system), forces(system), torques(forces, matter), cut_joints(c.size(), -1) {
  SimTK::Force::UniformGravity(forces, matter, toSimTK(model.gravity()));
  matter.setShowDefaultGeometry(false);
  if (cut == LoopCut::FewestRows)
    for (size_t i = 0; i < closures.size(); ++i) cut_joints[i] = findBallLeaf(model, closures, closures[i], cut_joints);
  bodies.resize(model.numBodies());
  bodies[0] = matter.Ground();
  first_pins.resize(model.numBodies());
  for (int i = 1; i < model.numBodies(); ++i)
    if (!isCut(i)) addBody(i);
  for (size_t i = 0; i < closures.size(); ++i) {
    if (cut_joints[i] < 0)
      addClosure(closures[i]);
    else
      addCutLoop(closures[i], cut_joints[i]);
  }
  for (const JointForce& force : model.jointForces()) addJointForce(force);
  for (const PointSpring& spring : model.pointSprings()) addPointSpring(spring);
  T.setIdentity(model.nv(), model.nv());
  Tdot_v.setZero(model.nv());
}

void SimbodyTree::finish() {
  state = system.realizeTopology();
  system.realizeModel(state);
  u_index.resize(model.nv());
  for (int i = 1; i < model.numBodies(); ++i) {
    const Joint& joint = model.joints()[i];
    const int u0 = isCut(i) ? -1 : int(bodies[i].getFirstUIndex(state));
    for (int k = 0; k < joint.nv; ++k) {
      if (isCut(i)) {
        u_index[joint.idx_v + k] = -1;
        continue;
      }
      int u = u0 + getSimbodySpeed(joint, k);
      if (!first_pins[i].isEmptyHandle()) u = k == 0 ? int(first_pins[i].getFirstUIndex(state)) : u0;
      u_index[joint.idx_v + k] = u;
    }
  }
}

bool SimbodyTree::isCut(int joint) const {
  return std::find(cut_joints.begin(), cut_joints.end(), joint) != cut_joints.end();
}

void SimbodyTree::addBody(int i) {
  const Joint& joint = model.joints()[i];
  const SimTK::Body::Rigid body = makeBody(model, i);
  MobilizedBody& parent = bodies[joint.parent];
  const auto at = [&joint](const Transform& X_JF) { return toSimTK(joint.X_PJ) * X_JF; };
  switch (joint.kind) {
    case JointKind::Fixed:
      break;
    case JointKind::Revolute:
    case JointKind::Continuous: {
      const Transform X = alignAxis(joint.axis, SimTK::ZAxis);
      bodies[i] = MobilizedBody::Pin(parent, at(X), body, X);
      return;
    }
    case JointKind::Prismatic: {
      const Transform X = alignAxis(joint.axis, SimTK::XAxis);
      bodies[i] = MobilizedBody::Slider(parent, at(X), body, X);
      return;
    }
    case JointKind::Spherical:
      bodies[i] = MobilizedBody::Ball(parent, at({}), body, {});
      return;
    case JointKind::Universal: {
      if (arePerpendicular(joint)) {
        const Transform X = makeUniversalFrame(joint);
        bodies[i] = MobilizedBody::Universal(parent, at(X), body, X);
        return;
      }
      const Transform X1 = alignAxis(joint.axis, SimTK::ZAxis), X2 = alignAxis(joint.axis2, SimTK::ZAxis);
      first_pins[i] = MobilizedBody::Pin(parent, at(X1), SimTK::Body::Massless(), X1);
      bodies[i] = MobilizedBody::Pin(first_pins[i], X2, body, X2);
      return;
    }
    case JointKind::Planar: {
      const Transform X = makePlanarFrame(joint);
      bodies[i] = MobilizedBody::Planar(parent, at(X), body, X);
      return;
    }
    case JointKind::FreeFlyer:
      bodies[i] = MobilizedBody::Free(parent, at({}), body, {});
      return;
  }
  throw std::logic_error("a fixed joint carries no body of a model");
}

void SimbodyTree::addCoupler(const Closure& closure) {
  const int n = static_cast<int>(closure.terms.size());
  SimTK::Vector coefficients(n + 1);
  SimTK::Array_<SimTK::MobilizedBodyIndex> coupled;
  bool is_linear = true;
  for (int i = 0; i < n; ++i) {
    const CouplerTerm& term = closure.terms[static_cast<size_t>(i)];
    coefficients[i] = term.coefficient;
    is_linear &= term.isLinear();
    coupled.push_back(bodies[term.joint].getMobilizedBodyIndex());
  }
  coefficients[n] = -closure.offset;
  SimTK::Function* function = nullptr;  // taken over by the constraint
  if (is_linear)
    function = new SimTK::Function::Linear(coefficients);
  else
    function = new SumOfPolynomials(closure);
  constraints.push_back({SimTK::Constraint::CoordinateCoupler(
      matter, function, coupled, SimTK::Array_<SimTK::MobilizerQIndex>(n, SimTK::MobilizerQIndex(0)))});
}

void SimbodyTree::addClosure(const Closure& closure) {
  if (closure.kind == ClosureKind::Coupler) return addCoupler(closure);
  MobilizedBody &body1 = bodies[closure.body1], &body2 = bodies[closure.body2];
  constraints.emplace_back();
  if (closure.kind == ClosureKind::Weld6D) {
    constraints.back() = {SimTK::Constraint::Weld(body1, toSimTK(closure.X_B1), body2, toSimTK(closure.X_B2))};
    return;
  }
  const Vec3 point1 = toSimTK(closure.X_B1.p), point2 = toSimTK(closure.X_B2.p);
  if (closure.kind == ClosureKind::Distance) {
    constraints.back() = {SimTK::Constraint::Rod(body1, point1, body2, point2, closure.length)};
    return;
  }
  if (closure.kind == ClosureKind::Slider) {
    constraints.back() = {
        SimTK::Constraint::PointOnLine(body1, UnitVec3(toSimTK(closure.X_B1.R * closure.axis)), point1, body2, point2),
        SimTK::Constraint::ConstantOrientation(body1, toSimTKRotation(closure.X_B1.R), body2,
                                               toSimTKRotation(closure.X_B2.R))};
    return;
  }
  constraints.back() = {SimTK::Constraint::Ball(body1, point1, body2, point2)};
  if (closure.kind == ClosureKind::Ball3D) return;
  const Vector3d normal1 = closure.axis.unitOrthogonal(), normal2 = closure.axis.cross(normal1);
  const UnitVec3 axis2(toSimTK(closure.X_B2.R * closure.axis));
  for (const Vector3d& normal : {normal1, normal2})
    constraints.back().push_back(SimTK::Constraint::ConstantAngle(body1, UnitVec3(toSimTK(closure.X_B1.R * normal)),
                                                                  body2, axis2, SimTK::Pi / 2));
}

void SimbodyTree::addJointForce(const JointForce& force) {
  const MobilizedBody& body = bodies[force.joint];
  const SimTK::MobilizerQIndex q(0);
  const SimTK::MobilizerUIndex u(0);
  if (force.stiffness != 0) SimTK::Force::MobilityLinearSpring(forces, body, q, force.stiffness, force.rest);
  if (force.damping != 0) SimTK::Force::MobilityLinearDamper(forces, body, u, force.damping);
  if (force.preload != 0 || force.friction != 0)
    SimTK::Force::Custom(forces, new PreloadAndFriction(force, body));  // takes it over
}

void SimbodyTree::addPointSpring(const PointSpring& spring) {
  const MobilizedBody &body1 = bodies[spring.body1], &body2 = bodies[spring.body2];
  const Vec3 point1 = toSimTK(spring.point1), point2 = toSimTK(spring.point2);
  if (spring.stiffness != 0)
    SimTK::Force::TwoPointLinearSpring(forces, body1, point1, body2, point2, spring.stiffness, spring.rest);
  if (spring.damping != 0) SimTK::Force::TwoPointLinearDamper(forces, body1, point1, body2, point2, spring.damping);
  if (spring.preload != 0) SimTK::Force::Custom(forces, new PointPreload(spring, body1, body2));  // takes it over
}

void SimbodyTree::addCutLoop(const Closure& closure, int joint) {
  const bool first = closure.body1 == joint;
  const SE3 &X_leaf = first ? closure.X_B1 : closure.X_B2, &X_other = first ? closure.X_B2 : closure.X_B1;
  bodies[joint] = MobilizedBody::Weld(bodies[first ? closure.body2 : closure.body1], toSimTK(X_other),
                                      makeBody(model, joint), toSimTK(X_leaf));
  const Joint& cut = model.joints()[joint];
  constraints.push_back({SimTK::Constraint::Ball(bodies[cut.parent], toSimTK(cut.X_PJ.p), bodies[joint], Vec3(0))});
}

// R_FM of a joint by the placements of its bodies.
SimTK::Rotation SimbodyTree::calcJointRotation(const SimTK::State& from, int joint) const {
  const Joint& cut = model.joints()[joint];
  return ~(bodies[cut.parent].getBodyRotation(from) * toSimTKRotation(cut.X_PJ.R)) *
         bodies[joint].getBodyRotation(from);
}

void SimbodyTree::setCoordinates(ConstVectorRef q) {
  for (int i = 1; i < model.numBodies(); ++i) {
    if (isCut(i)) continue;
    const Joint& joint = model.joints()[i];
    const VectorXd x = q.segment(joint.idx_q, joint.nq);
    if (!first_pins[i].isEmptyHandle()) {
      first_pins[i].setOneQ(state, 0, x[0]);
      bodies[i].setOneQ(state, 0, x[1]);
      continue;
    }
    VectorXd s = x;  // in Simbody's order
    if (joint.kind == JointKind::Spherical) s << x[3], x.head<3>();
    if (joint.kind == JointKind::FreeFlyer) s << x[6], x.segment<3>(3), x.head<3>();
    if (joint.kind == JointKind::Planar) s << x[2], x.head<2>();
    for (int k = 0; k < joint.nq; ++k) bodies[i].setOneQ(state, k, s[k]);
  }
}

void SimbodyTree::updateVelocityMap(ConstVectorRef q, ConstVectorRef velocity) {
  v = velocity;
  for (int i = 1; i < model.numBodies(); ++i) {
    const Joint& joint = model.joints()[i];
    const int k = joint.idx_v;
    if (joint.kind == JointKind::Spherical) T.block<3, 3>(k, k) = toRotation(q.segment<4>(joint.idx_q));
    if (joint.kind == JointKind::FreeFlyer) {
      const Matrix3d R = toRotation(q.segment<4>(joint.idx_q + 3));
      T.block<3, 3>(k, k) = T.block<3, 3>(k + 3, k + 3) = R;
      Tdot_v.segment<3>(k) = R * Vector3d(v.segment<3>(k + 3)).cross(Vector3d(v.segment<3>(k)));
    }
    if (joint.kind == JointKind::Planar) {
      const Eigen::Matrix2d R = rotation2(q[joint.idx_q + 2]);
      T.block<2, 2>(k, k) = R;
      Tdot_v.segment<2>(k) = R * Eigen::Vector2d(-v[k + 1], v[k]) * v[k + 2];
    }
  }
}

void SimbodyTree::readState(const SimTK::State& from, VectorXd& q, VectorXd& velocity) {
  q.resize(model.nq());
  for (int i = 1; i < model.numBodies(); ++i) {
    const Joint& joint = model.joints()[i];
    if (isCut(i)) {
      const SimTK::Quaternion wxyz = calcJointRotation(from, i).convertRotationToQuaternion();
      q.segment<4>(joint.idx_q) << wxyz[1], wxyz[2], wxyz[3], wxyz[0];
      continue;
    }
    VectorXd s(joint.nq);
    const bool chain = !first_pins[i].isEmptyHandle();
    for (int k = 0; k < joint.nq; ++k)
      s[k] = !chain ? bodies[i].getOneQ(from, k) : (k == 0 ? first_pins[i] : bodies[i]).getOneQ(from, 0);
    VectorXd x = s;
    if (joint.kind == JointKind::Spherical) x << s.tail<3>(), s[0];
    if (joint.kind == JointKind::FreeFlyer) x << s.tail<3>(), s.segment<3>(1), s[0];
    if (joint.kind == JointKind::Planar) x << s.tail<2>(), s[0];
    q.segment(joint.idx_q, joint.nq) = x;
  }
  updateVelocityMap(q, VectorXd::Zero(model.nv()));
  velocity = T.inverse() * gather(from.getU());
  for (const int joint : cut_joints) {
    if (joint < 0) continue;
    const Vec3 w_W =
        bodies[joint].getBodyAngularVelocity(from) - bodies[model.joints()[joint].parent].getBodyAngularVelocity(from);
    velocity.segment<3>(model.joints()[joint].idx_v) = toEigen(Vec3(~bodies[joint].getBodyRotation(from) * w_W));
  }
  updateVelocityMap(q, velocity);
}

void SimbodyTree::scatter(const VectorXd& ours, SimTK::Vector& u) const {
  for (int k = 0; k < model.nv(); ++k)
    if (u_index[k] >= 0) u[u_index[k]] = ours[k];
}

VectorXd SimbodyTree::gather(const SimTK::Vector& u) const {
  return VectorXd::NullaryExpr(model.nv(), [&](Eigen::Index k) { return u_index[k] < 0 ? 0 : u[u_index[k]]; });
}

}  // namespace bielle
