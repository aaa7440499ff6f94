// Springs, dampers and friction on joints, springs and dampers between points. Oracles: an oscillator in closed form, central
// differences, power.
#include <Eigen/Eigenvalues>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/constrained.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/rnea.h"
#include "bielle/dynamics/variation.h"
#include "check_derivative.h"
#include "dynamics/reduction.h"
#include "dynamics/smooth_friction.h"
#include "get_error.h"
#include "model/stiction.h"
#include "selection.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

Joint makeSlide() {
  Joint joint;
  joint.name = "slide";
  joint.kind = JointKind::Prismatic;
  return joint;
}

}  // namespace

TEST_CASE("a mass on a spring with damper, preload and friction: its force in closed form") {
  ModelBuilder builder("oscillator");
  builder.addLink("mass", "world", makeSlide(), {2, Vector3d::Zero(), 0.1 * Matrix3d::Identity()});
  JointForce force;
  force.stiffness = 50, force.rest = 0.1, force.preload = 3, force.damping = 4, force.friction = 5;
  force.friction_speed = 0.2;
  builder.addJointForce("slide", force);
  const Model model = builder.build();
  REQUIRE(model.jointForces().size() == 1);
  Workspace ws(model);
  const double q = 0.4, v = -0.15;
  const VectorXd bias =
      calcInverseDynamics(model, ws, VectorXd::Constant(1, q), VectorXd::Constant(1, v), VectorXd::Zero(1));
  // At three quarters of the friction speed, the friction has 3/5 of its size.
  const double tau = 3 - 50 * 0.3 + 4 * 0.15 + 5 * 0.6;
  CHECK(bias[0] == Approx(2 * 9.81 - tau).epsilon(1e-14));
  CHECK(calcPotentialEnergy(model, ws) == Approx(2 * 9.81 * q + 25 * 0.09 - 3 * 0.3).epsilon(1e-14));

  const auto refuse = [&](const std::string& joint, const JointForce& bad, const char* problem) {
    ModelBuilder other("other");
    other.addLink("mass", "world", makeSlide(), {2, Vector3d::Zero(), 0.1 * Matrix3d::Identity()});
    Joint ball;
    ball.name = "ball", ball.kind = JointKind::Spherical;
    other.addLink("other", "mass", ball, {1, Vector3d::Zero(), 0.1 * Matrix3d::Identity()});
    other.addJointForce("slide", force);
    CHECK_THAT(getError([&] { other.addJointForce(joint, bad); }), Catch::Contains(problem));
  };
  refuse("none", force, "no moving joint");
  refuse("ball", force, "spherical joint of 3 coordinates");
  refuse("slide", force, "declared twice");
}

TEST_CASE("joint forces: friction that is larger at rest, in closed form and against differences") {
  const auto make = [](const WholeJointForce& whole) {
    ModelBuilder builder("oscillator");
    builder.addLink("mass", "world", makeSlide(), {2, Vector3d::Zero(), 0.1 * Matrix3d::Identity()});
    for (const JointForce& force : splitJointForce(whole)) builder.addJointForce("slide", force);
    builder.setGravity(Vector3d::Zero());
    return builder.build();
  };
  WholeJointForce whole;
  whole.force.stiffness = 50, whole.force.damping = 4, whole.force.friction = 5, whole.force.friction_speed = 0.01;
  whole.stiction = 8, whole.stribeck_speed = 0.3;
  const Model model = make(whole);
  REQUIRE(model.jointForces().size() == 2);
  const std::vector<WholeJointForce> joined = joinJointForces(model);
  REQUIRE(joined.size() == 1);
  CHECK((joined[0].force.friction == 5 && joined[0].force.friction_speed == 0.01 && joined[0].force.stiffness == 50));
  CHECK((joined[0].stiction == 8 && joined[0].stribeck_speed == 0.3));
  Workspace ws(model);
  const auto calcForce = [&](double v) {
    return calcInverseDynamics(model, ws, VectorXd::Zero(1), VectorXd::Constant(1, v), VectorXd::Zero(1))[0];
  };
  // At 0.4: 4/5 of what falls; at 0.01: 1/sqrt(2) of all, and 1/30 of that; far away: that of sliding.
  CHECK(calcForce(0.4) == Approx(4 * 0.4 + 8 * 0.4 / std::hypot(0.4, 0.01) - 3 * 0.8).epsilon(1e-14));
  CHECK(calcForce(-0.01) == Approx(-(4 * 0.01 + 8 / std::sqrt(2) - 3 * 0.01 / std::hypot(0.01, 0.3))).epsilon(1e-14));
  CHECK(calcForce(30) == Approx(4 * 30 + 5).epsilon(1e-5));
  CHECK(calcForce(0.05) > calcForce(0.3));  // it falls
  for (const double v : {0.005, 0.1, -0.3}) {
    calcForce(v);
    updateInverseDynamicsDerivatives(model, ws, {});
    const MatrixXd slope = ws.dID_dv;
    checkDerivative(slope, differentiate(VectorXd::Constant(1, v), 1e-4, [&](const VectorXd& x) {
                      return VectorXd::Constant(1, calcForce(x[0])).eval();
                    }));
  }
  CHECK(splitJointForce({whole.force, 5}).size() == 1);

  const auto refuse = [&](double fall, double speed, const char* problem) {
    ModelBuilder builder("oscillator");
    builder.addLink("mass", "world", makeSlide(), {2, Vector3d::Zero(), 0.1 * Matrix3d::Identity()});
    builder.addJointForce("slide", whole.force);
    JointForce second;
    second.friction = -fall, second.friction_speed = speed;
    CHECK_THAT(getError([&] { builder.addJointForce("slide", second); }), Catch::Contains(problem));
    second.friction = -1, second.friction_speed = 0.5;
    builder.addJointForce("slide", second);
    CHECK_THAT(getError([&] { builder.addJointForce("slide", second); }), Catch::Contains("declared twice"));
  };
  refuse(5.1, 0.3, "falls below zero");
  refuse(1, 0.005, "less than its friction_speed");
}

