// Design: robots made from numbers, their values, and searches that resume after being killed.
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>
#include <sstream>

#include "bielle/io/robot_writer.h"
#include "bielle/model/builder.h"
#include "bielle/model/error.h"
#include "bielle/model/reader.h"
#include "bielle/motion/squat.h"
#include "bielle/robots/fourbar_chain.h"
#include "bielle/robots/generators.h"
#include "design/draft.h"
#include "design/front_search.h"
#include "design/motor_change.h"
#include "design/run.h"
#include "robot_directory.h"
#include "run_command.h"

using namespace bielle;
using namespace bielle::testing;
using Catch::Matchers::Contains;
namespace fs = std::filesystem;

namespace {

const std::string kRobots = std::string(BIELLE_SOURCE_DIR) + "/robots/";
const Vector3d kX = Vector3d::UnitX(), kZ = Vector3d::UnitZ();

DesignVariable makeLength(const std::string& name, double lower, double upper, std::vector<LengthChange> lengths) {
  DesignVariable variable;
  variable.name = name, variable.lower = lower, variable.upper = upper, variable.lengths = std::move(lengths);
  return variable;
}

DesignVariable makeShift(const std::string& name, double lower, double upper, std::vector<ShiftChange> shifts) {
  DesignVariable variable;
  variable.name = name, variable.lower = lower, variable.upper = upper, variable.shifts = std::move(shifts);
  return variable;
}

Model loadBipetto() { return loadRobot(kRobots + "bipetto").model; }

std::vector<DesignVariable> makeKnee() {
  return {makeLength("crank", 0.03, 0.08,
                     {{"motor_knee_right", "transmission_knee_right", kZ, "knee_crank_right"},
                      {"motor_knee_left", "transmission_knee_left", kZ, "knee_crank_left"}}),
          makeShift("motor", -0.03, 0.03, {{"motor_knee_right", kX}, {"motor_knee_left", kX}})};
}

// A squat of no depth, short: the cheapest motion there is.
DesignMotion makeSmallSquat() {
  SquatOptions options;
  options.depth = 0.95, options.duration = 0.6, options.settle = 0.06, options.time_step = 0.03;
  return {"squat", [options](const Model& model, const VectorXd& q0) { return planSquat(model, options, q0); }};
}

const std::vector<ObjectiveTerm> kKneePeak = {{Measure::PeakTorque, {"motor_knee_left", "motor_knee_right"}, 1}};

std::string readFile(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

int countLines(const std::string& path) {
  const std::string text = readFile(path);
  return static_cast<int>(std::count(text.begin(), text.end(), '\n'));
}

}  // namespace

TEST_CASE("design: lengths of a four-bar are those of its maker") {
  FourBarChainOptions options;
  const Model start = makeFourBarChain(options).model;
  const std::vector<DesignVariable> variables = {
      makeLength("crank", 0.1, 0.2, {{"crank1", "coupler1", Vector3d::Zero(), "crank1"}}),
      makeLength("coupler", 0.3, 0.45, {{"coupler1", "end of coupler1", Vector3d::Zero(), "coupler1"}}),
      makeLength("rocker", 0.2, 0.4, {{"rocker1", "end of rocker1", Vector3d::Zero(), "rocker1"}}),
      makeShift("ground", -0.1, 0.1, {{"rocker1", kX}})};
  const Parametrization robot(start, variables);
  CHECK(robot.start().isApprox(Eigen::Vector4d(options.crank, options.coupler, options.rocker, 0), 1e-14));

  FourBarChainOptions other = options;
  other.crank = 0.13, other.coupler = 0.41, other.rocker = 0.27, other.ground = options.ground + 0.03;
  const Model made = robot.make(Eigen::Vector4d(other.crank, other.coupler, other.rocker, 0.03));
  const Model expected = makeFourBarChain(other).model;
  for (int i = 1; i < made.numBodies(); ++i) {
    CAPTURE(made.joints()[i].name);
    CHECK(made.joints()[i].name == expected.joints()[i].name);
    CHECK((made.joints()[i].X_PJ.p - expected.joints()[i].X_PJ.p).norm() < 1e-14);
    const Matrix6d Y = made.bodies()[i].inertia.toMatrix(), Y_expected = expected.bodies()[i].inertia.toMatrix();
    CHECK((Y - Y_expected).norm() < 1e-14 * Y_expected.norm());
  }
  CHECK((made.closures()[0].X_B1.p - expected.closures()[0].X_B1.p).norm() < 1e-14);
  CHECK((made.closures()[0].X_B2.p - expected.closures()[0].X_B2.p).norm() < 1e-14);
}

TEST_CASE("design: the start of a parametrization is the robot, to the last letter") {
  const Model bipetto = loadBipetto();
  const Parametrization robot(bipetto, makeKnee());
  const RobotText made = formatRobot(robot.make(robot.start())), given = formatRobot(bipetto);
  CHECK(made.urdf == given.urdf);
  CHECK(made.yaml == given.yaml);
  CHECK(robot.start()[0] == Approx(std::hypot(0.048296, 0.012941)).epsilon(1e-12));
}

TEST_CASE("design: both legs change by as much, and nothing else does") {
  const Model bipetto = loadBipetto();
  const Parametrization robot(bipetto, makeKnee());
  VectorXd x = robot.start();
  x[0] += 0.01, x[1] = 0.004;
  const Model made = robot.make(x);
  for (int i = 1; i < made.numBodies(); ++i) {
    const Joint &a = bipetto.joints()[i], &b = made.joints()[i];
    CAPTURE(a.name);
    REQUIRE(a.name == b.name);
    const double change = (b.X_PJ.p - a.X_PJ.p).norm();
    const bool crank = a.name.rfind("transmission_knee", 0) == 0, motor = a.name.rfind("motor_knee", 0) == 0;
    CHECK(change == Approx(crank ? 0.01 : motor ? 0.004 : 0).margin(1e-14));
    if (crank) CHECK(b.X_PJ.p.z() == a.X_PJ.p.z());  // along its axis nothing moves
  }
  const auto mass = [](const Model& model) {
    for (const Body& body : model.bodies())
      if (body.name == "knee_crank_left") return body.inertia.mass;
    return 0.0;
  };
  CHECK(mass(made) == Approx(mass(bipetto) * (robot.start()[0] + 0.01) / robot.start()[0]).epsilon(1e-5));
}

TEST_CASE("design: a stretched body stays a possible one") {
  const Model bipetto = loadBipetto();
  RobotDraft draft(bipetto);
  const Vector3d direction = Vector3d(1, -2, 0.5).normalized();
  draft.stretch("shin_left", Vector3d(0.1, 0, 0), direction, 0.2);
  const Model made = draft.build();
  int body = 1;
  while (made.bodies()[body].name != "shin_left") ++body;
  const Vector3d moments = Eigen::SelfAdjointEigenSolver<Matrix3d>(made.bodies()[body].inertia.I_com).eigenvalues();
  CHECK(moments[0] > 0);
  CHECK(moments[0] + moments[1] >= moments[2]);
  CHECK(made.bodies()[body].inertia.mass == Approx(0.2 * bipetto.bodies()[body].inertia.mass));
  // Across the direction the second moments only lose mass.
  const Vector3d across = direction.cross(kZ).normalized();
  const auto second = [&](const Inertia& i) { return i.I_com.trace() / 2 - across.dot(i.I_com * across); };
  CHECK(second(made.bodies()[body].inertia) == Approx(0.2 * second(bipetto.bodies()[body].inertia)));
}

TEST_CASE("design: a spring moves with the frame that it was attached to") {
  ModelParts parts = takeParts(loadBipetto());
  const auto frame = std::find_if(parts.frames.begin(), parts.frames.end(),
                                  [&](const Frame& f) { return f.body > 0 && f.name != parts.bodies[f.body].name; });
  REQUIRE(frame != parts.frames.end());
  PointSpring spring;
  spring.name = "spring", spring.body2 = frame->body, spring.point2 = frame->X_BF.p, spring.rest = 0.1;
  parts.point_springs.push_back(spring);
  const Model model = ModelBuilder::restore(parts);
  RobotDraft draft(model);
  const Vector3d place = frame->X_BF.p + Vector3d(0.01, 0.02, 0.03);
  draft.setPlace(frame->name, place);
  const Model made = draft.build();
  REQUIRE(made.pointSprings().size() == 1);
  CHECK(made.pointSprings()[0].point2 == place);
  CHECK(made.pointSprings()[0].point1 == Vector3d::Zero());
}

TEST_CASE("design: a heavier trunk") {
  const Model bipetto = loadBipetto();
  RobotDraft draft(bipetto);
  draft.scaleMass(bipetto.bodies()[1].name, 1.5);
  const Inertia before = bipetto.bodies()[1].inertia, after = draft.build().bodies()[1].inertia;
  CHECK(after.mass == Approx(1.5 * before.mass));
  CHECK((after.I_com - 1.5 * before.I_com).norm() < 1e-14);
  CHECK(after.com == before.com);
  CHECK_THROWS_AS(draft.scaleMass("nothing", 2), ModelError);
}

TEST_CASE("design: parameters of a generator") {
  DesignVariable variable;
  variable.name = "thigh", variable.parameter = "thigh_length", variable.lower = 0.05, variable.upper = 0.5;
  const Parametrization robot("cleobot", {}, {variable});
  const GeneratorRequest request = findGenerator("cleobot").makeRequest();
  const double length = robot.start()[0];
  setParameter(request.parameters, "thigh_length", length * 1.02);
  CHECK(formatRobot(robot.make(1.02 * robot.start())).urdf == formatRobot(request.make()).urdf);
  CHECK(formatRobot(robot.make(robot.start())).urdf != formatRobot(request.make()).urdf);
}

TEST_CASE("design: measures by hand") {
  const Model model = makeFourBarChain().model;  // the motor is that of the crank, dof 1
  ShootingTrajectory trajectory;
  const VectorXd q = makeFourBarChain().q_closed;
  for (double speed : {0.5, -2.0, 9.0}) {
    VectorXd x = VectorXd::Zero(6);
    x << q, 0, speed, 0;
    trajectory.xs.push_back(x);
  }
  for (double torque : {3.0, -4.0}) trajectory.us.push_back(VectorXd::Constant(1, torque));
  const MotionMeasures measures = calcMotionMeasures(model, {0.1, 0.3}, trajectory);
  CHECK(measures.motors[0].peak_torque == 4);
  CHECK(measures.motors[0].rms_torque == Approx(std::sqrt((0.1 * 9 + 0.3 * 16) / 0.4)));
  CHECK(measures.motors[0].peak_speed == 2);
  CHECK(measures.motors[0].energy == Approx(0.1 * 1.5 + 0.3 * 8));
  // A unit motion of one mobility: the speeds of rocker, crank and coupler by the loop's equations,
  //     -a s2 w2 - b s3 w3 = -c s4 w4,   a c2 w2 + b c3 w3 = c c4 w4   with w2 = 1.
  const FourBarChainOptions o;
  const double t4 = q[0], t2 = q[1], t3 = q[1] + q[2];
  const double w4 = o.crank * std::sin(t2 - t3) / (o.rocker * std::sin(t4 - t3));
  const double w3 = o.crank * std::sin(t2 - t4) / (o.coupler * std::sin(t4 - t3));
  CHECK(measures.conditioning == Approx(std::sqrt(1 + w4 * w4 + (w3 - 1) * (w3 - 1))).epsilon(1e-9));
}

TEST_CASE("design: a shorter crank is evaluated, an impossible one penalized") {
  const Parametrization robot(loadBipetto(), makeKnee());
  const DesignEvaluator evaluator(robot, {makeSmallSquat()}, kKneePeak);
  CHECK(evaluator.start().value == 1);
  VectorXd x = robot.start();
  x[0] -= 0.003;
  const Evaluation shorter = evaluator.evaluate(x), again = evaluator.evaluate(x);
  REQUIRE(shorter.status == DesignStatus::Feasible);
  CHECK(shorter.value == Approx(shorter.terms[0] / evaluator.start().terms[0]));
  CHECK(shorter.value == again.value);
  CHECK(std::abs(shorter.value - 1) > 1e-3);

  // The start's motion kept gives nearly the same torques: the motion hardly depends on so small a change.
  EvaluationOptions kept;
  kept.mode = MotionMode::Kept;
  const Evaluation recomputed = DesignEvaluator(robot, {makeSmallSquat()}, kKneePeak, kept).evaluate(x);
  REQUIRE(recomputed.status == DesignStatus::Feasible);
  CHECK(recomputed.value == Approx(shorter.value).epsilon(0.05));

  // Designs ever further out of reach: worse than any feasible one, and continuous.
  const Parametrization wide(loadBipetto(), {makeLength("rod", 0.01, 0.3,
                                                        {{"free_knee_right", "closure_knee_right_A", kZ, ""},
                                                         {"free_knee_left", "closure_knee_left_A", kZ, ""}})});
  const DesignEvaluator reach(wide, {makeSmallSquat()}, kKneePeak);
  double last = 1.5;
  for (double length : {0.06, 0.05, 0.04, 0.03}) {
    CAPTURE(length);
    const Evaluation open = reach.evaluate(VectorXd::Constant(1, length));
    CHECK(open.status == DesignStatus::LoopOpen);
    CHECK(open.value > last);
    last = open.value;
  }
  const double near = reach.evaluate(VectorXd::Constant(1, 0.03 + 1e-6)).value;
  CHECK(std::abs(near - last) < 1e-3);
}

TEST_CASE("design: a gear scales what is behind it, a type brings what is in it") {
  Motor motor;
  motor.name = "m", motor.joint = 3, motor.dof = 8;
  motor.armature = 0.01, motor.effort_limit = 30, motor.velocity_limit = 10, motor.torque_loss = 0.5;
  motor.drive.ratio = 2;
  setRatio(6, motor);
  CHECK(motor.armature == Approx(0.09));
  CHECK(motor.effort_limit == Approx(90));
  CHECK(motor.velocity_limit == Approx(10.0 / 3));
  CHECK(*motor.torque_loss == Approx(0.5 / 9));
  Motor type;
  type.effort_limit = 22, type.drive.ratio = 9, type.drive.type = "t";
  setType(type, motor);
  CHECK((motor.name == "m" && motor.joint == 3 && motor.dof == 8));
  CHECK((motor.effort_limit == 22 && motor.drive.type == "t" && motor.armature == 0));

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
    other[4] = 1 - x[4];
    CHECK(model.mass() - robot.make(other).mass() == Approx((strong ? 1 : -1) * 2 * (1.1 - 0.49)));
  }
  CHECK(architectures.size() == 4);

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
}

