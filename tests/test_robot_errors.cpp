// A machine that differs from the model of its controller.
#include <catch2/catch.hpp>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/formats/reader.h"
#include "bielle/model/error.h"
#include "bielle/motion/motion.h"
#include "own_robots.h"
#include "worlds/robot_errors.h"

namespace bielle::worlds {
using bielle::testing::loadOwn;

TEST_CASE("robot errors: without errors the machine is the model") {
  for (const char* name : {"bipetto", "cleobot"}) {
    const LoadedRobot robot = loadOwn(name);
    const Model& model = robot.model;
    const Model machine = makeMachine(model, {});
    CHECK(machine.mass() == model.mass());
    CHECK(machine.lowerLimits() == model.lowerLimits());
    CHECK(machine.upperLimits() == model.upperLimits());
    CHECK(machine.velocityLimits() == model.velocityLimits());
    CHECK(machine.armature() == model.armature());
    CHECK(machine.serialJoints() == model.serialJoints());
    CHECK(machine.gravity() == model.gravity());
    for (size_t c = 0; c < model.contacts().size(); ++c)
      CHECK(machine.contacts()[c].half_length == model.contacts()[c].half_length);
    for (int m = 0; m < model.nu(); ++m) CHECK(machine.motors()[m].effort_limit == model.motors()[m].effort_limit);
    const VectorXd q = makeStandingPosture(model);
    CHECK(makeStandingPosture(machine) == q);
    CHECK((assembleMachine(model, machine, q) - q).norm() < 1e-9);
  }
}

TEST_CASE("robot errors: masses and rods differ within their bounds, as the seed says") {
  const LoadedRobot robot = loadOwn("bipetto");
  const Model& model = robot.model;
  const Model machine = makeMachine(model, {0.1, 5e-4, 1}), same = makeMachine(model, {0.1, 5e-4, 1}),
              other = makeMachine(model, {0.1, 5e-4, 2});
  double most_mass = 0, most_rod = 0;
  for (int i = 1; i < model.numBodies(); ++i) {
    const Inertia &before = model.bodies()[i].inertia, &after = machine.bodies()[i].inertia;
    if (before.mass == 0) continue;
    const double factor = after.mass / before.mass;
    most_mass = std::max(most_mass, std::abs(factor - 1));
    CHECK((after.I_com - factor * before.I_com).norm() <= 1e-12);
    CHECK(same.bodies()[i].inertia.mass == after.mass);
    CHECK(other.bodies()[i].inertia.mass != after.mass);
  }
  for (size_t c = 0; c < model.closures().size(); ++c) {
    const Vector3d shift = machine.closures()[c].X_B1.p - model.closures()[c].X_B1.p;
    most_rod = std::max(most_rod, shift.cwiseAbs().maxCoeff());
  }
  CHECK(most_mass <= 0.1);
  CHECK(most_mass > 0.08);
  CHECK(most_rod <= 5e-4);
  CHECK(most_rod > 4e-4);
}

TEST_CASE("robot errors: the machine is closed, its motors and its lowest sole where the controller believes them") {
  for (const char* name : {"bipetto", "cleobot"}) {
    const LoadedRobot robot = loadOwn(name);
    const Model& model = robot.model;
    const Model machine = makeMachine(model, {0.1, 1e-3, 3});
    const VectorXd believed = makeStandingPosture(model), q = assembleMachine(model, machine, believed);
    Workspace ws(machine);
    updatePlacements<double>(machine, ws, q);
    CHECK(calcLargestGap(ws, makeConstraintSet(machine)) < 1e-10);
    CHECK((q - believed).norm() > 1e-4);
    for (const Motor& motor : model.motors()) {
      const int at = model.joints()[motor.joint].idx_q;
      CHECK(q[at] == Approx(believed[at]).margin(1e-10));
    }
    double least = 1;
    for (const ContactFrame& contact : machine.contacts())
      for (double x : {-1.0, 1.0})
        for (double y : {-1.0, 1.0}) {
          const Vector3d corner(x * contact.half_length, y * contact.half_width, 0);
          least = std::min(least, ws.X_WB[contact.body].act(contact.X_BF.act(corner)).z());
        }
    CHECK(least == Approx(0).margin(1e-6));
  }
}

TEST_CASE("robot errors: joints that no motor determines stay where they are") {
  const Model model = loadOwn("fivebar_leg").model, machine = makeMachine(model, {0.1, 0, 3});
  const VectorXd q = makeStandingPosture(model);
  CHECK((assembleMachine(model, machine, q) - q).norm() < 1e-9);
}

TEST_CASE("robot errors: impossible ones are refused") {
  const LoadedRobot robot = loadOwn("fivebar");
  CHECK_THROWS_AS(makeMachine(robot.model, {1, 0, 1}), InputError);
  // A planar linkage whose hinge leaves the plane cannot be closed: its rows are redundant.
  const Model machine = makeMachine(robot.model, {0, 1e-3, 1});
  CHECK_THROWS_AS(assembleMachine(robot.model, machine, makeStandingPosture(robot.model)), InputError);
}

}  // namespace bielle::worlds