TEST_CASE("refused numbers of joint forces") {
  const auto refuse = [](const char* problem, double JointForce::*field, double value) {
    ModelBuilder builder("oscillator");
    builder.addLink("mass", "world", makeSlide(), {2, Vector3d::Zero(), 0.1 * Matrix3d::Identity()});
    JointForce force;
    force.*field = value;
    CHECK_THAT(getError([&] { builder.addJointForce("slide", force); }), Catch::Contains(problem));
  };
  for (auto field : {&JointForce::stiffness, &JointForce::damping, &JointForce::friction})
    for (double value : {-1.0, std::nan(""), HUGE_VAL}) refuse("not a finite number of 0 or more", field, value);
  for (auto field : {&JointForce::rest, &JointForce::preload}) refuse("not finite", field, HUGE_VAL);
  refuse("friction_speed is not positive", &JointForce::friction_speed, 0);
}

TEST_CASE("a spring and damper between two points: its force and energy in closed form") {
  const auto make = [](PointSpring spring) {
    ModelBuilder builder("oscillator");
    builder.addLink("mass", "world", makeSlide(), {2, Vector3d::Zero(), 0.1 * Matrix3d::Identity()});
    builder.addFrame("anchor", "world", {Matrix3d::Identity(), {0.1, 0, 0}});
    spring.name = "spring";
    builder.addPointSpring("anchor", "mass", spring);
    return builder.build();
  };
  PointSpring spring;
  spring.point1 = {0.3, 0, 0}, spring.point2 = {0.1, 0, 0};  // 0.3 m beside the slide
  spring.stiffness = 50, spring.rest = 0.2, spring.preload = 3, spring.damping = 4;
  const Model model = make(spring);
  REQUIRE(model.pointSprings().size() == 1);
  CHECK(model.pointSprings()[0].dofs == std::vector<int>{0});
  CHECK(model.pointSprings()[0].signs == std::vector<int>{-1});
  Workspace ws(model);
  const auto calcForce = [](const Model& m, Workspace& w, double q, double v) {
    return 2 * 9.81 -
           calcInverseDynamics(m, w, VectorXd::Constant(1, q), VectorXd::Constant(1, v), VectorXd::Zero(1))[0];
  };
  // At q = 0.4 the line is 0.5 m long and its rate is 0.8 v; it pulls the mass down.
  const double tension = 3 + 50 * 0.3 + 4 * 0.8 * -0.15;
  CHECK(calcForce(model, ws, 0.4, -0.15) == Approx(-0.8 * tension).epsilon(1e-14));
  CHECK(calcPotentialEnergy(model, ws) == Approx(2 * 9.81 * 0.4 + 25 * 0.09 + 3 * 0.3).epsilon(1e-14));

  // Where the points meet, everything stays finite, and a preload has no direction.
  spring.point1 = {-0.1, 0, 0}, spring.point2 = Vector3d::Zero();
  const Model meeting = make(spring);
  Workspace other(meeting);
  CHECK(calcForce(meeting, other, 0, -0.15) == 0);
  CHECK(calcForce(meeting, other, 1e-6, -0.15) == Approx(7 + 4 * 0.15).epsilon(1e-4));
  updateInverseDynamicsDerivatives(meeting, other, {});
  CHECK((other.dID_dq.allFinite() && other.dID_dv.allFinite()));
  CHECK_THAT(getError([&] { makeReduction(meeting, VectorXd::Zero(1)); }), Catch::Contains("its points coincide"));
}

