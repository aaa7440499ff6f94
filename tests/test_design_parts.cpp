// Architectures, motors and gears of designs: what is chosen, what comes with it, what is refused.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <set>

#include "bielle/model/error.h"
#include "bielle/robots/robot_loader.h"
#include "design/draft.h"
#include "design/front_search.h"
#include "design/motor_change.h"
#include "design/run.h"
#include "design_trials.h"
#include "robot_directory.h"
#include "run_command.h"

using namespace bielle;
using namespace bielle::testing;
using Catch::Matchers::Contains;
namespace fs = std::filesystem;

TEST_CASE("design: a gear scales what is behind it, a type brings what is in it") {
  Motor motor;
  motor.name = "m", motor.joint = 3, motor.dof = 8;
  motor.armature = 0.01, motor.effort_limit = 30, motor.velocity_limit = 10, motor.torque_loss = 0.5;
  motor.drive.ratio = 2;
  CHECK(setRatio(6, {}, motor) == 0);  // no winding is known
  CHECK(motor.armature == Approx(0.09));
  CHECK(motor.effort_limit == Approx(90));
  CHECK(motor.velocity_limit == Approx(10.0 / 3));
  CHECK(*motor.torque_loss == Approx(0.5 / 9));
  CHECK(motor.drive.efficiency == 1);
  motor.drive.efficiency = 0.98, motor.drive.back_efficiency = 0.97;  // of a belt behind it
  Motor type;
  type.effort_limit = 22, type.drive.ratio = 9, type.drive.type = "t", type.drive.torque_constant = 0.1;
  type.drive.efficiency = 0.9;
  setType(type, motor);
  CHECK((motor.name == "m" && motor.joint == 3 && motor.dof == 8));
  CHECK((motor.effort_limit == 22 && motor.drive.type == "t" && motor.armature == 0));
  CHECK((motor.drive.efficiency == Approx(0.9 * 0.98) && motor.drive.back_efficiency == Approx(0.97)));
  setType(type, motor);
  CHECK(motor.drive.efficiency == 0.9);  // in the place of another type

  // Twice the ratio is paid for with 1.5 % of the power and 5.4 g per N m; half of it is not.
  Motor geared = motor;
  CHECK(setRatio(18, {}, geared) == Approx(0.0054 * 22));
  CHECK((geared.drive.efficiency == Approx(0.9 * 0.985) && geared.drive.back_efficiency == Approx(0.985)));
  CHECK(geared.effort_limit == Approx(2 * 0.985 * 22));
  geared = motor;
  CHECK((setRatio(4.5, {}, geared) == 0 && geared.drive.efficiency == 0.9 && geared.effort_limit == 11));
  geared = motor;
  CHECK((setRatio(18, {0, 0}, geared) == 0 && geared.effort_limit == 44));

  // Of a given robot: both knees, and no other motor; inertias and places stay.
  const Model bipetto = loadBipetto();
  CHECK(findMotors(bipetto, {"motor_knee_*"}).size() == 2);
  CHECK(findMotors(bipetto, {"*"}).size() == 12);
  std::vector<std::string> unknown;
  CHECK(findMotors(bipetto, {"knee", "hip?_left"}, &unknown).size() == 3);
  CHECK(unknown == std::vector<std::string>{"knee"});
  DesignVariable gear;
  gear.name = "gear", gear.motors = {"motor_knee_*"}, gear.lower = 0.5, gear.upper = 3;
  const Parametrization robot(bipetto, {gear});
  CHECK(robot.start()[0] == 1);
  const Model made = robot.make(VectorXd::Constant(1, 2));
  for (int m = 0; m < made.nu(); ++m) {
    const bool knee = made.motors()[m].name.rfind("motor_knee", 0) == 0;
    CHECK(made.motors()[m].armature == Approx(bipetto.motors()[m].armature * (knee ? 4 : 1)));
  }
  CHECK(made.mass() == bipetto.mass());
  gear.lower = 1.5;
  CHECK_THROWS_WITH(Parametrization(bipetto, {gear}), Contains("or give `start`"));
  gear.start = 2.5;
  CHECK(Parametrization(bipetto, {gear}).startModel().motors()[findMotors(bipetto, gear.motors)[0]].drive.ratio == 2.5);
  // The mass that a catalogue gives for a motor of a robot's own files is in its links already.
  RobotDraft draft(bipetto);
  Motor heavy = bipetto.motors()[0];
  heavy.drive.mass = 0.5;
  draft.setMotor(0, heavy);
  const Parametrization catalogued(draft.build(), {gear});
  CHECK(catalogued.make(catalogued.start()).mass() == bipetto.mass());
  CHECK(calcMassInLinks(catalogued, catalogued.start()) == 0.5);
  gear.motors = {"elbow"};
  CHECK_THROWS_WITH(Parametrization(bipetto, {gear}), Contains("no such motor"));
}