TEST_CASE("design: parameters of parts that a design does not have are no part of its page") {
  const RobotDirectory directory;
  const std::string spec = directory.write("spec.yaml", R"(generator: leg_biped
architecture: [three_rrs, serial_hip, belt]
variables:
  - {name: middle, parameter: hip_middle, unit: rad, bounds: [-1, 0]}
  - {name: arm, parameter: knee_arm, bounds: [0.04, 0.06]}
  - {name: thigh, parameter: thigh_length, bounds: [0.2, 0.24]}
objective: [{measure: mass}]
search: {searches: 1, stages: [{algorithm: sbplx, evaluations: 3}]}
)");
  const std::string out = directory.path() + "/out";
  const CommandResult result = runCommand({BIELLE_COMMAND, "design", spec, "-o", out});
  INFO(result.err);
  REQUIRE(result.status == 0);
  const std::string page = readFile(out + "/design.md");
  CHECK_THAT(page, Contains("| middle | rad | -1 .. 0 | – |"));      // the start has serial hips
  CHECK_THAT(page, Contains("| arm | m | 0.04 .. 0.06 | – | – |"));  // of belts
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
  check("belt_knee,", "belt_knee, belt_knee,", "there twice");
  check("belt_knee,", "belt, belt_knee,", "there twice");
  check("belt_knee,", "serial,", "there is no part 'serial'; use some of serial_knee");  // of which joint?
  check("leg_biped\nset: {ankle: differential, motor_mass: 0.7}", "cleobot", "does not put parts together");
  check("generator: leg_biped\nset: {ankle: differential, motor_mass: 0.7}", "robot: bipetto", "one architecture");
  check("ankle: differential", "ankle: belt", "none of its choices");
  check("ak80-9, strong", "ak80-9, weak", "there is no motor 'weak'");
  check("ak80-9, strong", "", "nothing to choose");
  check("ak80-9, strong], mass", "ec90-flat-90w, strong], mass", "its mass is not in the catalogue");
  check("mass: knee_motor_mass", "mass: knee_mass", "no parameter 'knee_mass'");
  check("start: strong", "start: weak", "none of the choices");
  check("choices: [ak80-9, strong], mass: knee_motor_mass, start: strong", "bounds: [0, 1]", "has no choices");
  check("bounds: [5, 20]", "bounds: [-5, 20]", "not positive");
  check("bounds: [5, 20]", "bounds: [7, 20]", "or give `start`");
  check("ratio: \"*knee*\"", "ratio: knee", "no such motor");
  check("at_most: 26.5", "", "it has not one bound");
  check("mass, at_most: 26.5", "margin, at_most: 0.1", "give `at_least`");
  check("mass, at_most: 26.5", "cost, at_most: 0.1", "use one of envelope");
  check("envelope}", "envelope, motors: [\"hip*\"]}", "none of the motors has such a limit");
  check("mass, at_most: 26.5}\nsearch: {searches: 1, stages: [{algorithm: crs",
        "conditioning, at_most: 5}\nsearch: {searches: 1, stages: [{algorithm: slsqp",
        "which the constraint on conditioning does not have");
  if (hasFrontSearch())
    check("searches: 1, stages: [{algorithm: crs, evaluations: 3}]", "pareto: {algorithm: moead}", "give nsga2");
}

