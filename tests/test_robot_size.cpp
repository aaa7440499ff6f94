// Robots of one shape, of other sizes and masses and under other gravities, move alike: planned, and under predictive control.
#include <catch2/catch.hpp>
#include <cmath>

#include "bielle/control/predictive_controller.h"
#include "bielle/model/builder.h"
#include "bielle/motion/jump.h"
#include "bielle/motion/solve.h"
#include "bielle/motion/squat.h"
#include "bielle/motion/walk.h"
#include "motion/robot_size.h"
#include "own_robots.h"
#include "selection.h"

namespace bielle {
namespace {

using bielle::testing::getBipetto;

// Over those of Bipetto.
struct Scale {
  double length, mass, gravity;
  double time() const { return std::sqrt(length / gravity); }
  double velocity() const { return length / time(); }
  double torque() const { return mass * gravity * length; }
  double inertia() const { return mass * length * length; }
};

void move(const Scale& s, SE3& X) { X.p *= s.length; }

Model scaleBipetto(const Scale& s) {
  ModelParts parts = takeParts(getBipetto());
  parts.gravity *= s.gravity;
  for (Body& body : parts.bodies) {
    body.inertia.mass *= s.mass;
    body.inertia.com *= s.length;
    body.inertia.I_com *= s.inertia();
  }
  for (Joint& joint : parts.joints) move(s, joint.X_PJ);
  for (Frame& frame : parts.frames) move(s, frame.X_BF);
  for (Closure& closure : parts.closures)
    for (SE3* X : {&closure.X_B1, &closure.X_B2}) move(s, *X);
  for (Motor& motor : parts.motors) {
    motor.armature *= s.inertia();
    motor.effort_limit *= s.torque();
    motor.velocity_limit /= s.time();
  }
  parts.armature *= s.inertia();
  parts.velocity_limits /= s.time();
  for (ContactFrame& contact : parts.contacts) {
    move(s, contact.X_BF);
    contact.half_length *= s.length;
    contact.half_width *= s.length;
  }
  for (Reference& reference : parts.references) {
    reference.height *= s.length;
    for (auto& [name, q] : reference.joints)
      for (size_t i = 0; q.size() == 7 && i < 3; ++i) q[i] *= s.length;
    for (auto& [name, position] : reference.feet) position *= s.length;
  }
  for (Shape& shape : parts.shapes) {
    move(s, shape.X_BS);
    shape.half *= s.length;
    shape.radius *= s.length;
  }
  return ModelBuilder::restore(std::move(parts));
}

const Scale kOwn{1, 1, 1};
const std::vector<Scale> kOthers{{0.35, 0.08, 1}, {1.6, 4.4, 1}, {1, 1, 1.62 / 9.81}};

WalkOptions makeWalkOptions(const Scale& s, double room = 0) {
  WalkOptions o;
  o.steps = 3;
  o.speed = 0.4 * s.velocity();
  GaitTiming& timing = o.gait.timing;
  timing.time_step = 0.012;
  for (double* time : {&timing.start, &timing.single, &timing.both, &timing.end, &timing.time_step}) *time *= s.time();
  o.gait.start_pressure = 0;
  o.gait.swing.height *= s.length;
  o.gait.feet_distance *= s.length;
  o.gait.contact_kp /= s.time() * s.time();
  o.gait.contact_kd /= s.time();
  o.gait.foothold_room = room * s.length;
  return o;
}

// As Bipetto stands.
StandingRobot stand(const Model& model, const Scale& s) {
  VectorXd q = makeStandingPosture(getBipetto());
  q.head<3>() *= s.length;
  return makeStandingRobot(model, q);
}

MotionPlan plan(const std::string& motion, const Model& model, const Scale& s) {
  const StandingRobot standing = stand(model, s);
  if (motion == "walk") return planWalk(model, makeWalkOptions(s), standing);
  if (motion == "squat") {
    SquatOptions o;
    o.time_step = 0.015;
    for (double* time : {&o.duration, &o.settle, &o.time_step}) *time *= s.time();
    o.contact_kp /= s.time() * s.time();
    o.contact_kd /= s.time();
    return planSquat(model, o, standing);
  }
  JumpOptions o;
  o.time_step = 0.005;
  for (double* time : {&o.flight, &o.stand, &o.push, &o.land, &o.settle, &o.time_step}) *time *= s.time();
  for (double* length : {&o.stretch, &o.clearance}) *length *= s.length;
  o.contact_kp /= s.time() * s.time();
  o.contact_kd /= s.time();
  return planJump(model, o, standing);
}

// Of the size of Bipetto again.
VectorXd unscale(const Model& model, const Scale& s, VectorXd x) {
  x.head<3>() /= s.length;
  x.tail(model.nv()) *= s.time();
  x.segment<3>(model.nq()) /= s.length;
  return x;
}

ShootingTrajectory scale(const Model& model, const Scale& s, ShootingTrajectory of_bipetto) {
  for (VectorXd& x : of_bipetto.xs) {
    x.head<3>() *= s.length;
    x.tail(model.nv()) /= s.time();
    x.segment<3>(model.nq()) *= s.length;
  }
  for (VectorXd& u : of_bipetto.us) u *= s.torque();
  return of_bipetto;
}

double findLargest(const std::vector<VectorXd>& values) {
  double most = 0;
  for (const VectorXd& value : values) most = std::max(most, value.cwiseAbs().maxCoeff());
  return most;
}

// \param guess  of Bipetto, or null: the motion's own
Solution solve(const std::string& motion, const Scale& s, const ShootingTrajectory* guess = nullptr) {
  const Model model = scaleBipetto(s);
  SolveOptions how;
  how.solver = FddpOptions();
  how.solver.cost_tolerance = 0;
  how.solver.gradient_tolerance = 1e-16 / (s.torque() * s.torque());
  how.refine = false;
  if (guess) how.start = StartingPoint{scale(model, s, *guess)};
  return bielle::solve(makeMotion(model, plan(motion, model, s), ProblemOptions()), how);
}

TEST_CASE("robot size: that of Bipetto is the reference") {
  const RobotSize size = calcRobotSize(getBipetto(), makeStandingRobot(getBipetto()));
  for (double value : {size.length, size.time, size.torque}) CHECK(value == Approx(1).epsilon(1e-12));
}

TEST_CASE("robot size: robots of one shape have the same motions", "[sweep]") {
  const std::string motion = GENERATE("squat", "walk", "jump");
  CAPTURE(motion);
  const Solution own = solve(motion, kOwn);
  REQUIRE(own.converged());
  const double torque = findLargest(own.trajectory.us);
  testing::Selection selection(3);
  for (const Scale& s : kOthers) {
    if (selection.isLeftOut()) continue;
    CAPTURE(s.length, s.mass, s.gravity);
    const Solution other = solve(motion, s, &own.motion.guess);
    REQUIRE(other.converged());
    CHECK(other.summary.cost == Approx(own.summary.cost).epsilon(1e-8));
    const Model& model = other.motion.problem->model();
    double states = 0, torques = 0;
    for (size_t k = 0; k < own.trajectory.xs.size(); ++k)
      states =
          std::max(states, (unscale(model, s, other.trajectory.xs[k]) - own.trajectory.xs[k]).cwiseAbs().maxCoeff());
    for (size_t k = 0; k < own.trajectory.us.size(); ++k)
      torques = std::max(torques, (other.trajectory.us[k] / s.torque() - own.trajectory.us[k]).cwiseAbs().maxCoeff());
    CHECK(states < 1e-6);
    CHECK(torques / torque < 1e-6);
  }
}

// The torques of a controller whose robot is beside its plan.
std::vector<VectorXd> control(const Scale& s, const ShootingTrajectory& walk) {
  const Model model = scaleBipetto(s);
  PredictiveOptions options;
  options.nodes = 30;
  options.threads = 1;
  const ShootingTrajectory scaled = scale(model, s, walk);
  const StandingRobot standing = stand(model, s);
  PredictiveController controller(
      makePredictiveMotion(model, planWalk(model, makeWalkOptions(s, 0.4), standing), ProblemOptions(), options),
      scaled, options);
  std::vector<VectorXd> torques;
  for (int k = 0; k < 60; ++k) {
    Measurement measurement;
    measurement.time = k * 0.012 * s.time();
    measurement.q = scaled.xs[k].head(model.nq());
    measurement.v = scaled.xs[k].tail(model.nv());
    measurement.v[0] += 0.05 * s.velocity();
    measurement.v[4] -= 0.03 / s.time();
    VectorXd u = VectorXd::Zero(model.nu());
    controller.update(measurement, u);
    torques.push_back(u / s.torque());
  }
  CHECK(controller.counts().failed == 0);
  return torques;
}

TEST_CASE("robot size: predictive control of robots of one shape is the same", "[sweep]") {
  const ShootingTrajectory walk = solve("walk", kOwn).trajectory;
  const std::vector<VectorXd> own = control(kOwn, walk);
  const double torque = findLargest(own);
  testing::Selection selection(3);
  for (const Scale& s : kOthers) {
    if (selection.isLeftOut()) continue;
    CAPTURE(s.length, s.mass, s.gravity);
    const std::vector<VectorXd> other = control(s, walk);
    double off = 0;
    for (size_t k = 0; k < own.size(); ++k) off = std::max(off, (other[k] - own[k]).cwiseAbs().maxCoeff());
    CHECK(off / torque < 1e-6);
  }
}

}  // namespace
}  // namespace bielle
