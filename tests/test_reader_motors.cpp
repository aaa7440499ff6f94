// Motors in files: limits, gears, windings, catalogues, and what belongs to them.
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <string>

#include "bielle/dynamics/closure.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/model/error.h"
#include "get_error.h"
#include "infinity.h"
#include "toy_robot.h"

using namespace bielle;
using namespace bielle::testing;

TEST_CASE("motors, armature, contacts, references, serial joints and gravity arrive") {
  const Model model = load(kToyUrdf, R"(motors: {shoulder: {effort: .inf, velocity: 9, torque_loss: 0.4}, rod_joint: }
armature: 0.25
contacts: {toe: {frame: hand, type: 6d, sole: [0.2, 0.1]}, heel: {frame: rod, type: 3D}}
serial_joints: [rod_joint, shoulder]
gravity: [0, 0, -1.62]
importance: {shoulder: [10, 0.5]}
references:
  up: {joints: {shoulder: 1, root_joint: [0, 0, 1, 0, 0, 0, 1]}, height: {frame: wrist, value: 0.4},
       feet: {toe: [1, 2, 3]}}
)");
  REQUIRE(model.nu() == 2);
  const int shoulder = getJoint(model, "shoulder").idx_v, rod = getJoint(model, "rod_joint").idx_v;
  CHECK(model.motors()[0].effort_limit == kInf);
  CHECK(model.motors()[0].velocity_limit == 9);
  CHECK(model.motors()[0].torque_loss == 0.4);
  CHECK_FALSE(model.motors()[1].torque_loss);
  CHECK(model.motors()[1].torqueLoss() == kDefaultTorqueLoss);
  CHECK(model.velocityLimits()[shoulder] == 9);
  CHECK(model.motors()[1].dof == rod);
  CHECK(model.armature().sum() == 0.5);
  REQUIRE(model.contacts().size() == 2);
  CHECK(model.contacts()[0].half_length == 0.1);
  CHECK(model.contacts()[0].half_width == 0.05);
  CHECK((model.contacts()[0].X_BF.p - Vector3d(0.2, 0, 0)).norm() == 0);
  CHECK(model.contacts()[1].kind == ContactKind::Point3D);
  CHECK(model.serialJoints() == std::vector<int>{model.findJoint("rod_joint"), model.findJoint("shoulder")});
  CHECK((model.gravity() - Vector3d(0, 0, -1.62)).norm() == 0);
  CHECK(getJoint(model, "shoulder").position_importance == 10);
  CHECK(getJoint(model, "shoulder").velocity_importance == 0.5);
  CHECK(getJoint(model, "rod_joint").position_importance == 1);
  REQUIRE(model.references().size() == 1);
  const Reference& up = model.references()[0];
  CHECK(up.joints.at("shoulder") == std::vector<double>{1});
  CHECK(up.height_frame == "hand");
  CHECK(up.height == 0.4);
  CHECK((up.feet.at("toe") - Vector3d(1, 2, 3)).norm() == 0);

  const Model by_joint = loadWith("armature: {shoulder: 2, rod_joint: 3}");
  CHECK(by_joint.motors()[0].armature == 2);
  CHECK(by_joint.armature()[getJoint(by_joint, "rod_joint").idx_v] == 3);
  CHECK(by_joint.armature().sum() == 5);
}

TEST_CASE("winding and gear of a motor: limits, armature, loss and thermal torque follow from them") {
  const std::string keys =
      "ratio: 9, rotor_inertia: 2e-4, torque_constant: 0.1, resistance: 0.2, voltage: 24, current: 30, "
      "continuous_current: 10, efficiency: 0.8, back_efficiency: 0.7, mass: 0.5";
  const auto loadMotor = [&](const std::string& more) {
    return loadWith("motors: {shoulder: {" + keys + more + "}}").motors()[0];
  };
  const Motor motor = loadMotor("");
  CHECK(motor.armature == Approx(81 * 2e-4));
  CHECK(motor.effort_limit == Approx(std::min(0.8 * 0.9 * 30, loadWith("").motors()[0].effort_limit)));
  CHECK(motor.velocity_limit == Approx(std::min(24 / 0.9, loadWith("").motors()[0].velocity_limit)));
  CHECK(motor.continuous_effort == Approx(9));
  CHECK(motor.torqueLoss() == Approx(0.2 / 0.81));
  CHECK(motor.drive.back_efficiency == 0.7);
  CHECK(motor.drive.mass == 0.5);
  CHECK(motor.hasEnvelope());
  CHECK(motor.voltsPerEffort() == Approx(0.2 / (0.8 * 0.9)));
  CHECK(motor.voltsPerSpeed() == Approx(0.9));
  CHECK(motor.getEffortFactor(1) == 1 / 0.8);
  CHECK(motor.getEffortFactor(-1) == 0.7);
  // What is given holds; of two limits the smaller.
  CHECK(loadMotor(", effort: 010").effort_limit == Approx(10));  // never in octal
  CHECK(loadMotor(", effort: .inf").effort_limit == Approx(0.8 * 0.9 * 30));
  CHECK(loadMotor(", effort: 12").effort_limit == 12);
  CHECK(loadMotor(", effort: 100").effort_limit == Approx(0.8 * 0.9 * 30));
  CHECK(loadMotor(", velocity: 50").velocity_limit == Approx(24 / 0.9));
  CHECK(loadMotor(", velocity: 5").velocity_limit == 5);
  CHECK(loadMotor(", armature: 0.3").armature == 0.3);
  CHECK(loadMotor(", torque_loss: 0.01").torqueLoss() == 0.01);
  CHECK(loadMotor(", continuous_effort: 4").continuous_effort == 4);
  CHECK(loadWith("motors: {shoulder: {continuous_effort: 4}}").motors()[0].continuous_effort == 4);
  CHECK(loadWith("motors: {shoulder: {ratio: 2, rotor_inertia: 0.01}}\narmature: 0.25").armature().maxCoeff() == 0.04);
  CHECK(loadWith("motors: {shoulder: {ratio: 2, rotor_inertia: 0.01}}\narmature: {shoulder: 0.25}")
            .armature()
            .maxCoeff() == 0.25);
}