TEST_CASE("design: choices among numbers, on the front of two distances") {
  if (!hasFrontSearch()) return;
  // Choice 2 of 0 .. 3 has the least of the first objective, choice 0 of the second; the number is no measure of either.
  const double first[] = {1, 2, 0, 3}, second[] = {0, 2, 1, 3};
  std::set<std::pair<double, double>> seen;
  std::vector<VectorXd> designs;
  std::vector<std::vector<double>> objectives;
  FrontProblem problem{
      Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(1, 3, 1), Eigen::Vector3d(1, 3, 1), 2, {}, {false, true}};
  problem.evaluate = [&](const std::vector<VectorXd>& xs) {
    std::vector<std::vector<double>> out;
    for (const VectorXd& x : xs) {
      REQUIRE(x[1] == std::round(x[1]));
      const auto choice = static_cast<size_t>(x[1]);
      seen.insert({x[1], 0});
      out.push_back({first[choice] + std::pow(x[0] - 0.3, 2) + std::pow(x[2], 2),
                     second[choice] + std::pow(x[0] - 0.3, 2) + std::pow(x[2] - 0.5, 2)});
      designs.push_back(x), objectives.push_back(out.back());
    }
    return out;
  };
  searchFront(problem, {SearchAlgorithm::Nsga2, 24, 30}, 3);
  CHECK(seen.size() == 4);
  std::set<double> chosen;
  for (size_t i : selectFront(objectives, 24)) {
    chosen.insert(designs[i][1]);
    CHECK(designs[i][0] == Approx(0.3).margin(0.1));
  }
  CHECK(chosen == std::set<double>{0, 2});
  CHECK_THROWS_AS(searchFront(problem, {SearchAlgorithm::Moead, 24, 3}, 3), std::invalid_argument);
  // One choice alone stays what it is.
  problem.lower[1] = problem.upper[1] = problem.start[1] = 2;
  seen.clear();
  searchFront(problem, {SearchAlgorithm::Nsga2, 8, 3}, 3);
  CHECK(seen == std::set<std::pair<double, double>>{{2, 0}});
}