namespace {

const char* const kParts = R"(generator: leg_biped
set: {ankle: differential, motor_mass: 0.7}
architecture: [belt_knee, four_bar_knee, differential_ankle, rsu_ankle]
motor_catalogue: own.yaml
variables:
  - {name: shank, parameter: shank_length, bounds: [0.2, 0.26]}
  - {name: gear, ratio: "*knee*", bounds: [5, 20]}
  - {name: motor, motor: ["*knee*"], choices: [ak80-9, strong], mass: knee_motor_mass, start: strong}
motions:
  - {motion: squat, set: {depth: 0.95, duration: 0.6, settle: 0.06, time_step: 0.03}}
objective:
  - {measure: electrical_energy, motors: ["*knee*"]}
constraints:
  - {measure: envelope}
  - {measure: mass, at_most: 26.5}
search: {searches: 1, stages: [{algorithm: crs, evaluations: 3}]}
)";
const char* const kOwnMotors = R"(motors:
  strong: {source: here, ratio: 6, rotor_inertia: 1e-4, torque_constant: 0.2, resistance: 0.2, voltage: 48, current: 30,
           continuous_current: 9, mass: 1.1, effort: 30, velocity: 35}
)";

}  // namespace

TEST_CASE("design: architectures and motors are chosen, with what belongs to them") {
  const RobotDirectory directory;
  directory.write("own.yaml", kOwnMotors);
  const std::string path = directory.write("spec.yaml", kParts);
  const DesignSpec spec = readDesignSpec(path);
  const Parametrization robot = makeParametrization(spec);
  // knee, ankle, shank, gear, motor: the start is four_bar and differential, as the generator's, strong as told.
  REQUIRE(robot.start().size() == 5);
  CHECK((robot.start() - (VectorXd(5) << 1, 0, 0.24, 6, 1).finished()).norm() < 1e-12);
  CHECK(robot.listContinuous() == std::vector<Eigen::Index>{2, 3});
  CHECK(describeValue(robot.variables()[1], 1) == "rsu");
  const std::vector<VectorXd> all = robot.listCombinations();
  REQUIRE(all.size() == 8);
  CHECK(all.front() == robot.start());
  std::set<std::vector<int>> architectures;
  for (const VectorXd& x : all) {
    architectures.insert(robot.getArchitecture(x));
    const Model model = robot.make(x);
    const bool strong = x[4] == 1, belt = x[0] == 0, rsu = x[1] == 1;
    CHECK((model.findMotor("motor_knee_left") >= 0 && model.nu() == 12));
    CHECK((model.findJoint("pulley_knee_left") < 0 && (model.findJoint("elbow_knee_left") < 0) == belt));
    CHECK((model.findJoint("elbow_ankle1_left") >= 0) == rsu);
    const Motor& motor = model.motors()[model.findMotor("motor_knee_left")];
    CHECK(motor.drive.type == (strong ? "strong" : "ak80-9"));
    CHECK(motor.armature == Approx(36 * (strong ? 1e-4 : 5.79e-5)));
    // Of the limits at the gear's shaft and those of current and voltage the smaller: at 6 instead of 9, two thirds of 22 N m.
    CHECK(motor.effort_limit == Approx(strong ? 30 : 22 * 6.0 / 9));
    VectorXd other = x;
    other[3] = 12;
    const Model geared = robot.make(other);
    CHECK(geared.mass() - model.mass() == Approx(2 * 0.0054 * (strong ? 30 : (12.0 / 9 - 1) * 22)));
    CHECK(geared.motors()[model.findMotor("motor_knee_left")].drive.efficiency ==
          Approx((belt ? 0.98 : 1) * (1 - 0.03 * (strong ? 0.5 : 0.25))));
    other[3] = x[3];
    other[4] = 1 - x[4];
    CHECK(calcMassInLinks(robot, x) == 0);  // a variable gives them
    CHECK(model.mass() - robot.make(other).mass() == Approx((strong ? 1 : -1) * 2 * (1.1 - 0.49)));
  }
  CHECK(architectures.size() == 4);

  // A type may give its mass to several motors: two at the knees, four at the ankles.
  const Parametrization both = makeParametrization(readDesignSpec(directory.write(
      "both.yaml", replaceOnce(kParts, "mass: knee_motor_mass", "mass: [knee_motor_mass, ankle_motor_mass]"))));
  VectorXd light = both.start();
  light[4] = 0;
  CHECK(both.make(both.start()).mass() - both.make(light).mass() == Approx(6 * (1.1 - 0.49)));

  const DesignMotion squat = makeSmallSquat();
  EvaluationOptions options;
  options.constraints = spec.constraints;
  const DesignEvaluator evaluator(robot, {squat}, spec.objective, options);
  for (const VectorXd& x : all) {
    CAPTURE(x.transpose());
    const Evaluation e = evaluator.evaluate(x);
    REQUIRE((e.status == DesignStatus::Feasible || e.status == DesignStatus::Violated));
    CHECK(e.constraints[1] == robot.make(x).mass());
    CHECK((e.status == DesignStatus::Violated) == (e.constraints[1] > 26.5 * 1.001));
    CHECK(e.constraints[0] > 0.05);
    CHECK(e.constraints[0] < 1.001);  // motions keep to the limits of the motors
  }
  // Eq. (4): less violation is better.
  const auto evaluate = [&](double most) {
    EvaluationOptions bounded;
    bounded.constraints = {{Measure::Mass, {}, most, false}};
    return DesignEvaluator(robot, {squat}, spec.objective, bounded).evaluate(all[1]);
  };
  const double mass = robot.make(all[1]).mass(), V = mass / 20 - 1;
  CHECK(evaluate(20).value == Approx(1.5 + 0.25 * V / (1 + V)));
  CHECK(evaluate(20).value > evaluate(25).value);
  CHECK(evaluate(mass).status == DesignStatus::Feasible);

  const std::string out = directory.path() + "/out";
  const CommandResult result = runCommand({BIELLE_COMMAND, "design", path, "-o", out, "--jobs", "2"});
  INFO(result.err);
  REQUIRE(result.status == 0);
  CHECK(fs::exists(out + "/search8.jsonl"));
  CHECK_THAT(result.out, Contains("constraint violated"));
  const std::string page = readFile(out + "/design.md");
  CHECK_THAT(page, Contains("| knee |") && Contains("belt, four_bar") && Contains("at most 26.5"));
  const Model best = loadRobot(out + "/best").model;
  CHECK(best.mass() < 26.5 * 1.001);
  const Motor& driven = best.motors()[best.findMotor("motor_knee_left")];
  CHECK(driven.drive.torque_constant > 0);
  CHECK((driven.drive.type == "ak80-9" || driven.drive.type == "strong"));  // the name stays
  std::string twice = readFile(out + "/best/best.yaml");
  twice.insert(twice.find("catalogue_type"), "type: ak80-9, ");
  directory.write("out/best/best.yaml", twice);
  CHECK_THROWS_WITH(loadRobot(out + "/best"), Contains("best.yaml") && Contains("has a `type` already; remove one"));
}

