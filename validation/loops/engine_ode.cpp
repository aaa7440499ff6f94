// ODE: bodies with six freedoms each, all joints and closures as its constraints, steps of semi-implicit Euler with all rows
// solved at once (dWorldStep). Error reduction and force mixing are its own, 0.2 and 1e-10. Coordinates are read from the bodies.
#include <ode/ode.h>

#include <cmath>

#include "outside_engine.h"

namespace {

using namespace bielle::outside;

class Ode {
 public:
  explicit Ode(const Mechanism& mechanism) : mechanism_(mechanism), bodies_(mechanism.bodies.size()) {
    dInitODE2(0);
    dAllocateODEDataForThread(dAllocateMaskAll);
  }
  ~Ode() {
    if (world_) dWorldDestroy(world_);
    dCloseODE();
  }
  Ode(const Ode&) = delete;
  Ode& operator=(const Ode&) = delete;

  void start(const VectorXd& q, const VectorXd& v) {
    if (world_) dWorldDestroy(world_);
    world_ = dWorldCreate();
    const Vector3d& g = mechanism_.gravity;
    dWorldSetGravity(world_, g.x(), g.y(), g.z());
    q_ = q;
    forces_ = VectorXd::Zero(mechanism_.size);
    std::vector<Isometry3d> X(bodies_.size(), Isometry3d::Identity());
    std::vector<Vector3d> w(bodies_.size(), Vector3d::Zero()), v_origin = w;
    for (size_t i = 1; i < bodies_.size(); ++i) {
      const Body& body = mechanism_.bodies[i];
      const Isometry3d X_WJ = X[body.parent] * body.X_PJ;
      X[i] = X_WJ * body.calcMotion(q);
      const Vector3d axis = X_WJ.linear() * body.axis;
      w[i] = w[body.parent];
      v_origin[i] = v_origin[body.parent] + w[body.parent].cross(X[i].translation() - X[body.parent].translation());
      if (body.kind == Kind::Slide)
        v_origin[i] += v[body.index] * axis;
      else
        w[i] += v[body.index] * axis;
      if (body.kind == Kind::Universal) w[i] += v[body.index + 1] * (X[i].linear() * body.axis2);
      addBody(i, X[i], v_origin[i], w[i]);
      addJoint(body, bodies_[i], X_WJ.linear(), X[i]);
    }
    for (const Closure& closure : mechanism_.closures) {
      const Vector3d at = X[closure.body1] * closure.point1, axis = X[closure.body1].linear() * closure.axis;
      if (closure.is_hinge)
        addHinge(bodies_[closure.body1], bodies_[closure.body2], at, axis);
      else
        addBall(bodies_[closure.body1], bodies_[closure.body2], at);
    }
  }
  void setForces(const VectorXd& tau) { forces_ = tau; }
  void step(double h) {
    for (size_t i = 1; i < bodies_.size(); ++i) addJointForce(mechanism_.bodies[i], bodies_[i]);
    for (const Spring& spring : mechanism_.springs) {
      const Vector3d x1 = locate(spring.body1, spring.point1), x2 = locate(spring.body2, spring.point2);
      const Vector3d force =
          spring.calcForce(x1, calcVelocity(bodies_[spring.body1], x1), x2, calcVelocity(bodies_[spring.body2], x2));
      addForce(bodies_[spring.body1], force, x1);
      addForce(bodies_[spring.body2], -force, x2);
    }
    dWorldStep(world_, h);
    q_ = q();
  }

  // Angles go on from those before: they may be of several turns.
  VectorXd q() const {
    VectorXd q = q_;
    for (size_t i = 1; i < bodies_.size(); ++i) {
      const Body& body = mechanism_.bodies[i];
      const Isometry3d X_J = (place(body.parent) * body.X_PJ).inverse() * place(static_cast<int>(i));
      double& first = q[body.index];
      if (body.kind == Kind::Slide) {
        first = X_J.translation().dot(body.axis);
        continue;
      }
      const Matrix3d& R = X_J.linear();
      // Normal to the axis of a hinge; the second axis of a universal joint is moved by the first alone.
      const Vector3d normal = body.kind == Kind::Universal ? body.axis2 : body.axis.unitOrthogonal();
      first += std::remainder(calcAngle(body.axis, normal, R * normal) - first, 2 * M_PI);
      if (body.kind != Kind::Universal) continue;
      double& second = q[body.index + 1];
      second += std::remainder(-calcAngle(body.axis2, body.axis, R.transpose() * body.axis) - second, 2 * M_PI);
    }
    return q;
  }
  VectorXd v() const {
    VectorXd v(mechanism_.size);
    for (size_t i = 1; i < bodies_.size(); ++i) {
      const Body& body = mechanism_.bodies[i];
      const dBodyID parent = bodies_[body.parent];
      const Isometry3d X = place(static_cast<int>(i));
      const Vector3d axis = (place(body.parent) * body.X_PJ).linear() * body.axis;
      const Vector3d w = getTurning(bodies_[i]) - getTurning(parent), x = X.translation();
      v[body.index] =
          axis.dot(body.kind == Kind::Slide ? Vector3d(calcVelocity(bodies_[i], x) - calcVelocity(parent, x)) : w);
      if (body.kind == Kind::Universal) v[body.index + 1] = (X.linear() * body.axis2).dot(w);
    }
    return v;
  }