TEST_CASE("design: searches find a minimum, the same one for the same seed") {
  SearchProblem problem;
  problem.lower = Eigen::Vector2d(-1, 0), problem.upper = Eigen::Vector2d(3, 10), problem.start = Eigen::Vector2d(0, 9);
  std::vector<VectorXd> points;
  problem.objective = [&](const VectorXd& x, const SearchStage&) {
    points.push_back(x);
    return std::pow(x[0] - 1, 2) + std::pow((x[1] - 4) / 3, 2);
  };
  for (SearchAlgorithm global : {SearchAlgorithm::Crs, SearchAlgorithm::Isres})
    for (SearchAlgorithm local : {SearchAlgorithm::Bobyqa, SearchAlgorithm::Sbplx}) {
      const std::vector<SearchStage> stages = {{global, 100, 1e-4}, {local, 150, 1e-6}};
      points.clear();
      const SearchResult result = minimizeByStages(problem, stages, 7);
      CHECK((result.x - Eigen::Vector2d(1, 4)).norm() < 1e-2);
      CHECK(result.evaluations == static_cast<int>(points.size()));
      const std::vector<VectorXd> first = points;
      points.clear();
      minimizeByStages(problem, stages, 7);
      CHECK(points == first);
      points.clear();
      minimizeByStages(problem, stages, 8);
      CHECK(points != first);
    }
  problem.objective = [](const VectorXd&, const SearchStage&) -> double { throw ModelError("a", "b", "c", "d"); };
  CHECK_THROWS_AS(minimizeByStages(problem, {{}}, 1), ModelError);
}