TEST_CASE("refused springs between points") {
  const auto refuse = [](const char* problem, const auto& change, const std::string& frame2 = "mass") {
    ModelBuilder builder("oscillator");
    builder.addLink("mass", "world", makeSlide(), {2, Vector3d::Zero(), 0.1 * Matrix3d::Identity()});
    PointSpring spring;
    spring.name = "spring";
    builder.addPointSpring("world", "mass", spring);
    spring.name = "other";
    change(spring);
    CHECK_THAT(getError([&] { builder.addPointSpring("world", frame2, spring); }), Catch::Contains(problem));
  };
  const auto nothing = [](PointSpring&) {};
  refuse("two of them have this name", [](PointSpring& spring) { spring.name = "spring"; });
  refuse("there is no link or frame 'none'", nothing, "none");
  refuse("on the same rigid body", nothing, "world");
  for (auto field : {&PointSpring::stiffness, &PointSpring::rest, &PointSpring::damping})
    for (double value : {-1.0, std::nan(""), HUGE_VAL})
      refuse("not a finite number of 0 or more", [&](PointSpring& spring) { spring.*field = value; });
  refuse("its preload is not finite", [](PointSpring& spring) { spring.preload = std::nan(""); });
  refuse("a point is not finite", [](PointSpring& spring) { spring.point1.x() = HUGE_VAL; });
}

TEST_CASE("joint forces: inverse and constrained dynamics against differences, every joint kind", "[sweep]") {
  std::mt19937 rng(41);
  Selection selection;
  for (JointKind kind : kJointKinds)
    for (ClosureKind closure : kClosureKinds) {
      if (selection.isLeftOut()) continue;
      CAPTURE(getName(kind), getName(closure));
      const Mechanism mechanism = makeSprungMechanism(rng, kind, closure, MechanismBase::FreeFlyer);
      const Model& model = mechanism.model;
      const VectorXd& q = mechanism.q_closed;
      const VectorXd v = randomVector(rng, model.nv()), a = randomVector(rng, model.nv()),
                     tau = randomVector(rng, model.nv(), 10);
      Workspace ws(model), other(model);
      const VectorXd inverse = calcInverseDynamics(model, ws, q, v, a);
      updateInverseDynamicsDerivatives(model, ws, {});
      checkDerivative(ws.dID_dq, differentiateTangent(model, q, kDynamicsStep, [&](const VectorXd& x) {
                        return calcInverseDynamics(model, other, x, v, a);
                      }));
      checkDerivative(ws.dID_dv, differentiate(v, kDynamicsStep, [&](const VectorXd& x) {
                        return calcInverseDynamics(model, other, q, x, a);
                      }));
      updateMassMatrix(model, ws);
      updateBias(model, ws);
      CHECK(calcRelativeError(ws.M * a + ws.b, inverse) < 1e-12);

      const ConstraintSet set = makeConstraintSet(model);
      ConstrainedWorkspace cws, ocws;
      REQUIRE(updateConstrainedDynamics(model, ws, cws, set, q, v, tau) == NumericalStatus::Ok);
      REQUIRE(updateConstrainedDerivatives(model, ws, cws, set) == NumericalStatus::Ok);
      const auto solve = [&](const VectorXd& x, const VectorXd& y) {
        REQUIRE(updateConstrainedDynamics(model, other, ocws, set, x, y, tau) == NumericalStatus::Ok);
        return ocws.a;
      };
      checkDerivative(cws.da_dq,
                      differentiateTangent(model, q, kDynamicsStep, [&](const VectorXd& x) { return solve(x, v); }));
      checkDerivative(cws.da_dv, differentiate(v, kDynamicsStep, [&](const VectorXd& x) { return solve(q, x); }));

      // Along a change of the motion, the change of inverse dynamics is that of its derivatives.
      calcInverseDynamics(model, ws, q, v, a);
      updateInverseDynamicsDerivatives(model, ws, {});
      updateMassMatrix(model, ws);
      MotionVariation motion(model);
      for (VectorXd* x : {&motion.q, &motion.v, &motion.a}) *x = randomVector(rng, model.nv());
      VariationWorkspace variation(model);
      const ModelVariation none(model);
      updateVariation(model, ws, none, motion, variation);
      checkDerivative(calcInverseDynamicsVariation(model, ws, set, VectorXd::Zero(set.rows), none, motion, variation),
                      ws.dID_dq * motion.q + ws.dID_dv * motion.v + ws.M * motion.a);
    }
}