 private:
  static double calcAngle(const Vector3d& axis, const Vector3d& from, const Vector3d& to) {
    return std::atan2(axis.dot(from.cross(to)), from.dot(to));
  }
  void addBody(size_t i, const Isometry3d& X, const Vector3d& v_origin, const Vector3d& w) {
    const Body& body = mechanism_.bodies[i];
    const Matrix3d& I = body.moments;
    dMass mass;
    dMassSetParameters(&mass, body.mass, 0, 0, 0, I(0, 0), I(1, 1), I(2, 2), I(0, 1), I(0, 2), I(1, 2));
    bodies_[i] = dBodyCreate(world_);
    dBodySetMass(bodies_[i], &mass);
    const Vector3d com = X * body.com, v = v_origin + w.cross(com - X.translation());
    dMatrix3 R = {};
    for (int row = 0; row < 3; ++row)
      for (int col = 0; col < 3; ++col) R[4 * row + col] = X.linear()(row, col);
    dBodySetPosition(bodies_[i], com.x(), com.y(), com.z());
    dBodySetRotation(bodies_[i], R);
    dBodySetLinearVel(bodies_[i], v.x(), v.y(), v.z());
    dBodySetAngularVel(bodies_[i], w.x(), w.y(), w.z());
  }
  void addJoint(const Body& body, dBodyID child, const Matrix3d& R_WJ, const Isometry3d& X) {
    const dBodyID parent = bodies_[body.parent];
    const Vector3d axis = R_WJ * body.axis, at = X.translation();
    if (body.kind == Kind::Hinge) return addHinge(parent, child, at, axis);
    if (body.kind == Kind::Slide) {
      const dJointID joint = dJointCreateSlider(world_, nullptr);
      dJointAttach(joint, parent, child);
      dJointSetSliderAxis(joint, axis.x(), axis.y(), axis.z());
      return;
    }
    const dJointID joint = dJointCreateUniversal(world_, nullptr);
    const Vector3d axis2 = X.linear() * body.axis2;
    dJointAttach(joint, parent, child);
    dJointSetUniversalAnchor(joint, at.x(), at.y(), at.z());
    dJointSetUniversalAxis1(joint, axis.x(), axis.y(), axis.z());
    dJointSetUniversalAxis2(joint, axis2.x(), axis2.y(), axis2.z());
  }
  void addHinge(dBodyID body1, dBodyID body2, const Vector3d& at, const Vector3d& axis) {
    const dJointID joint = dJointCreateHinge(world_, nullptr);
    dJointAttach(joint, body1, body2);
    dJointSetHingeAnchor(joint, at.x(), at.y(), at.z());
    dJointSetHingeAxis(joint, axis.x(), axis.y(), axis.z());
  }
  void addBall(dBodyID body1, dBodyID body2, const Vector3d& at) {
    const dJointID joint = dJointCreateBall(world_, nullptr);
    dJointAttach(joint, body1, body2);
    dJointSetBallAnchor(joint, at.x(), at.y(), at.z());
  }
  // On both sides of a hinge; no other joint of these mechanisms has a motor.
  void addJointForce(const Body& body, dBodyID child) {
    if (forces_[body.index] == 0) return;
    const Vector3d torque = forces_[body.index] * ((place(body.parent) * body.X_PJ).linear() * body.axis);
    dBodyAddTorque(child, torque.x(), torque.y(), torque.z());
    if (bodies_[body.parent]) dBodyAddTorque(bodies_[body.parent], -torque.x(), -torque.y(), -torque.z());
  }
  static void addForce(dBodyID body, const Vector3d& force, const Vector3d& at) {
    if (body) dBodyAddForceAtPos(body, force.x(), force.y(), force.z(), at.x(), at.y(), at.z());
  }
  Isometry3d place(int i) const {
    Isometry3d X = Isometry3d::Identity();
    if (!bodies_[i]) return X;
    const dReal *R = dBodyGetRotation(bodies_[i]), *p = dBodyGetPosition(bodies_[i]);
    for (int row = 0; row < 3; ++row)
      for (int col = 0; col < 3; ++col) X.linear()(row, col) = R[4 * row + col];
    X.translation() = Vector3d(p[0], p[1], p[2]) - X.linear() * mechanism_.bodies[i].com;
    return X;
  }
  Vector3d locate(int i, const Vector3d& point) const { return place(i) * point; }
  static Vector3d getTurning(dBodyID body) {
    return body ? Vector3d(dBodyGetAngularVel(body)) : Vector3d(Vector3d::Zero());
  }
  static Vector3d calcVelocity(dBodyID body, const Vector3d& x) {
    dVector3 v = {};
    if (body) dBodyGetPointVel(body, x.x(), x.y(), x.z(), v);
    return Vector3d(v);
  }

  const Mechanism mechanism_;
  dWorldID world_ = nullptr;
  std::vector<dBodyID> bodies_;  // per body; the world is none
  VectorXd q_, forces_;
};

}  // namespace

int main() { return serve<Ode>(); }