namespace {

bool dominates(const std::vector<double>& a, const std::vector<double>& b) {
  bool better = false;
  for (size_t i = 0; i < a.size(); ++i) {
    if (a[i] > b[i]) return false;
    better |= a[i] < b[i];
  }
  return better;
}

int countDominated(const std::vector<std::vector<double>>& points) {
  return static_cast<int>(std::count_if(points.begin(), points.end(), [&](const auto& b) {
    return std::any_of(points.begin(), points.end(), [&](const auto& a) { return dominates(a, b); });
  }));
}

}  // namespace

TEST_CASE("design: the front of two distances is the line between the points") {
  if (!hasFrontSearch()) return;
  const Eigen::Vector2d a(0.2, 0.3), b(0.8, 0.6);
  std::vector<VectorXd> designs;
  std::vector<std::vector<double>> objectives;
  int batches = 0;
  FrontProblem problem{Eigen::Vector2d(0, 0), Eigen::Vector2d(1, 1), Eigen::Vector2d(1, 0), 2, {}};
  problem.evaluate = [&](const std::vector<VectorXd>& xs) {
    ++batches;
    std::vector<std::vector<double>> out;
    for (const VectorXd& x : xs) {
      out.push_back({(x - a).squaredNorm(), (x - b).squaredNorm()});
      designs.push_back(x);
      objectives.push_back(out.back());
    }
    return out;
  };
  for (SearchAlgorithm algorithm : {SearchAlgorithm::Nsga2, SearchAlgorithm::Moead}) {
    const FrontOptions options{algorithm, 24, 40};
    const auto search = [&](unsigned seed) {
      designs.clear(), objectives.clear(), batches = 0;
      searchFront(problem, options, seed);
      return designs;
    };
    const std::vector<VectorXd> first = search(7);
    CAPTURE(getName(algorithm), designs.size(), batches);
    CHECK(first.front() == problem.start);
    CHECK(first.size() == 24 * 41);
    if (algorithm == SearchAlgorithm::Nsga2) CHECK(batches == 41);
    const std::vector<size_t> front = selectFront(objectives, 24);
    CHECK(front.size() == 24);
    std::vector<std::vector<double>> chosen;
    double gap = 0, off = 0;
    const Eigen::Vector2d along = (b - a).normalized(), across(-along.y(), along.x());
    for (size_t i : front) {
      if (!chosen.empty()) gap = std::max(gap, objectives[i][0] - chosen.back()[0]);
      chosen.push_back(objectives[i]);
      off = std::max(off, std::abs(across.dot(designs[i] - a)));
    }
    CHECK(countDominated(chosen) == 0);
    // A design beside the line by d is dominated by those within 2 d^2 / |b - a| along it: of 24 on 0.67 by one if d > 0.1.
    CHECK(off < 0.1);
    if (algorithm == SearchAlgorithm::Nsga2) CHECK(gap < 0.15);  // of 0.45; the weights of MOEA/D leave wider ones
    CHECK(chosen.front()[0] < 0.01);
    CHECK(chosen.back()[1] < 0.01);
    chosen.push_back({chosen[3][0] + 1e-9, chosen[3][1]});  // would the checks see one?
    CHECK(countDominated(chosen) == 1);
    CHECK(search(7) == first);
    CHECK(search(8) != first);
  }
  problem.evaluate = [](const auto&) -> std::vector<std::vector<double>> { throw ModelError("a", "b", "c", "d"); };
  CHECK_THROWS_AS(searchFront(problem, {}, 1), ModelError);

  const std::vector<std::vector<double>> points = {{3, 1}, {2, 2}, {2, 3}, {1, 4}, {4, 1}, {2.1, 1.9}};
  CHECK(selectFront(points, 10) == std::vector<size_t>{3, 1, 5, 0});
  CHECK(selectFront(points, 3) == std::vector<size_t>{3, 1, 0});
  CHECK(selectFront({{1, 1}}, 5) == std::vector<size_t>{0});
  CHECK(selectFront({}, 5).empty());
}