TEST_CASE("a motor without these data is what it was") {
  const Motor motor = loadWith("motors: {shoulder: {armature: 0.01, effort: 7, velocity: 9}}").motors()[0];
  CHECK_FALSE(motor.drive.isGiven());
  CHECK_FALSE(motor.hasEnvelope());
  CHECK(motor.effort_limit == 7);
  CHECK(motor.velocity_limit == 9);
  CHECK(motor.armature == 0.01);
  CHECK_FALSE(motor.torque_loss);
  CHECK(std::isinf(motor.continuous_effort));
  CHECK(motor.getEffortFactor(1) == 1);
  CHECK(motor.getEffortFactor(-1) == 1);
}

TEST_CASE("motors of a catalogue") {
  const RobotDirectory directory;
  directory.write(
      "own.yaml",
      "motors:\n  big: {source: bench, ratio: 6, torque_constant: 0.2, voltage: 48, effort: 30, velocity: 40}\n"
      "  ak80-9: {source: another, torque_constant: 7}\n");
  const auto loadMotors = [&](const std::string& motors) {
    return loadRobot(
               directory.writeRobot(kToyUrdf, std::string(kToyYaml) + "motor_catalogue: own.yaml\nmotors: " + motors))
        .model.motors();
  };
  const Motor big = loadMotors("{shoulder: {type: big, current: 20}}")[0];
  CHECK(big.drive.type == "big");
  CHECK(big.drive.torque_constant == 0.2);
  CHECK(big.effort_limit == Approx(6 * 0.2 * 20));  // below the 30 of its gear
  CHECK(big.velocity_limit == Approx(40));
  // Another ratio is a stage behind the gear of the catalogue.
  const Motor geared = loadMotors("{shoulder: {type: big, ratio: 12}}")[0];
  CHECK(geared.effort_limit == 60);
  CHECK(geared.velocity_limit == Approx(std::min(20.0, 48 / 2.4)));
  CHECK(loadMotors("{shoulder: {type: ak80-9}}")[0].drive.torque_constant == 7);  // the first file that has it
  // The one that comes along: every entry is a motor with its figures.
  for (const char* name : {"ak80-6", "ak80-9", "ak70-9", "ak10-9", "ec45-flat-70w", "ec90-flat-90w"}) {
    CAPTURE(name);
    const Motor motor = loadWith(std::string("motors: {shoulder: {type: ") + name + ", effort: .inf}}").motors()[0];
    const MotorDrive& drive = motor.drive;
    CHECK(drive.type == name);
    CHECK(drive.rotor_inertia > 1e-6);
    CHECK(drive.rotor_inertia < 1e-3);
    CHECK(motor.hasEnvelope());
    CHECK(std::isfinite(motor.continuous_effort));
    CHECK(motor.armature == Approx(drive.ratio * drive.ratio * drive.rotor_inertia));
    // Stall and no-load speed are those of motors of this size, and what it bears for ever is less than it bears at all.
    CHECK(drive.resistance * drive.continuous_current < drive.voltage);
    CHECK(motor.continuous_effort < drive.voltage / motor.voltsPerEffort());
    if (std::isfinite(drive.current)) CHECK(drive.continuous_current < drive.current);
  }
  CHECK(loadWith("motors: {shoulder: {type: ak80-6}}").motors()[0].effort_limit <= 12);
}
