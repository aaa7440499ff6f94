// Everything that a model can hold, in every world: it moves the robot as in the others, or the world says what it leaves out.
// docs/execution.md has the same table.
#include <catch2/catch.hpp>
#include <functional>
#include <memory>
#include <string>

#include "bielle/model/builder.h"
#include "bielle/worlds/bielle_world.h"
#include "mechanisms.h"
#include "model/stiction.h"
#include "selection.h"
#ifdef BIELLE_WITH_MUJOCO
#include "worlds/mujoco_world.h"
#endif
#include "worlds/simbody_world.h"

namespace bielle::worlds {
namespace {

// A world with steps so fine that it differs from the others by less than what is told apart here.
struct FineWorld {
  std::string name;
  std::function<std::unique_ptr<World>(const Model& model, const Ground& ground)> make;
};

const std::vector<FineWorld>& listFineWorlds() {
  static const std::vector<FineWorld> worlds = {
      {"manifold",
       [](const Model& model, const Ground& ground) {
         ManifoldWorldOptions options;
         options.world.ground = ground;
         return makeManifoldWorld(model, options);
       }},
      {"bielle",
       [](const Model& model, const Ground& ground) {
         BielleWorldOptions options;
         options.world.ground = ground;
         options.world.time_step = 1e-4;
         return makeBielleWorld(model, options);
       }},
      {"simbody",
       [](const Model& model, const Ground& ground) {
         SimbodyWorldOptions options;
         options.world.ground = ground;
         options.accuracy = 1e-7;
         return makeSimbodyWorld(model, options);
       }},
#ifdef BIELLE_WITH_MUJOCO
      {"mujoco",
       [](const Model& model, const Ground& ground) {
         MujocoWorldOptions options;
         options.world.ground = ground;
         options.world.time_step = 2.5e-5;
         options.robot.closure_time = 5e-5;
         return makeMujocoWorld(model, options);
       }},
#endif
  };
  return worlds;
}

// A mechanism with a property and one without it, from the same state.
struct Property {
  std::string name;
  Model with, without;
  VectorXd q, v;
  double torque = 0;                 // of all motors, N m
  std::string warns{};               // the worlds that say that they leave it out
  Vector3d push = Vector3d::Zero();  // on the first body of the one with it
  double duration = 0.2;             // s
  std::string refuses{};             // the worlds that refuse it
};

constexpr double kPeriod = 1e-3;  // s

VectorXd move(World& world, const Property& property, bool is_pushed) {
  world.reset(property.q, property.v);
  if (is_pushed) world.setPush(property.push);
  for (int i = 0; i < std::lround(property.duration / kPeriod); ++i) {
    world.setTorques(VectorXd::Constant(world.model().nu(), property.torque));
    CAPTURE(world.message());
    REQUIRE(world.advance(kPeriod));
  }
  return world.configuration();
}

Joint makeJoint(const std::string& name, JointKind kind, const Vector3d& axis = Vector3d::UnitY(), double height = 0) {
  Joint joint;
  joint.name = name;
  joint.kind = kind;
  joint.axis = axis;
  joint.axis2 = Vector3d(axis.z(), 0.3, axis.y());  // not normal to the first
  joint.X_PJ.p.z() = height;
  return joint;
}

Inertia makeLinkInertia() {
  Inertia inertia;
  inertia.mass = 1;
  inertia.com = Vector3d(0.03, 0.02, -0.2);
  inertia.I_com = Vector3d(0.02, 0.025, 0.01).asDiagonal();
  return inertia;
}

using Add = std::function<void(ModelBuilder&)>;

// Two links that hang from joints about y; the first joint may be of another kind.
Model makeArm(const Add& add, JointKind kind = JointKind::Revolute, const JointLimits& limits = {}) {
  ModelBuilder builder("arm");
  builder.addLink("upper", "world", makeJoint("shoulder", kind), makeLinkInertia(), limits);
  builder.addLink("lower", "upper", makeJoint("elbow", JointKind::Revolute, Vector3d::UnitY(), -0.4),
                  makeLinkInertia());
  if (add) add(builder);
  return builder.build();
}

Property makeOfArm(const std::string& name, const Add& with, const Add& without = {},
                   JointKind kind = JointKind::Revolute) {
  Property property{name, makeArm(with, kind), makeArm(without, kind), {}, {}};
  const Model& model = property.with;
  property.v = VectorXd::LinSpaced(model.nv(), 1, 2);
  property.q = model.integrate(model.makeNeutral(), 0.3 * property.v);
  return property;
}

JointForce makeForce(double stiffness, double rest, double preload, double damping = 0, double friction = 0,
                     double friction_speed = 0.05) {
  JointForce force;
  force.stiffness = stiffness, force.rest = rest, force.preload = preload;
  force.damping = damping, force.friction = friction, force.friction_speed = friction_speed;
  return force;
}

PointSpring makeSpring(double stiffness, double rest, double preload, double damping) {
  PointSpring spring;
  spring.name = "spring";
  spring.point1 = {0.5, 0.1, -0.3}, spring.point2 = {0.05, 0, -0.3};
  spring.stiffness = stiffness, spring.rest = rest, spring.preload = preload, spring.damping = damping;
  return spring;
}

std::vector<Property> listForces() {
  std::vector<Property> out;
  const auto addForce = [&](const std::string& name, const JointForce& with, const JointForce& without = {}) {
    out.push_back(makeOfArm(
        name, [&](ModelBuilder& b) { b.addJointForce("elbow", with); },
        [&](ModelBuilder& b) { b.addJointForce("elbow", without); }));
  };
  addForce("stiffness of a joint", makeForce(20, 0, 0));
  addForce("rest of a joint", makeForce(20, 0.4, 0), makeForce(20, 0, 0));
  addForce("preload of a joint with a spring", makeForce(20, 0.4, 3), makeForce(20, 0.4, 0));
  addForce("preload of a joint without a spring", makeForce(0, 0, 3));
  addForce("preload of a damped joint", makeForce(0, 0, -3, 0.2), makeForce(0, 0, 0, 0.2));
  addForce("damping of a joint", makeForce(0, 0, 0, 0.5));
  addForce("friction of a joint", makeForce(0, 0, 0, 0, 0.5));
  addForce("friction speed of a joint", makeForce(0, 0, 0, 0, 1, 1), makeForce(0, 0, 0, 0, 1, 0.05));
  const auto addSticking = [](ModelBuilder& b) {
    for (const JointForce& force : splitJointForce({makeForce(0, 0, 0, 0.1, 0.2), 0.8, 0.5}))
      b.addJointForce("elbow", force);
  };
  out.push_back(makeOfArm("stiction of a joint", addSticking,
                          [](ModelBuilder& b) { b.addJointForce("elbow", makeForce(0, 0, 0, 0.1, 0.2)); }));
  const auto addSpring = [&](const std::string& name, const PointSpring& with, const PointSpring& without) {
    const auto add = [](const PointSpring& spring) {
      return [&spring](ModelBuilder& b) { b.addPointSpring("world", "lower", spring); };
    };
    out.push_back(makeOfArm(name, add(with), add(without)));
  };
  const PointSpring none = makeSpring(0, 0.3, 0, 0);
  addSpring("stiffness of a point spring", makeSpring(60, 0.3, 0, 0), none);
  addSpring("rest of a point spring", makeSpring(60, 0.5, 0, 0), makeSpring(60, 0.3, 0, 0));
  addSpring("preload of a point spring", makeSpring(60, 0.3, 5, 0), makeSpring(60, 0.3, 0, 0));
  addSpring("preload beyond the length of a point spring", makeSpring(10, 0.3, 8, 0), makeSpring(10, 0.3, 0, 0));
  addSpring("tension of two points", makeSpring(0, 0.3, 8, 0), none);
  addSpring("pressure of two points", makeSpring(0, 0.3, -8, 0), none);
  addSpring("damping of a point spring", makeSpring(0, 0.3, 0, 5), none);
  // What the friction nearly holds creeps; it does not stick.
  out.push_back(makeOfArm("creeping friction", [](ModelBuilder& b) {
    for (const char* joint : {"shoulder", "elbow"}) b.addJointForce(joint, makeForce(0, 0, 0, 0, 6, 0.1));
  }));
  out.back().without = makeArm([](ModelBuilder& b) {
    for (const char* joint : {"shoulder", "elbow"}) b.addJointForce(joint, makeForce(0, 0, 0, 0, 6, 0.02));
  });
  out.back().v.setZero();
  return out;
}

std::vector<Property> listMotors() {
  std::vector<Property> out;
  const auto makeMotor = [](double armature, double effort_limit = 1e3) {
    Motor motor;
    motor.name = "elbow", motor.armature = armature, motor.effort_limit = effort_limit;
    return motor;
  };
  const auto add = [&](const std::string& name, const Motor& with, const Motor& without, double torque) {
    out.push_back(makeOfArm(
        name, [&](ModelBuilder& b) { b.addMotor(with); }, [&](ModelBuilder& b) { b.addMotor(without); }));
    out.back().torque = torque;
  };
  add("armature of a motor", makeMotor(0.05), makeMotor(0), 2);
  add("limit of a motor", makeMotor(0.05, 1), makeMotor(0.05), 4);
  Motor fed = makeMotor(0.05), weak = fed;
  fed.drive.ratio = weak.drive.ratio = 10;
  fed.drive.torque_constant = weak.drive.torque_constant = 0.05;
  fed.drive.resistance = weak.drive.resistance = 1;
  weak.drive.voltage = 6;
  add("voltage of a motor", weak, fed, 6);
  out.push_back(makeOfArm("torque", [&](ModelBuilder& b) { b.addMotor(makeMotor(0)); }));
  out.back().torque = 3;
  for (const JointKind kind : bielle::testing::kJointKinds) {
    out.push_back(makeOfArm(
        std::string("armature of a ") + getName(kind) + " joint without a motor",
        [](ModelBuilder& b) {
          b.setGravity({2, 3, -9});
          b.setArmature("shoulder", 0.5);
        },
        [](ModelBuilder& b) {
          b.setGravity({2, 3, -9});
        },
        kind));
    if (kind == JointKind::Planar || kind == JointKind::FreeFlyer) out.back().warns = "simbody mujoco";
  }
  return out;
}

std::vector<Property> listBodies() {
  std::vector<Property> out;
  out.push_back(makeOfArm("gravity", [](ModelBuilder& b) { b.setGravity({3, 1, -5}); }));
  out.push_back(makeOfArm("inertia", [](ModelBuilder& b) {
    Inertia more = makeLinkInertia();
    more.com = Vector3d(0.1, -0.2, 0.3);
    b.addInertia("lower", more);
  }));
  out.push_back(makeOfArm("push", {}));
  out.back().push = Vector3d(5, 2, -3);
  // A link without mass between two others, about another axis.
  const auto makeCross = [](double turned) {
    return makeArm([turned](ModelBuilder& b) {
      b.addLink("cross", "lower", makeJoint("pitch", JointKind::Revolute, Vector3d::UnitX(), -0.4), Inertia());
      Joint roll = makeJoint("roll", JointKind::Revolute, Vector3d::UnitY());
      roll.axis = Vector3d(std::sin(turned), std::cos(turned), 0);
      b.addLink("hand", "cross", roll, makeLinkInertia());
    });
  };
  Property cross{"link without mass", makeCross(0), makeCross(0.5), {}, {}};
  cross.v = VectorXd::LinSpaced(4, 1, 2), cross.q = 0.3 * cross.v;
  out.push_back(cross);
  return out;
}

// Two arms of two links, whose hands meet at the neutral configuration and are tied there, or are not. The first joint of one is
// of any kind, the others turn about y.
Model makePair(JointKind kind, ClosureKind closure, bool is_tied) {
  ModelBuilder builder("pair");
  const auto add = [&](const std::string& name, JointKind kind, const Vector3d& base, const Vector3d& elbow,
                       const Vector3d& hand) {
    for (const bool is_upper : {true, false}) {
      Inertia inertia = makeLinkInertia();
      inertia.com = 0.5 * (is_upper ? elbow : hand);
      Joint joint = makeJoint(name + (is_upper ? "_shoulder" : "_elbow"), is_upper ? kind : JointKind::Revolute);
      joint.X_PJ.p = is_upper ? base : elbow;
      builder.addLink(name + (is_upper ? "_upper" : "_lower"), is_upper ? "world" : name + "_upper", joint, inertia);
    }
    builder.addFrame(name + "_hand", name + "_lower", {Matrix3d::Identity(), hand});
  };
  add("left", kind, {-0.3, 0, 0}, {-0.1, 0, -0.4}, {0.4, 0, -0.3});
  add("right", JointKind::Revolute, {0.3, 0, 0}, {0.15, 0, -0.35}, {-0.45, 0, -0.35});
  if (is_tied && closure == ClosureKind::Coupler)
    builder.addCoupler("tie", {{"left_elbow", 1}, {"right_elbow", 0.7}});
  else if (is_tied && closure == ClosureKind::Distance)
    builder.addDistance("tie", "left_lower", "right_hand");
  else if (is_tied)
    builder.addClosure("tie", closure, "left_hand", "right_hand", Vector3d::UnitY());
  return builder.build();
}

// Loops of each kind, and with each kind of joint.
std::vector<Property> listLoops() {
  std::vector<Property> out;
  const auto add = [&](JointKind joint, ClosureKind closure) {
    Property property{std::string(getName(joint)) + " joint and " + getName(closure) + " closure",
                      makePair(joint, closure, true),
                      makePair(joint, closure, false),
                      {},
                      {}};
    property.q = property.with.makeNeutral();
    property.v = VectorXd::Zero(property.with.nv());
    if (closure == ClosureKind::Slider) property.refuses = "mujoco";
    out.push_back(property);
  };
  bielle::testing::Selection selection;
  for (const JointKind joint : bielle::testing::kJointKinds)
    for (const ClosureKind closure : bielle::testing::kClosureKinds)
      if (!(joint == JointKind::Prismatic && closure == ClosureKind::Weld6D) && !selection.isLeftOut())
        add(joint, closure);  // the one left out cannot move
  // A coupler of three joints.
  const auto makeBelt = [](bool is_coupled) {
    return makeArm([is_coupled](ModelBuilder& b) {
      b.addLink("hand", "lower", makeJoint("wrist", JointKind::Revolute, Vector3d::UnitY(), -0.4), makeLinkInertia());
      if (is_coupled) b.addCoupler("belt", {{"shoulder", 1}, {"elbow", -0.5}, {"wrist", 2}}, 0.1);
    });
  };
  Property belt{"coupler of three joints", makeBelt(true), makeBelt(false), {}, VectorXd::Zero(3)};
  belt.q = Vector3d(0.2, 0.6, 0.1);
  out.push_back(belt);
  return out;
}

double calcDistance(const Model& model, const VectorXd& a, const VectorXd& b) {
  return model.difference(a, b).cwiseAbs().maxCoeff();
}

void checkInAllWorlds(const std::vector<Property>& properties) {
  constexpr double kTolerance = 0.02;  // of what the property changes, which would be 1 if it were left out
  for (const Property& property : properties) {
    const FineWorld& first = listFineWorlds().front();
    const VectorXd expected = move(*first.make(property.with, {}), property, true);
    const double effect =
        calcDistance(property.with, expected, move(*first.make(property.without, {}), property, false));
    CAPTURE(property.name, effect);
    CHECK(effect > 2e-3);
    for (const FineWorld& fine : listFineWorlds()) {
      if (property.refuses == fine.name) {
        CHECK_THROWS_AS(fine.make(property.with, {}), InputError);
        continue;
      }
      const auto world = fine.make(property.with, {});
      const double error = calcDistance(property.with, expected, move(*world, property, true));
      CAPTURE(fine.name, error);
      if (property.warns.find(fine.name) == std::string::npos) {
        CHECK(error < kTolerance * effect);
        CHECK(world->warnings().empty());
      } else {
        CHECK(error > 1e-3 * effect);  // nothing is told that is not so
        REQUIRE(world->warnings().size() == 1);
        CHECK_THAT(world->warnings()[0], Catch::Contains("joint 'shoulder': its armature of 0.5 kg"));
      }
    }
  }
}

}  // namespace

TEST_CASE("world properties: springs, dampers and friction are the same in all worlds") {
  checkInAllWorlds(listForces());
}

TEST_CASE("world properties: motors and armatures are the same in all worlds, or told") {
  checkInAllWorlds(listMotors());
}

TEST_CASE("world properties: gravity, inertia and pushes are the same in all worlds") {
  checkInAllWorlds(listBodies());
}

TEST_CASE("world properties: joints and closures are the same in all worlds, or refused", "[sweep]") {
  checkInAllWorlds(listLoops());
}

TEST_CASE("world properties: what limits only plans moves no world") {
  const auto makeWith = [](double limit, double gain, double efficiency) {
    Motor motor;
    motor.name = "elbow", motor.velocity_limit = limit, motor.continuous_effort = limit;
    motor.drive.efficiency = motor.drive.back_efficiency = efficiency;
    return makeArm([&](ModelBuilder& b) {
      b.addMotor(motor);
      b.addCoupler("belt", {{"shoulder", 1}, {"elbow", -1}}, 0, gain, gain);
    });
  };
  Property property{
      "", makeWith(0.1, 40, 0.5), makeWith(1e3, 0, 1), VectorXd::Constant(2, 0.3), VectorXd::Constant(2, 1), 2};
  for (const FineWorld& fine : listFineWorlds()) {
    CAPTURE(fine.name);
    const auto with = fine.make(property.with, {}), without = fine.make(property.without, {});
    CHECK(move(*with, property, false) == move(*without, property, false));
    CHECK(with->velocity().cwiseAbs().minCoeff() > 0.3);
  }
}

TEST_CASE("world properties: limits are stops, with gravity or without, or told") {
  for (const double gravity : {0.0, -9.81})
    for (const JointKind kind : bielle::testing::kJointKinds) {
      const int nv = getNv(kind);
      JointLimits limits;
      limits.upper = VectorXd::Constant(nv, 0.1), limits.lower = VectorXd::Constant(nv, -0.1);
      const auto add = [&](ModelBuilder& b) { b.setGravity({0, 0, gravity}); };
      const Model model = makeArm(add, kind, limits);
      Property property{getName(kind), model, model, model.makeNeutral(), VectorXd::Zero(model.nv())};
      property.v.head(nv).setConstant(1.5);
      for (const FineWorld& fine : listFineWorlds()) {
        const auto world = fine.make(model, {});
        const VectorXd end = move(*world, property, false);
        const double farthest = model.difference(model.makeNeutral(), end).head(nv).cwiseAbs().maxCoeff();
        CAPTURE(gravity, property.name, fine.name, farthest);
        const bool has_stops =
            nv == 1 || kind == JointKind::Universal || (kind == JointKind::Planar && fine.name == "mujoco");
        CHECK((farthest < 0.14) == has_stops);
        CHECK(world->warnings().size() == (has_stops ? 0u : static_cast<size_t>(nv)));
        for (const std::string& warning : world->warnings())
          CHECK_THAT(warning, Catch::Contains("joint 'shoulder': nothing stops its coordinate"));
      }
    }
}

TEST_CASE("world properties: every kind of contact carries a robot on every ground, and slides by its friction") {
  const auto makeBlock = [](ContactKind kind) {
    ModelBuilder builder("block");
    Inertia half;
    half.mass = 1;
    half.I_com = 0.01 * Matrix3d::Identity();
    builder.addLink("carriage", "world", makeJoint("along", JointKind::Prismatic, Vector3d::UnitX()), half);
    builder.addLink("block", "carriage", makeJoint("up", JointKind::Prismatic, Vector3d::UnitZ()), half);
    const double length = kind == ContactKind::Point3D ? 0 : 0.1, width = kind == ContactKind::Surface6D ? 0.05 : 0;
    builder.addContact("sole", "block", kind, length, width);
    return builder.build();
  };
  for (const ContactKind kind : {ContactKind::Point3D, ContactKind::Edge5D, ContactKind::Surface6D})
    for (const bool has_step : {false, true}) {
      Ground ground;
      ground.height = -0.02;
      ground.friction = 0.4;
      if (has_step) ground.steps.push_back({{0.2, 0, 0.05}, 2, 1, 0, 0, 0});
      const double height = has_step ? 0.05 : -0.02;
      // The mass of both slides; the weight of the block alone presses.
      const double decay = 0.4 * 9.81 / 2, distance = 0.5 / decay * 0.5 / 2;
      for (const FineWorld& fine : listFineWorlds()) {
        if (fine.name == "manifold")
          continue;  // each slip costs it many short steps; it has the contact law of the next
        const auto world = fine.make(makeBlock(kind), ground);
        world->reset(Eigen::Vector2d(0, height), Eigen::Vector2d(0.5, 0));
        REQUIRE(world->advance(0.4));
        const VectorXd& q = world->configuration();
        CAPTURE(getName(kind), has_step, fine.name, q.transpose(), distance);
        CHECK(q[1] == Approx(height).margin(5e-4));
        CHECK(q[0] == Approx(distance).epsilon(0.02));
        CHECK(world->feet()[0].touches);
      }
    }
}

}  // namespace bielle::worlds