TEST_CASE("evaluations: what is not one is refused") {
  LoggedEvaluation e{"slsqp", VectorXd::Constant(2, 0.1), DesignStatus::Feasible, 0.75, 1.5, {}, {}, {0.5, 2}, {3}};
  e.terms.push_back({VectorXd::Constant(2, 0.3), MatrixXd::Constant(2, 2, 0.7)});
  const std::string line = formatEvaluation(e);
  CHECK(formatEvaluation(readEvaluation(line)) == line);
  for (const auto& [from, to] : std::vector<std::pair<std::string, std::string>>{{"0.75", "null"},
                                                                                 {"0.75", "NaN"},
                                                                                 {"0.75", "1e999"},
                                                                                 {"[0.7,0.7]", "[0.7]"},
                                                                                 {"[0.7,0.7]", "[0.7,null]"},
                                                                                 {"[[0.7,0.7],", "["},
                                                                                 {"[0.5,2.0]", "[0.5,null]"},
                                                                                 {"[3.0]", "[null]"},
                                                                                 {"feasible", "perfect"},
                                                                                 {"\"value\"", "\"worth\""},
                                                                                 {"}", ""}})
    CHECK_THROWS(readEvaluation(replaceOnce(line, from, to)));
}

namespace {

const char* const kSpec = R"(robot: ROBOT
variables:
  - name: crank
    bounds: [0.03, 0.08]
    length:
      - {from: motor_knee_right, to: transmission_knee_right, across: [0, 0, 1], stretch: knee_crank_right}
      - {from: motor_knee_left, to: transmission_knee_left, across: [0, 0, 1], stretch: knee_crank_left}
  - name: motor
    bounds: [-0.01, 0.01]
    shift: [{of: motor_knee_right, along: [1, 0, 0]}, {of: motor_knee_left, along: [1, 0, 0]}]
motions:
  - {motion: squat, set: {depth: 0.95, duration: 0.6, settle: 0.06, time_step: 0.03}}
objective:
  - {measure: peak_torque, motors: [motor_knee_left, motor_knee_right]}
search:
  searches: 2
  stages:
    - {algorithm: crs, evaluations: 40}
    - {algorithm: sbplx, evaluations: 10}
)";

std::string makeSpec() { return replaceOnce(kSpec, "ROBOT", kRobots + "bipetto"); }

}  // namespace

TEST_CASE("design: a search that is killed goes on and ends the same way") {
  const RobotDirectory directory;
  const std::string spec = directory.write("spec.yaml", makeSpec());
  const std::string whole = directory.path() + "/whole", killed = directory.path() + "/killed";
  const CommandResult first = runCommand({BIELLE_COMMAND, "design", spec, "-o", whole, "--jobs", "1"});
  INFO(first.err);
  REQUIRE(first.status == 0);
  CHECK_THAT(first.out, Contains("infeasible"));

  {
    Command command({BIELLE_COMMAND, "design", spec, "-o", killed});
    REQUIRE(command.waitForOutput("evaluation 20", 120));
    command.sendSignal(9);
    CHECK(command.wait().status == 128 + 9);
  }
  const std::string log = killed + "/search1.jsonl";
  CHECK_FALSE(fs::exists(killed + "/design.md"));
  const int done = countLines(log) - 1;
  CHECK(done > 0);
  CHECK(done < 50);
  std::ofstream(log, std::ios::app) << "{\"stage\": \"cr";  // a line that was not finished
  const CommandResult second = runCommand({BIELLE_COMMAND, "design", spec, "-o", killed});
  INFO(second.err);
  REQUIRE(second.status == 0);
  CHECK_THAT(second.out, !Contains(", 0 of them from the logs"));
  for (const char* file : {"/design.md", "/best/best.urdf", "/best/best.yaml"}) {
    CAPTURE(file);
    CHECK_FALSE(readFile(whole + file).empty());
    CHECK(readFile(whole + file) == readFile(killed + file));
  }
  const bool is_drawn = fs::exists(whole + "/design.svg");  // where there is gnuplot
  for (const char* figure : {"/design.svg", "/design_squat.svg", "/design_mechanism.svg"}) {
    CAPTURE(figure);
    CHECK(fs::exists(whole + figure) == is_drawn);
    CHECK(readFile(whole + figure) == readFile(killed + figure));
    if (is_drawn) CHECK_THAT(readFile(whole + figure), Contains("before") || Contains("best of search 2"));
  }
  CHECK(countLines(log) == countLines(whole + "/search1.jsonl"));

  // The design is a robot, better than the start.
  const std::string page = readFile(whole + "/design.md"), row = "| value | 1 | ";
  REQUIRE_THAT(page, Contains(row));
  CHECK(std::strtod(page.c_str() + page.find(row) + row.size(), nullptr) < 1);
  CHECK_NOTHROW(loadRobot(whole + "/best"));
  CHECK(runCommand({BIELLE_COMMAND, "info", whole + "/best"}).status == 0);

  // The log of another problem is refused.
  directory.write("spec.yaml", replaceOnce(makeSpec(), "evaluations: 40", "evaluations: 41"));
  const CommandResult other = runCommand({BIELLE_COMMAND, "design", spec, "-o", killed});
  CHECK(other.status == 2);
  CHECK_THAT(other.err, Contains("the log is of another design problem"));
}

