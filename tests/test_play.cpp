// Play between stops, and friction that is larger at rest, in every world. Oracles in closed form: a plastic impact, a pendulum in a
// dead band, a four-bar with a longer or a shorter rod, the stick-slip of a block on a spring.
#include <catch2/catch.hpp>
#include <cmath>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/rnea.h"
#include "bielle/model/builder.h"
#include "bielle/model/wear.h"
#include "bielle/motion/motion.h"
#include "bielle/worlds/sensors.h"
#include "get_error.h"
#include "model/stiction.h"
#include "own_robots.h"
#include "worlds/make_world.h"
#include "worlds/robot_errors.h"

namespace bielle::worlds {
namespace {

using bielle::testing::getError;
using bielle::testing::loadOwn;

constexpr double kLength = 0.5, kMass = 2;  // of a pendulum, m, kg
constexpr double kGravity = 981;            // so that it is fast beside what rebounds from the ends, m/s^2

// A pendulum on a motor about y. It hangs down at zero.
Model makePendulum(double armature, double gravity = kGravity) {
  ModelBuilder builder("pendulum");
  builder.setGravity({0, 0, -gravity});
  Joint joint;
  joint.name = "hinge";
  joint.kind = JointKind::Revolute;
  joint.axis = Vector3d::UnitY();
  builder.addLink("bob", "world", joint, {kMass, {0, 0, -kLength}, Matrix3d::Zero()});
  builder.addMotor("hinge", armature);
  return builder.build();
}

WorldOptions withPlay(const Play& play) {
  WorldOptions options;
  options.wear.plays = {play};
  return options;
}

constexpr double kInertia = kMass * kLength * kLength;

// Instants at which a coordinate passes zero upwards, interpolated.
std::vector<double> findPasses(World& world, double duration, double period, double* largest = nullptr) {
  std::vector<double> passes;
  double before = world.configuration()[0];
  while (world.time() < duration) {
    REQUIRE(world.advance(period));
    const double now = world.configuration()[0];
    if (before < 0 && now >= 0) passes.push_back(world.time() - period * now / (now - before));
    if (largest) *largest = std::max(*largest, std::abs(now));
    before = now;
  }
  return passes;
}

// Of a pendulum that swings by this angle: 4 K(sin(angle / 2)) sqrt(L / g), by the arithmetic-geometric mean.
double calcPeriod(double angle) {
  double a = 1, b = std::cos(angle / 2);
  for (int i = 0; i < 6; ++i) std::tie(a, b) = std::pair((a + b) / 2, std::sqrt(a * b));
  return 2 * M_PI * std::sqrt(kLength / kGravity) / a;
}

}  // namespace

TEST_CASE("play: a rotor crosses its play, and takes the link along as after a plastic impact") {
  constexpr double kRotor = 0.2, kTorque = 2, kPlay = 0.02, kDuration = 0.2;
  // It hits when torque t^2 / (2 J) = play / 2.
  const double hit = std::sqrt(kTorque * kPlay / kRotor),
               lost = 0.5 * kRotor * kInertia / (kRotor + kInertia) * hit * hit;
  for (const std::string& name : listWorlds()) {
    CAPTURE(name);
    const auto world = makeWorld(name, makePendulum(kRotor, 0), withPlay({"hinge", kPlay}));
    world->reset(VectorXd::Zero(1), VectorXd::Zero(1));
    world->setTorques(VectorXd::Constant(1, kTorque));
    const bool crosses = world->advance(0.95 * kRotor * hit / kTorque);
    CAPTURE(world->message());
    REQUIRE(crosses);
    CHECK(std::abs(world->configuration()[0]) < 0.51 * kPlay);  // the link, which nothing moves yet
    CHECK(world->books().stop_loss == Approx(0).margin(1e-9));
    REQUIRE(world->advance(kDuration - world->time()));
    CHECK(world->velocity()[0] == Approx(kTorque * kDuration / (kRotor + kInertia)).epsilon(0.01));
    const Books books = world->books();
    CHECK(books.stop_loss == Approx(lost).epsilon(0.05));
    CHECK(books.energy() == Approx(books.motor_work - books.stop_loss - books.other_loss).epsilon(5e-3));
  }
}

TEST_CASE("play: a pendulum swings freely in a dead band, and its ends take what is more") {
  // The motor's rotor is so heavy that it stands.
  constexpr double kBand = 0.048, kHeavy = 1e5;
  for (const std::string& name : listWorlds()) {
    CAPTURE(name);
    WorldOptions options = withPlay({"hinge", kBand});
    options.time_step = name == "bielle" ? 5e-5 : name == "mujoco" ? 1e-5 : 0;
    if (name == "simbody") options.tolerance = 1e-6;
    const auto world = makeWorld(name, makePendulum(kHeavy), options);
    const auto swing = [&](double speed, double& largest) {
      world->reset(VectorXd::Zero(1), VectorXd::Constant(1, 0));
      world->setPush({speed * kMass * kLength / 1e-4, 0, 0});
      REQUIRE(world->advance(1e-4));
      world->setPush(Vector3d::Zero());
      const double settled = speed < 0.8 ? 0 : 0.6;
      if (settled > 0) REQUIRE(world->advance(settled));
      largest = 0;
      const std::vector<double> passes = findPasses(*world, settled + 0.6, 2e-4, &largest);
      REQUIRE(passes.size() > 3);
      return (passes.back() - passes.front()) / static_cast<double>(passes.size() - 1);
    };
    double largest = 0;
    const double inside = 0.4 * kBand, rate = std::sqrt(kGravity / kLength);
    const double free = swing(2 * rate * std::sin(inside / 2), largest);
    CHECK(largest == Approx(inside).epsilon(5e-3));
    CHECK(free == Approx(calcPeriod(inside)).epsilon(1e-4));
    // Faster, it comes to rest at an end, and swings from one to the other from then on.
    const double limited = swing(3, largest);
    CHECK(largest == Approx(kBand / 2).epsilon(0.03));
    CHECK(limited == Approx(calcPeriod(kBand / 2)).epsilon(5e-3));
    CHECK(world->books().stop_loss ==
          Approx(0.5 * kInertia * 9 - kMass * kGravity * kLength * (1 - std::cos(kBand / 2))).epsilon(0.05));
  }
}

TEST_CASE("play: a loaded rod is as long as at the end of its play") {
  ModelParts parts = takeParts(loadOwn("fourbar").model);
  for (Motor& motor : parts.motors) motor.armature = parts.armature[motor.dof] = 1e6;  // it stands
  const Model model = ModelBuilder::restore(parts);
  constexpr double kPlay = 2e-3;
  const VectorXd q = makeStandingPosture(model);
  const Closure& weld = model.closures()[0];
  const Vector3d along = (weld.X_B1 * weld.X_B2.inverse()).p.normalized();
  for (const std::string& name : listWorlds()) {
    const auto world = makeWorld(name, model, withPlay({weld.name, kPlay}));
    world->reset(q, VectorXd::Zero(model.nv()));
    REQUIRE(world->advance(1));
    double nearest = 1, farther = 0;
    for (const double sign : {-0.5, 0.5}) {
      ModelParts other = takeParts(model);
      other.closures[0].X_B1.p += sign * kPlay * along;
      const VectorXd end = assembleMachine(model, ModelBuilder::restore(other), q);
      const double distance = (world->configuration() - end).cwiseAbs().maxCoeff();
      nearest = std::min(nearest, distance), farther = std::max(farther, distance);
    }
    CAPTURE(name, nearest, farther);
    CHECK(nearest < 0.06 * farther);
    CHECK(farther > 0.5 * kPlay);
    CHECK(world->gap() < 1e-5);
    CHECK(world->velocity().cwiseAbs().maxCoeff() < 1e-3);
  }
}

TEST_CASE("play: at its middle the robot is the one without, coordinate by coordinate") {
  for (const auto& [name, plays] : {std::pair<const char*, std::vector<Play>>{"bipetto", {{"closure_*", 3e-4}}},
                                    {"bipetto", {{"motor_*", 2e-3}, {"hipx_left", 1e-3}}},
                                    {"fivebar", {{"*", 1e-3}}}}) {
    Model model = loadOwn(name).model;
    ModelParts parts = takeParts(model);
    parts.armature.setConstant(1e-3);  // so that all joints of one coordinate may have play
    for (Motor& motor : parts.motors) motor.armature = 1e-3;
    std::vector<Play> chosen = plays;
    if (std::string(name) == "fivebar") {
      chosen.clear();
      for (const Motor& motor : parts.motors) chosen.push_back({motor.name, 1e-3});
    }
    model = ModelBuilder::restore(parts);
    const Model with = addPlay(model, chosen);
    CHECK(with.nv() > model.nv());
    CHECK(with.mass() == Approx(model.mass()));
    CHECK(with.nu() == model.nu());
    const VectorXd q = findClosedConfiguration(model).q;
    VectorXd q_with = with.makeNeutral();
    std::vector<int> dofs;
    for (int i = 1; i < model.numBodies(); ++i) {
      const Joint &joint = model.joints()[i], &same = with.joints()[with.findJoint(joint.name)];
      q_with.segment(same.idx_q, same.nq) = q.segment(joint.idx_q, joint.nq);
      for (int k = 0; k < joint.nv; ++k) dofs.push_back(same.idx_v + k);
    }
    Workspace ws(model), ws_with(with);
    updatePositions(model, ws, q);
    updatePositions(with, ws_with, q_with);
    updateMassMatrix(model, ws);
    updateMassMatrix(with, ws_with);
    const MatrixXd M = ws_with.M(dofs, dofs);
    CHECK((M - ws.M).cwiseAbs().maxCoeff() < 1e-12 * ws.M.cwiseAbs().maxCoeff());
    CHECK(calcLargestGap(ws_with, makeConstraintSet(with)) < 1e-10);
    for (const Play& play : chosen)
      if (play.name.find('*') == std::string::npos) {
        const int at = with.findJoint(getPlayName(play.name));
        REQUIRE(at > 0);
        const int dof = with.joints()[at].idx_v;
        CHECK(with.upperLimits()[dof] == play.size / 2);
        CHECK(with.lowerLimits()[dof] == -play.size / 2);
        CHECK(with.armature()[dof] == 0);
      }
  }
}

TEST_CASE("play: encoders read the motor, which goes ahead of its link") {
  constexpr double kPlay = 0.02;
  for (const std::string& name : listWorlds()) {
    CAPTURE(name);
    const Model model = makePendulum(0.2, 0);
    const auto world = makeWorld(name, model, withPlay({"hinge", kPlay}));
    Sensors sensors(model, {{}, 0, 1, {}});
    world->reset(VectorXd::Zero(1), VectorXd::Zero(1));
    sensors.reset(*world, 0);
    CHECK(sensors.read(*world).motor_positions[0] == 0);
    world->setTorques(VectorXd::Constant(1, 2));
    REQUIRE(world->advance(0.3));
    CHECK(sensors.read(*world).motor_positions[0] - world->configuration()[0] == Approx(kPlay / 2).epsilon(0.1));
    CHECK(world->motorConfiguration()[0] == sensors.read(*world).motor_positions[0]);
  }
}

TEST_CASE("play: what cannot have it is refused, with a remedy") {
  const Model model = loadOwn("bipetto").model;
  const auto check = [&](const Play& play, const char* problem) {
    CHECK_THAT(getError([&] { addPlay(model, {play}); }), Catch::Contains(problem));
  };
  check({"no_such", 1e-3}, "there is no such joint or closure");
  check({"hipx_left", -1}, "its size is negative");
  check({"hipx_left", std::nan("")}, "its size is negative");
  check({"left_spherical_ankle_1", 1e-3}, "it has 2 coordinates");
  check({"knee_left", 1e-3}, "it has no armature");
  CHECK(addPlay(model, {}).isCopyOf(model));
  CHECK(addPlay(model, {{"hipx_left", 1e-3}, {"*", 0}}).isCopyOf(model));
}

TEST_CASE("play: a block on a spring sticks and slips") {
  // Pulled by a force that grows at a rate r, with D = (stiction - friction) / k and w = sqrt(k / m): it slips from rest for
  // (2 pi - 2 atan(D w k / r)) / w, and stands for 2 D k / r; in this time the force moves its rest by r / k.
  constexpr double kMassOfBlock = 1, kStiffness = 400, kSliding = 2, kRate = 40;
  const double stiction = 5, D = (stiction - kSliding) / kStiffness, w = std::sqrt(kStiffness / kMassOfBlock);
  const double period = (2 * M_PI - 2 * std::atan(D * w * kStiffness / kRate)) / w + 2 * D * kStiffness / kRate;
  const auto makeBlock = [&](double creep, double stribeck) {
    ModelBuilder builder("block");
    Joint slide;
    slide.name = "slide";
    slide.kind = JointKind::Prismatic;
    slide.axis = Vector3d::UnitX();
    builder.addLink("block", "world", slide, {kMassOfBlock, Vector3d::Zero(), 0.1 * Matrix3d::Identity()});
    builder.addMotor("slide");
    WholeJointForce whole;
    whole.force.stiffness = kStiffness;
    whole.force.friction = kSliding, whole.force.friction_speed = creep;
    whole.stiction = stiction, whole.stribeck_speed = stribeck;
    for (const JointForce& force : splitJointForce(whole)) builder.addJointForce("slide", force);
    return builder.build();
  };
  const auto measure = [&](const std::string& name, double creep, double stribeck) {
    constexpr double kPeriod = 2e-4;
    CAPTURE(name, creep, stribeck);
    WorldOptions options;
    options.time_step = name == "bielle" ? 1e-4 : name == "mujoco" ? 1e-5 : 0;
    const auto world = makeWorld(name, makeBlock(creep, stribeck), options);
    world->reset(VectorXd::Zero(1), VectorXd::Zero(1));
    std::vector<double> starts;
    bool slips = false;
    while (starts.size() < 5) {
      world->setTorques(VectorXd::Constant(1, kRate * (world->time() + kPeriod / 2)));
      REQUIRE(world->advance(kPeriod));
      REQUIRE(world->time() < 6 * period);
      const double v = world->velocity()[0];
      if (!slips && v > 0.03) starts.push_back(world->time());
      slips = slips ? v > 0.01 : v > 0.03;
    }
    const Books books = world->books();
    CHECK(books.energy() == Approx(books.motor_work - books.other_loss).epsilon(0.01));
    return (starts[4] - starts[1]) / 3;
  };
  CHECK(measure("bielle", 1e-8, 1e-4) == Approx(period).epsilon(1e-3));
  // Where friction falls over a wider range of speeds, it lets go later.
  const double wide = measure("bielle", 1e-4, 1e-2);
  CHECK(wide > 1.01 * period);
  for (const std::string& name : listWorlds()) CHECK(measure(name, 1e-4, 1e-2) == Approx(wide).epsilon(3e-3));
}

}  // namespace bielle::worlds