TEST_CASE("design: hips are chosen by the name of the choice alone, and motors of either are found") {
  const RobotDirectory directory;
  const DesignSpec spec = readDesignSpec(directory.write("spec.yaml", R"(generator: leg_biped
architecture: [three_rrs, serial_hip, belt]
variables: [{name: gear, ratio: "*hip*", bounds: [1, 3]}]
objective: [{measure: mass}]
)"));
  const Parametrization robot = makeParametrization(spec);
  REQUIRE(robot.variables()[0].choices == std::vector<std::string>{"three_rrs", "serial"});
  CHECK(robot.start()[0] == 1);  // serial, as the generator's
  const std::vector<VectorXd> all = robot.listCombinations();
  REQUIRE(all.size() == 2);
  for (const VectorXd& x : all) {
    VectorXd geared = x;
    geared[1] = 2;
    const Model model = robot.make(geared);
    const bool parallel = x[0] == 0;
    CHECK((model.findMotor("motor_hip3_left") >= 0) == parallel);
    CHECK((model.findMotor("hipz_left") >= 0) == !parallel);
    CHECK(model.findJoint("pulley_knee_left") < 0);
    CHECK(model.findMotor("motor_knee_left") >= 0);
    CHECK(model.mass() == Approx(robot.startModel().mass()));
    const Motor& motor = model.motors()[model.findMotor(parallel ? "motor_hip3_left" : "hipz_left")];
    CHECK(motor.armature == Approx(4 * 1e-3));
  }

  // What a part chooses for itself, by its full name.
  const DesignSpec within = readDesignSpec(directory.write("within.yaml", R"(
generator: leg_biped
set: {hip: parallel_spring}
architecture: [three_rrs_hip_drive, serial_hip_drive, belt]
variables: [{name: gear, ratio: "*hip*", bounds: [1, 3]}]
objective: [{measure: mass}]
)"));
  CHECK(makeParametrization(within).variables()[0].parameter == "hip_drive");
}

TEST_CASE("design: parameters of parts that a design does not have are no part of its page") {
  const RobotDirectory directory;
  const auto design = [&](const std::string& variable) {
    const std::string spec = directory.write("spec.yaml", R"(generator: leg_biped
architecture: [three_rrs, serial_hip, belt]
variables:
  - {name: middle, parameter: hip_middle, unit: rad, bounds: [-1, 0]}
  - {name: thigh, parameter: thigh_length, bounds: [0.2, 0.24]}
)" + variable + R"(
objective: [{measure: mass}]
search: {searches: 1, stages: [{algorithm: sbplx, evaluations: 3}]}
)");
    return runCommand({BIELLE_COMMAND, "design", spec, "-o", directory.path() + "/out"});
  };
  const CommandResult refused =
      design("  - {name: arm, parameter: knee_arm, bounds: [0.04, 0.06]}");  // no design has it
  CHECK(refused.status == 2);
  CHECK_THAT(refused.err, Contains("variable 'arm'") && Contains("`knee: ball_screw`"));

  const CommandResult result = design("");
  INFO(result.err);
  REQUIRE(result.status == 0);
  const std::string page = readFile(directory.path() + "/out/design.md");
  CHECK_THAT(page, Contains("| middle | rad | -1 .. 0 | – |"));  // the start has serial hips
  CHECK_THAT(page, Contains("| thigh | m | 0.2 .. 0.24 | 0.22 | 0.2"));
}

TEST_CASE("design: choices and constraints that cannot be are refused with their lines") {
  const RobotDirectory directory;
  directory.write("own.yaml", kOwnMotors);
  const auto check = [&](const std::string& from, const std::string& to, const std::string& problem) {
    std::string text = kParts;
    REQUIRE(text.find(from) != std::string::npos);
    text.replace(text.find(from), from.size(), to);
    CAPTURE(to);
    const std::string path = directory.write("spec.yaml", text);
    const auto read = [&] {
      const DesignSpec spec = readDesignSpec(path);
      const Parametrization robot = makeParametrization(spec);
      EvaluationOptions options;
      options.constraints = spec.constraints;
      DesignEvaluator(robot, {makeSmallSquat()}, spec.objective, options);
    };
    CHECK_THROWS_WITH(read(), Contains(problem));
  };
  check("belt_knee,", "chain_knee,", "there is no part 'chain_knee'");
  check("belt_knee,", "belt_knee, belt_knee,", "listed twice");
  check("belt_knee,", "belt, belt_knee,", "listed twice");
  check("belt_knee,", "serial,",
        "there is no part 'serial'; use some of parallel_spring_hip, serial_hip");  // of which joint?
  check("leg_biped\nset: {ankle: differential, motor_mass: 0.7}", "cleobot", "does not compose robots from parts");
  check("generator: leg_biped\nset: {ankle: differential, motor_mass: 0.7}", "robot: bipetto", "one architecture");
  check("ankle: differential", "ankle: belt", "not one of its choices");
  check("ak80-9, strong", "ak80-9, weak", "there is no motor 'weak'");
  check("ak80-9, strong", "", "nothing to choose");
  check("ak80-9, strong], mass", "ec90-flat-90w, strong], mass", "its mass is not in the catalogue");
  check("mass: knee_motor_mass", "mass: knee_mass", "no parameter 'knee_mass'");
  check("start: strong", "start: weak", "not one of the choices");
  check("choices: [ak80-9, strong], mass: knee_motor_mass, start: strong", "bounds: [0, 1]", "has no choices");
  check("bounds: [5, 20]", "bounds: [-5, 20]", "not positive");
  check("bounds: [5, 20]", "bounds: [7, 20]", "or give `start`");
  check("ratio: \"*knee*\"", "ratio: knee", "no such motor");
  check("bounds: [0.2, 0.26]", "bounds: [-5, 0.26]", "bounds -5 .. 0.26 go beyond those of parameter 'shank_length'");
  const auto check_twice = [&](const std::string& other, const std::string& problem) {
    check("  - {name: gear,", "  - {name: other, " + other + "}\n  - {name: gear,", problem);
  };
  check_twice("parameter: shank_length, bounds: [0.2, 0.26]",
              "variables 'shank' and 'other': both set parameter 'shank_length'");
  check_twice("ratio: motor_knee_left, bounds: [5, 20]",
              "variables 'other' and 'gear': both set the ratio of motor 'motor_knee_left'");
  check_twice("motor: motor_knee_left, choices: [ak80-9]",
              "variables 'other' and 'motor': both set the type of motor 'motor_knee_left'");
  check_twice("parameter: knee_motor_mass, unit: kg, bounds: [0.3, 2]",
              "variables 'other' and 'motor': both set parameter 'knee_motor_mass'");
  check("at_most: 26.5", "", "it does not have exactly one bound");
  check("mass, at_most: 26.5", "margin, at_most: 0.1", "give `at_least`");
  check("mass, at_most: 26.5", "dead_point_distance, at_most: 0.1", "give `at_least`");
  check("mass, at_most: 26.5", "dead_point_distance, at_least: 0.6", "dead points are looked for within 0.5 rad");
  check("mass, at_most: 26.5", "cost, at_most: 0.1", "use one of envelope");
  check("envelope}", "envelope, motors: [\"hip*\"]}", "none of the motors has such a limit");
  check("mass, at_most: 26.5}\nsearch: {searches: 1, stages: [{algorithm: crs",
        "conditioning, at_most: 5}\nsearch: {searches: 1, stages: [{algorithm: slsqp",
        "which the constraint on conditioning does not have");
  if (hasFrontSearch())
    check("searches: 1, stages: [{algorithm: crs, evaluations: 3}]", "pareto: {algorithm: moead}", "use nsga2");
}