namespace {

const char* const kFrontSpec = R"(generator: fivebar_leg
variables:
  - {name: upper, parameter: upper_length, bounds: [0.06, 0.14]}
  - {name: lower, parameter: lower_length, bounds: [0.15, 0.25]}
motions:
  - {motion: squat, set: {depth: 0.8}}
objective:
  - {measure: peak_torque}
  - {measure: cost}
search:
  pareto: {population: 12, generations: 4, refine: {algorithm: slsqp, evaluations: 3}}
)";

// The objectives of a table: of the start, then of the front.
std::vector<std::vector<double>> readFront(const std::string& page) {
  std::vector<std::vector<double>> out;
  std::istringstream lines(page.substr(page.find("## Front")));
  for (std::string line, bar, name; std::getline(lines, line);) {
    std::istringstream row(line);
    std::vector<double> values(2);
    if (row >> bar >> name >> bar >> values[0] >> bar >> values[1] && bar == "|") out.push_back(values);
  }
  return out;
}

}  // namespace

TEST_CASE("design: a front that is killed goes on and ends at the same bytes") {
  if (!hasFrontSearch()) return;
  const RobotDirectory directory;
  const std::string spec = directory.write("spec.yaml", kFrontSpec);
  const std::string whole = directory.path() + "/whole", killed = directory.path() + "/killed";
  const CommandResult first = runCommand({BIELLE_COMMAND, "design", spec, "-o", whole, "--jobs", "1"});
  INFO(first.err);
  REQUIRE(first.status == 0);
  const std::string page = readFile(whole + "/design.md");
  const std::vector<std::vector<double>> front = readFront(page);
  REQUIRE(front.size() > 4);
  for (size_t i = 1; i < front.size(); ++i) {
    CAPTURE(i);
    // To the digits of the table, one is better than its neighbours in one way and worse in the other.
    if (i > 1) CHECK(front[i][0] >= front[i - 1][0]);
    if (i > 1) CHECK(front[i][1] < front[i - 1][1]);
    CHECK_NOTHROW(loadRobot(whole + "/front/" + (i < 10 ? "0" : "") + std::to_string(i)));
  }
  CHECK(std::any_of(front.begin() + 1, front.end(), [&](const auto& d) { return dominates(d, front[0]); }));
  CHECK_FALSE(fs::exists(whole + "/front/" + (front.size() < 10 ? "0" : "") + std::to_string(front.size())));
  CHECK(fs::exists(whole + "/design_front.svg") == fs::exists(whole + "/design.svg"));
  CHECK_THAT(readFile(whole + "/front.jsonl"), Contains("slsqp") && Contains("gradients"));

  for (const char* progress : {"nsga2, evaluation 20", "slsqp, evaluation"}) {  // in a generation, in the refinement
    Command command({BIELLE_COMMAND, "design", spec, "-o", killed, "--jobs", "3"});
    REQUIRE(command.waitForOutput(progress, 120));
    command.sendSignal(9);
    CHECK(command.wait().status == 128 + 9);
    CHECK_FALSE(fs::exists(killed + "/design.md"));
  }
  const int done = countLines(killed + "/front.jsonl") - 1;
  const CommandResult last = runCommand({BIELLE_COMMAND, "design", spec, "-o", killed, "--jobs", "2"});
  INFO(last.err);
  REQUIRE(last.status == 0);
  CHECK_THAT(last.out, Contains(", " + std::to_string(done) + " of them from the logs"));
  std::vector<std::string> files = {"/design.md", "/best/best.urdf", "/best/best.yaml", "/front/01/01.urdf",
                                    "/front/02/02.yaml"};
  if (fs::exists(whole + "/design.svg")) files.insert(files.end(), {"/design.svg", "/design_front.svg"});
  for (const std::string& file : files) {
    CAPTURE(file);
    CHECK_FALSE(readFile(whole + file).empty());
    CHECK(readFile(whole + file) == readFile(killed + file));
  }
  // Nothing twice, and nothing else: the same lines but for their order and times.
  const auto list = [&](const std::string& out) {
    std::vector<std::string> lines;
    std::ifstream log(out + "/front.jsonl");
    for (std::string line; std::getline(log, line);)
      if (const size_t at = line.find("\"seconds\""); at != std::string::npos) lines.push_back(line.substr(0, at));
    std::sort(lines.begin(), lines.end());
    return lines;
  };
  const std::vector<std::string> lines = list(whole);
  CHECK(std::adjacent_find(lines.begin(), lines.end()) == lines.end());
  CHECK(list(killed) == lines);
}