TEST_CASE("joint forces: the energy falls by what dampers and friction take") {
  std::mt19937 rng(42);
  const Mechanism mechanism =
      makeSprungMechanism(rng, JointKind::Prismatic, ClosureKind::Hinge5D, MechanismBase::FreeFlyer);
  const Model& model = mechanism.model;
  const ConstraintSet set = makeConstraintSet(model);
  Workspace ws(model);
  ConstrainedWorkspace cws;
  const VectorXd& q = mechanism.q_closed;
  const VectorXd v = projectVelocity(model, ws, set, q, randomVector(rng, model.nv()));
  REQUIRE(updateConstrainedDynamics(model, ws, cws, set, q, v, VectorXd::Zero(model.nv())) == NumericalStatus::Ok);
  const VectorXd a = cws.a;
  const auto energy = [&](const VectorXd& t) {
    updatePositions(model, ws, model.integrate(q, t[0] * (v + 0.5 * t[0] * a)));
    updateVelocities(model, ws, v + t[0] * a);
    return VectorXd::Constant(1, calcKineticEnergy(model, ws) + calcPotentialEnergy(model, ws)).eval();
  };
  double power = 0;
  for (const JointForce& force : model.jointForces()) {
    const double rate = v[force.dof];
    power -= rate * (force.damping * rate + force.friction * rate / std::hypot(rate, force.friction_speed));
  }
  REQUIRE(!model.pointSprings().empty());
  for (const PointSpring& spring : model.pointSprings()) {
    const auto length = [&](const VectorXd& t) {
      updatePositions(model, ws, model.integrate(q, t[0] * v));
      const Vector3d line = ws.X_WB[spring.body2].act(spring.point2) - ws.X_WB[spring.body1].act(spring.point1);
      return VectorXd::Constant(1, line.norm()).eval();
    };
    const double rate = differentiate(VectorXd::Zero(1), 1e-3, length)(0, 0);
    REQUIRE(spring.damping * rate * rate > 1e-3);
    power -= spring.damping * rate * rate;
  }
  REQUIRE(power < -0.1);
  CHECK(differentiate(VectorXd::Zero(1), 1e-3, energy)(0, 0) == Approx(power).epsilon(1e-7));
}

TEST_CASE(
    "joint forces: friction near rest decays as fast as its damper on the inertia, and steps follow the speeds that "
    "are found") {
  // Two slides in line, one on the other.
  const auto make = [](const std::vector<double>& speeds) {
    ModelBuilder builder("slides");
    Joint slide = makeSlide();
    builder.addLink("first", "world", slide, {2, Vector3d::Zero(), 0.1 * Matrix3d::Identity()});
    slide.name = "other";
    builder.addLink("second", "first", slide, {0.5, Vector3d::Zero(), 0.1 * Matrix3d::Identity()});
    JointForce force;
    force.damping = 4, force.friction = 5, force.friction_speed = speeds[0];
    builder.addJointForce("slide", force);
    force.damping = 0.1, force.friction = 3, force.friction_speed = speeds[1];
    builder.addJointForce("other", force);
    builder.setGravity(Vector3d::Zero());
    return builder.build();
  };
  const Eigen::Matrix2d M = (Eigen::Matrix2d() << 2.5, 0.5, 0.5, 0.5).finished();
  const auto calcRate = [&](double d1, double d2) {
    const Eigen::Matrix2d D = Eigen::Vector2d(d1, d2).asDiagonal();
    return Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::Matrix2d>(D, M).eigenvalues().maxCoeff();
  };
  constexpr double h = 0.02;
  const std::vector<double> given = {0.02, 0.01};
  const Model model = make(given);
  const SmoothFriction found = calcSmoothFriction(model, makeConstraintSet(model), VectorXd::Zero(2), h);
  CHECK(found.rate == Approx(calcRate(4 + 5 / given[0], 0.1 + 3 / given[1])));
  CHECK(found.damped == Approx(calcRate(4, 0.1)));
  CHECK(model.joints()[found.joint].name == "slide");
  REQUIRE(found.raised.size() == 2);
  const std::vector<double> speeds = {found.raised[0].friction_speed, found.raised[1].friction_speed};
  CHECK(calcRate(5 / speeds[0], 3 / speeds[1]) * h <= 1);
  CHECK(calcRate(5 / speeds[0], 3 / speeds[1]) * h > 0.6);  // no larger than need be
  const Model smooth = make(speeds);
  CHECK(calcSmoothFriction(smooth, makeConstraintSet(smooth), VectorXd::Zero(2), h).raised.empty());
  // Midpoint steps from next to rest: they come to rest, or never do.
  const auto calcSpeed = [&](const Model& slides) {
    Workspace ws(slides);
    const auto calcAcceleration = [&](const VectorXd& v) {
      return VectorXd(-M.inverse() * calcInverseDynamics(slides, ws, VectorXd::Zero(2), v, VectorXd::Zero(2)));
    };
    VectorXd v = Eigen::Vector2d(1e-4, -1e-4);
    for (int i = 0; i < 100; ++i) v += h * calcAcceleration(v + 0.5 * h * calcAcceleration(v));
    return v.norm();
  };
  CHECK(calcSpeed(smooth) < 1e-8);
  CHECK(calcSpeed(model) > 1e-3);
}
