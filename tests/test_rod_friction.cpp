// Friction of rod ends, which grows with the force through them. Oracles in closed form: a pendulum in a ball, a crank
// that pulls a loaded rocker by a rod; and the forces of the constrained dynamics.
#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/constrained.h"
#include "bielle/model/builder.h"
#include "bielle/motion/motion.h"
#include "bielle/worlds/batch.h"
#include "check_derivative.h"
#include "dynamics/rod_friction.h"
#include "get_error.h"
#include "own_robots.h"
#include "worlds/leapfrog.h"
#include "worlds/make_world.h"

namespace bielle::worlds {
namespace {

using bielle::testing::checkDerivative;
using bielle::testing::getError;
using bielle::testing::loadOwn;

constexpr double kEarth = 9.81;

RodFriction makeRodFriction(const std::string& closure, double coefficient, double radius,
                            const std::vector<std::string>& joints = {}) {
  RodFriction friction;
  friction.closure = closure;
  friction.coefficient = coefficient;
  friction.radius = radius;
  friction.joints = joints;
  return friction;
}

// A body on a ball at the origin of the world: a free one, and a closure.
constexpr double kHungMass = 2, kHang = 0.5, kOwnInertia = 1e-4;
Model makeHungBody() {
  ModelBuilder builder("pendulum");
  builder.setGravity({0, 0, -kEarth});
  Joint free;
  free.name = "free";
  free.kind = JointKind::FreeFlyer;
  builder.addLink("bob", "world", free, {kHungMass, {0, 0, -kHang}, kOwnInertia * Matrix3d::Identity()});
  builder.addClosure("ball", ClosureKind::Ball3D, "world", "bob");
  return builder.build();
}

// \param angle  about y
VectorXd makeHanging(const Model& model, double angle) {
  VectorXd q = model.makeNeutral();
  q[4] = std::sin(angle / 2), q[6] = std::cos(angle / 2);
  return q;
}

// Crank and rocker of one length, joined by a rod as long as their distance; turned as a whole, so that no row of the
// ball lies in the plane of the linkage.
constexpr double kCrank = 0.1, kDistance = 0.3;
Model makeParallelogram() {
  ModelBuilder builder("parallelogram");
  builder.setGravity(Vector3d::Zero());
  const Matrix3d tilt = Eigen::AngleAxisd(0.7, Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  const auto makeHinge = [](const char* name, const Matrix3d& R, const Vector3d& p) {
    Joint joint;
    joint.name = name;
    joint.kind = JointKind::Revolute;
    joint.axis = Vector3d::UnitY();
    joint.X_PJ = {R, p};
    return joint;
  };
  const Inertia arm{0.1, {0, 0, kCrank / 2}, 1e-4 * Matrix3d::Identity()};
  builder.addLink("crank", "world", makeHinge("crank", tilt, Vector3d::Zero()), arm);
  builder.addLink("rod", "crank", makeHinge("pin", Matrix3d::Identity(), {0, 0, kCrank}),
                  {0.01, {kDistance / 2, 0, 0}, 1e-5 * Matrix3d::Identity()});
  builder.addLink("rocker", "world", makeHinge("rocker", tilt, tilt * Vector3d(kDistance, 0, 0)), arm);
  builder.addFrame("rod_end", "rod", SE3(Matrix3d::Identity(), {kDistance, 0, 0}));
  builder.addFrame("rocker_end", "rocker", SE3(Matrix3d::Identity(), {0, 0, kCrank}));
  builder.addClosure("ball", ClosureKind::Ball3D, "rod_end", "rocker_end");
  builder.addMotor("crank", 1e-3);
  builder.addMotor("rocker", 1e-3);
  return builder.build();
}

double getAngle(const World& world) { return 2 * std::atan2(world.configuration()[4], world.configuration()[6]); }

}  // namespace

TEST_CASE("rod friction: its resistance is the derivative of its torque") {
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  for (const double stiction : {0.0, 0.3}) {
    RodFriction law = makeRodFriction("any", 0.2, 0.01);
    law.stiction = stiction;
    law.friction_speed = 0.05;
    for (const double size : {0.01, 0.1, 2.0}) {
      const Vector3d w = size * Vector3d(normal(random), normal(random), normal(random));
      constexpr double kForce = 300;
      Matrix3d numeric;
      for (int k = 0; k < 3; ++k) {
        const Vector3d step = 1e-6 * Vector3d::Unit(k);
        numeric.col(k) = -(calcRodTorque<double>(law, kForce, w + step).torque -
                           calcRodTorque<double>(law, kForce, w - step).torque) /
                         2e-6;
      }
      const RodTorqueOf<double> at = calcRodTorque<double>(law, kForce, w);
      checkDerivative(at.slope * Matrix3d::Identity() - at.fall * w * w.transpose(), numeric);
    }
    // Far above both speeds it is that of sliding.
    const Vector3d fast(0, 400, 300);
    CHECK(calcRodTorque<double>(law, 10, fast).torque.isApprox(-0.2 * 0.01 * 10 * fast.normalized(), 1e-6));
  }
}

TEST_CASE("rod friction: a pendulum in a ball loses 2 mu r / L per swing") {
  // Energies m g L A^2 / 2 and F = m g, up to A^2.
  constexpr double kCoefficient = 0.2, kRadius = 0.01, kStart = 0.1;
  const Model model = makeHungBody();
  RodFriction friction = makeRodFriction("ball", kCoefficient, kRadius);
  friction.friction_speed = 1e-4;
  WorldOptions options;
  options.wear.frictions = {friction};
  const auto world = makeWorld("bielle", model, options);
  world->reset(makeHanging(model, kStart), VectorXd::Zero(model.nv()));
  const double energy = world->books().energy();
  std::vector<double> turns = {kStart};
  double before = kStart, now = kStart;
  while (turns.size() < 9) {
    REQUIRE(world->advance(1e-3));
    REQUIRE(world->time() < 20);
    const double next = getAngle(*world);
    if (std::abs(now) >= std::abs(before) && std::abs(now) > std::abs(next) && world->time() > 0.1)
      turns.push_back(std::abs(now));
    before = now, now = next;
  }
  for (size_t i = 1; i < turns.size(); ++i) {
    CAPTURE(i);
    CHECK(turns[i - 1] - turns[i] == Approx(2 * kCoefficient * kRadius / kHang).epsilon(0.01));
  }
  const Books books = world->books();
  CHECK(books.other_loss == Approx(energy - books.energy()).epsilon(1e-3));
  CHECK(books.other_loss > 0.1 * kHungMass * kEarth * kHang * kStart * kStart / 2);
}

TEST_CASE("rod friction: a conical pendulum loses mu r F w sin c") {
  // At the cone angle c it goes about the vertical at w^2 = g / (L cos c), under F = m g / cos c; without a spin about
  // its own line it turns in the ball at w sin c.
  constexpr double kCoefficient = 0.02, kRadius = 0.005, kCone = 0.6, kDuration = 0.5;
  const Model model = makeHungBody();
  WorldOptions options;
  options.wear.frictions = {makeRodFriction("ball", kCoefficient, kRadius)};
  options.tolerance = GENERATE(0.0, 1e-8);
  const auto world = makeWorld("bielle", model, options);
  const double rate = std::sqrt(kEarth / (kHang * std::cos(kCone)));
  VectorXd v = VectorXd::Zero(model.nv());
  const VectorXd q = makeHanging(model, kCone);
  const Matrix3d R = Eigen::AngleAxisd(kCone, Vector3d::UnitY()).toRotationMatrix();
  v.segment<3>(3) = R.transpose() * (rate * (Vector3d::UnitZ() - std::cos(kCone) * R.col(2)));
  world->reset(q, v);
  REQUIRE(world->advance(kDuration));
  const double power = kCoefficient * kRadius * kHungMass * kEarth / std::cos(kCone) * rate * std::sin(kCone);
  CHECK(world->books().other_loss == Approx(power * kDuration).epsilon(0.01));
}

TEST_CASE("rod friction: a crank lifts a load when its torque exceeds that of statics") {
  // At right angles to the rod: F = T / (a - mu r) at the rocker under a load T, and F (a + mu r) at the crank.
  constexpr double kCoefficient = 0.15, kRadius = 0.02, kLoad = 3;
  const Model model = makeParallelogram();
  RodFriction friction = makeRodFriction("ball", kCoefficient, kRadius, {"pin"});
  friction.friction_speed = 1e-3;
  WorldOptions options;
  options.wear.frictions = {friction};
  options.tolerance = GENERATE(0.0, 1e-7);
  const auto world = makeWorld("bielle", model, options);
  const double arm = kCoefficient * kRadius;
  const auto calcSpeed = [&](double torque) {
    world->reset(model.makeNeutral(), VectorXd::Zero(model.nv()));
    world->setTorques(Eigen::Vector2d(torque, -kLoad));
    REQUIRE(world->advance(0.05));
    return world->velocity()[0];
  };
  const double up = kLoad * (kCrank + arm) / (kCrank - arm), down = kLoad * (kCrank - arm) / (kCrank + arm);
  CHECK(up > 1.05 * kLoad);
  CHECK(std::abs(calcSpeed(0.995 * up)) < 0.01);
  CHECK(std::abs(calcSpeed(1.005 * down)) < 0.01);
  CHECK(calcSpeed(1.02 * up) > 0.3);
  CHECK(calcSpeed(0.98 * down) < -0.3);
}

TEST_CASE("rod friction: its forces are those of the constrained dynamics, of least norm where rows are redundant") {
  struct Case {
    Model model;
    std::vector<RodFriction> frictions;
  };
  std::vector<Case> cases = {{makeParallelogram(), {makeRodFriction("ball", 1e-9, 0.01)}}};
  cases.push_back({loadOwn("fourbar").model, {makeRodFriction("coupler", 1e-9, 0.01, {"crank_coupler"})}});
  cases.push_back({loadOwn("bipetto").model, {}});
  for (const Closure& closure : cases.back().model.closures()) {
    const Joint& joint = cases.back().model.joints()[closure.body1];
    cases.back().frictions.push_back(makeRodFriction(closure.name, 1e-9, 0.01, {joint.name}));
  }
  for (const Case& c : cases) {
    CAPTURE(c.model.name());
    const Model& model = c.model;
    WorldOptions options;
    options.ground.height = -100;
    options.wear.frictions = c.frictions;
    LeapfrogOf<double> steps(model, options, {});
    const VectorXd q = findClosedConfiguration(model).q;
    REQUIRE(steps.start(q, VectorXd::Zero(model.nv()), true));
    VectorXd u(model.nu());
    for (int m = 0; m < model.nu(); ++m) u[m] = m % 2 ? -1 : 2;
    steps.command(u, Vector3d::Zero());
    LeapfrogOf<double>::Courses courses;
    courses[0].steps = 1;
    constexpr double kStep = 1e-6;
    steps.advance(kStep, true, nullptr, courses);
    REQUIRE(courses[0].message.empty());
    Workspace ws(model);
    ConstrainedWorkspace work;
    const VectorXd tau = calcMotorForces(model, u);
    const ConstraintSet set = makeConstraintSet(model);
    REQUIRE(updateConstrainedDynamics(model, ws, work, set, q, VectorXd::Zero(model.nv()), tau) == NumericalStatus::Ok);
    for (size_t i = 0; i < c.frictions.size(); ++i) {
      const auto bearing = makeRodBearings(model, {c.frictions[i]});
      const double force = work.lambda.segment<3>(set.offsets[bearing[0].closure]).norm();
      CHECK(force > 0.01);
      CHECK(steps.moment().rod_forces[static_cast<Eigen::Index>(i)] == Approx(force).epsilon(1e-4));
    }
  }
}

TEST_CASE("rod friction: worlds of a batch have it as single ones do") {
  const Model model = loadOwn("bipetto").model;
  BielleWorldOptions single;
  for (const Closure& closure : model.closures())
    single.world.wear.frictions.push_back(
        makeRodFriction(closure.name, 0.2, 0.01, {model.joints()[closure.body1].name}));
  for (RodFriction& friction : single.world.wear.frictions) friction.stiction = 0.3;
  WorldBatch batch(model, 3, {single, 1});
  const auto world = makeBielleWorld(model, single), smooth = makeBielleWorld(model);
  const VectorXd q = makeStandingPosture(model), v = VectorXd::Zero(model.nv()), u = VectorXd::Zero(model.nu());
  batch.reset(q.replicate(1, 3), v.replicate(1, 3));
  for (World* each : {world.get(), smooth.get()}) each->reset(q, v);
  const MatrixXd push = Vector3d(10, 20, 0).replicate(1, 3);
  for (int k = 0; k < 20; ++k) {
    REQUIRE(batch.step(u.replicate(1, 3), push, 1e-3));
    for (World* each : {world.get(), smooth.get()}) {
      each->setPush(push.col(0));
      REQUIRE(each->advance(1e-3));
    }
  }
  for (int i = 0; i < 3; ++i) CHECK((batch.velocities().col(i) - world->velocity()).cwiseAbs().maxCoeff() < 1e-6);
  CHECK((smooth->velocity() - world->velocity()).cwiseAbs().maxCoeff() > 1e-3);
  CHECK(world->books().other_loss > 0);
}

TEST_CASE("rod friction: other worlds say that they leave it out") {
  const Model model = makeHungBody();
  WorldOptions options;
  options.wear.frictions = {makeRodFriction("ball", 0.2, 0.01)};
  for (const std::string& name : listWorlds()) {
    CAPTURE(name);
    const auto warnings = makeWorld(name, model, options)->warnings();
    const bool tells = std::any_of(warnings.begin(), warnings.end(), [](const std::string& warning) {
      return warning.find("closure 'ball': the friction of its rod's ends is left out") != std::string::npos;
    });
    CHECK(tells == (name != "bielle"));
  }
  options.tolerance = 1e-6;
  CHECK(makeWorld("bielle", model, options)->warnings().empty());
}

TEST_CASE("rod friction: what cannot have it is refused, with a remedy") {
  const Model model = loadOwn("bipetto").model;
  const std::string rod = model.closures()[0].name, joint = model.joints()[model.closures()[0].body1].name;
  const auto check = [&](const RodFriction& friction, const char* problem) {
    CHECK_THAT(getError([&] { makeRodBearings(model, {friction}); }), Catch::Contains(problem));
  };
  check(makeRodFriction("no_such", 0.1, 0.01), "there is no such closure");
  check(makeRodFriction(rod, 0.1, 0.01), "nothing turns in a weld");
  check(makeRodFriction(rod, 0.1, 0.01, {"no_such"}), "there is no joint 'no_such'");
  check(makeRodFriction(rod, 0.1, 0.01, {"hipx_left"}), "is not in its loop");
  check(makeRodFriction(rod, -0.1, 0.01, {joint}), "its coefficient is negative");
  check(makeRodFriction(rod, 0.1, 0, {joint}), "its radius is not positive");
  check(makeRodFriction(rod, std::nan(""), 0.01, {joint}), "a number is not finite");
  RodFriction less = makeRodFriction(rod, 0.1, 0.01, {joint});
  less.stiction = 0.05;
  check(less, "its stiction is less than");
  CHECK_THAT(getError([&] {
               const RodFriction once = makeRodFriction(rod, 0.1, 0.01, {joint});
               makeRodBearings(model, {once, once});
             }),
             Catch::Contains("it is given twice"));
}

}  // namespace bielle::worlds