TEST_CASE("design: a front with constraints is refined within them, and resumed at the same bytes") {
  if (!hasFrontSearch()) return;
  const RobotDirectory directory;
  std::string text = replaceOnce(kFrontSpec, "population: 12, generations: 4", "population: 8, generations: 2");
  text = replaceOnce(text, "search:\n", "constraints:\n  - {measure: rms_torque, at_most: 0.7}\nsearch:\n");
  const std::string spec = directory.write("spec.yaml", text), whole = directory.path() + "/whole",
                    cut = directory.path() + "/cut";
  const CommandResult first = runCommand({BIELLE_COMMAND, "design", spec, "-o", whole, "--jobs", "2"});
  INFO(first.err << first.out);
  REQUIRE(first.status == 0);
  std::ifstream log(whole + "/front.jsonl");
  std::string line, half;
  std::getline(log, line);
  half = line + "\n";
  int refined = 0, violated = 0, lines = 0;
  while (std::getline(log, line)) {
    const LoggedEvaluation e = readEvaluation(line);
    if (lines++ < 30) half += line + "\n";
    CHECK(isComplete(e, 2, 1));  // what a design that violates the constraint has is in its line, too
    violated += e.status == DesignStatus::Violated && e.constraints.at(0) > 0.7;
    if (e.status != DesignStatus::Feasible) continue;
    CHECK(e.constraints.at(0) < 0.7 * 1.001);
    refined += e.stage == "slsqp" && e.limits.values.size() > 0;
  }
  CHECK(refined > 5);
  CHECK(violated > 0);
  CHECK(lines > 30);
  fs::create_directory(cut);
  std::ofstream(cut + "/front.jsonl", std::ios::binary) << half;
  REQUIRE(runCommand({BIELLE_COMMAND, "design", spec, "-o", cut, "--jobs", "1"}).status == 0);
  for (const char* file : {"/design.md", "/best/best.urdf", "/front/01/01.urdf"}) {
    CAPTURE(file);
    CHECK_FALSE(readFile(whole + file).empty());
    CHECK(readFile(whole + file) == readFile(cut + file));
  }
}

TEST_CASE("design: fronts that cannot be are refused") {
  const RobotDirectory directory;
  const auto check = [&](const std::string& from, const std::string& to, const std::string& problem) {
    const std::string spec =
        directory.write("spec.yaml", from.empty() ? kFrontSpec : replaceOnce(kFrontSpec, from, to));
    const CommandResult result = runCommand({BIELLE_COMMAND, "design", spec, "-o", directory.path() + "/out"});
    CAPTURE(to, result.err);
    CHECK(result.status == 2);
    CHECK_THAT(result.err, Contains(problem) && Contains("line "));
    CHECK_FALSE(fs::exists(directory.path() + "/out"));
  };
  if (!hasFrontSearch()) {
    check("", "", "install libpagmo-dev");
    return;
  }
  check("  - {measure: cost}\n", "", "one objective has no front");
  check("population: 12", "population: 10", "multiple of 4");
  check("{population: 12", "{algorithm: crs, population: 12", "use one of nsga2, moead");
  check("algorithm: slsqp", "algorithm: sbplx", "use one of slsqp, mma");
  check("measure: cost", "measure: conditioning", "which conditioning does not have");
  check("search:\n", "search:\n  searches: 2\n", "it excludes `stages` and `searches`");
  CHECK_THROWS_AS(minimizeByStages({VectorXd::Zero(1), VectorXd::Ones(1), VectorXd::Zero(1), {}, {}},
                                   {{SearchAlgorithm::Nsga2, 10, 0}}, 1),
                  std::invalid_argument);
}

TEST_CASE("design: what is wrong is told with its place and remedy") {
  const RobotDirectory directory;
  const auto check = [&](const std::string& from, const std::string& to, const std::string& problem) {
    const std::string spec = directory.write("spec.yaml", replaceOnce(makeSpec(), from, to));
    const CommandResult result = runCommand({BIELLE_COMMAND, "design", spec, "-o", directory.path() + "/out"});
    CAPTURE(to, result.err);
    CHECK(result.status == 2);
    CHECK_THAT(result.err, Contains(problem));
    CHECK_FALSE(fs::exists(directory.path() + "/out"));
  };
  check("[0.03, 0.08]", "[0.08, 0.03]", "crossed");
  check("[0.03, 0.08]", "[0.06, 0.08]", "outside of its bounds");
  check("[0.03, 0.08]", "[0.03]", "give 2");
  check("to: transmission_knee_right", "to: transmission", "there is no such joint or frame");
  check("from: motor_knee_right", "from: knee_left", "not to 'knee_crank_right'");
  check("stretch: knee_crank_right", "stretch: crank", "there is no such body");
  check("- name: motor\n", "- name: crank\n", "given twice");
  check("motion: squat", "motion: dance", "there is no such motion");
  check("depth: 0.95", "dept: 0.95", "dept");
  check("measure: peak_torque", "measure: peak", "use one of peak_torque, rms_torque");
  check("motors: [motor_knee_left", "motors: [motor_knee", "there is no such motor");
  check("algorithm: crs", "algorithm: newton", "use one of crs");
  check("objective:", "objectiv:", "it is unknown");
  check("depth: 0.95", "depth: 0.05", "start design");
  CHECK_THROWS_AS(readDesignSpec(directory.path() + "/none.yaml"), ModelError);
  DesignVariable unknown;
  unknown.name = "x", unknown.parameter = "no_such", unknown.lower = 0, unknown.upper = 1;
  CHECK_THROWS_WITH(Parametrization("cleobot", {}, {unknown}), Contains("no_such"));
}
