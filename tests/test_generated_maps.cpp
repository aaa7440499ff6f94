// Maps of linkages as generated code between a controller of the serial model and the motors of the closed robot.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cstdlib>
#include <random>
#include <regex>

#include "bielle/dynamics/assembly.h"
#include "bielle/model/builder.h"
#include "formats/mjcf.h"
#include "get_error.h"
#include "motion/posture_lift.h"
#include "own_robots.h"
#include "worlds/execution.h"
#include "worlds/make_world.h"

namespace bielle::worlds {
namespace {

using bielle::testing::getBipetto;
using bielle::testing::getError;
using bielle::testing::loadOwn;

const SerialModel& getSerial() {
  static const SerialModel serial = makeSerialModel(getBipetto(), makeStandingPosture(getBipetto()));
  return serial;
}
const Plan& getWalk() {
  static const Plan plan = [] {
    PlanRequest request{"walk", BIELLE_SOURCE_DIR "/robots/bipetto", {}, 0, Belief::Serial};
    request.settings = {{"speed", 0.1}, {"steps", 2}};
    ControlOptions control;
    control.control = PlanControl::Gains;
    return makePlan(request, control);
  }();
  return plan;
}

const FirmwareText& getText() {
  static const FirmwareText text = [] {
    std::vector<VectorXd> planned;
    for (const Policy::Stage& stage : getWalk().policy.stages()) planned.push_back(stage.q);
    return formatMaps(getBipetto(), getSerial(), planned);
  }();
  return text;
}

// What is wrong with maps, over postures that are drawn around the standing one.
struct MapErrors {
  double joints = 0, joint_speeds = 0, motors = 0, motor_speeds = 0;  // rad, rad/s
  double power = 0;  // of the motors, less that of the torques requested, over the latter's terms
};
MapErrors measureMaps(GeneratedMaps maps) {
  const Model &closed = getBipetto(), &model = getSerial().model;
  PostureLift posture(closed, getSerial());
  std::mt19937 random(1);
  std::uniform_real_distribution<double> draw(-1, 1);
  const auto makeRandom = [&](int size, double most) {
    VectorXd x(size);
    for (double& entry : x) entry = most * draw(random);
    return x;
  };
  const auto raise = [](double& most, double error) { most = error <= most ? most : error; };  // also to NaN
  MapErrors errors;
  const VectorXd standing = restrictConfiguration(closed, model, getSerial().q_reference);
  for (int i = 0; i < 20; ++i) {
    VectorXd q_s = standing;
    for (int j : model.serialJoints()) q_s[model.joints()[j].idx_q] += 0.06 * draw(random);
    if (posture.setConfiguration(q_s, 1e-3) != NumericalStatus::Ok) continue;
    const VectorXd v_s = makeRandom(model.nv(), 2), tau = makeRandom(model.nu(), 5), v = posture.liftVelocity(v_s);
    VectorXd q_found = standing, v_found = VectorXd::Zero(model.nv()), q = closed.makeNeutral(),
             w = VectorXd::Zero(closed.nv()), u(closed.nu());
    // From a guess that is far away; then, as every millisecond, from one that is near.
    for (int call = 0; call < 2; ++call) maps.measure(posture.q(), v, q_found, v_found);
    maps.calcTorques(tau, u);
    maps.lead(q_s, v_s, q, w);
    double given = 0, wanted = 0, terms = 0;
    for (const Motor& motor : model.motors()) {
      const int at = model.joints()[motor.joint].idx_q, m = model.findMotor(motor.name);
      const bool is_mapped = closed.findMotor(motor.name) < 0;
      if (is_mapped) raise(errors.joints, std::abs(q_found[at] - q_s[at]));
      if (is_mapped) raise(errors.joint_speeds, std::abs(v_found[motor.dof] - v_s[motor.dof]));
      wanted += tau[m] * v_s[motor.dof];
      terms += std::abs(tau[m] * v_s[motor.dof]);
    }
    for (const Motor& motor : closed.motors()) {
      const int at = closed.joints()[motor.joint].idx_q, m = closed.findMotor(motor.name);
      const bool is_mapped = model.findMotor(motor.name) < 0;
      if (is_mapped) raise(errors.motors, std::abs(q[at] - posture.q()[at]));
      if (is_mapped) raise(errors.motor_speeds, std::abs(w[motor.dof] - v[motor.dof]));
      given += u[m] * v[motor.dof];
    }
    raise(errors.power, std::abs(given - wanted) / terms);
  }
  CHECK(maps.counts().measured == 20 * 2 * 4);
  CHECK(maps.counts().clamped == 0);
  CHECK(maps.counts().not_reached == 0);
  return errors;
}

// The maps with one line of a source changed.
GeneratedMaps poison(const std::string& file, const std::string& found, const std::string& wrong) {
  FirmwareText text = getText();
  std::string& source = text.files.at(file);
  const std::string poisoned =
      std::regex_replace(source, std::regex(found), wrong, std::regex_constants::format_first_only);
  REQUIRE(poisoned != source);
  source = poisoned;
  return {getBipetto(), getSerial(), Belief::Serial, text};
}

struct Walked {
  Execution execution;
  GeneratedMaps::Counts counts;
};
Walked walk(const std::string& world, const std::optional<GeneratedMaps>& maps) {
  Plan plan = getWalk();
  plan.maps = maps;
  plan.lifted = makeReference(plan.robot.model, *plan.serial, plan.policy, plan.belief, maps);
  ControlOptions control;
  control.control = PlanControl::Gains;
  const PlanController controller = makeController(plan, control);
  Walked walked;
  walked.execution = carryOut(plan, *controller.law, *makeWorld(world, plan.robot.model, {plan.ground, 0, nullptr, 0}));
  if (maps) walked.counts = controller.maps->counts();
  return walked;
}

// Between two motions at their ends: of the base's place, m, and of any serial joint, rad.
double calcApart(const Execution& a, const Execution& b) {
  REQUIRE(a.record.q.rows() == b.record.q.rows());
  const auto getEnd = [](const RowMatrixXd& q) {
    return restrictConfiguration(getBipetto(), getSerial().model, q.bottomRows<1>().transpose());
  };
  return (getEnd(a.record.q) - getEnd(b.record.q)).cwiseAbs().maxCoeff();
}

// Compiled once.
const GeneratedMaps& getMaps() {
  static const GeneratedMaps maps(getBipetto(), getSerial(), Belief::Serial, getText());
  return maps;
}
const GeneratedMaps& getWrongMaps() {
  static const GeneratedMaps maps = poison("knee_left.c", R"(ratio->joint_per_motor\[0\]\[0\] = )", "$&1.001 * ");
  return maps;
}

// By what the end moves, over the relative error of a map: about 1.
double calcGrowth(const Execution& right) { return calcApart(right, walk("bielle", getWrongMaps()).execution) / 1e-3; }

}  // namespace

// The mechanism is closed to 1e-12 at its joints; the maps are exact to rounding, and rates are worse by their size.
TEST_CASE("generated maps: joints, motors, speeds and torques are those of the mechanism") {
  const MapErrors errors = measureMaps(getMaps());
  CHECK(errors.joints < 1e-10);
  CHECK(errors.motors < 1e-10);
  CHECK(errors.joint_speeds < 1e-9);
  CHECK(errors.motor_speeds < 1e-9);
  CHECK(errors.power < 1e-10);
}

TEST_CASE("generated maps: a poisoned coefficient is noticed") {
  const MapErrors joints =
      measureMaps(poison("knee_left.c", R"(at->joint\[0\] = (?!-?[0-9.e-]+;|limit))", "$&1e-6 + "));
  CHECK(joints.joints > 1e-7);
  const MapErrors ratio = measureMaps(getWrongMaps());
  CHECK(ratio.joint_speeds > 1e-4);
  CHECK(ratio.power > 1e-5);
}

TEST_CASE("generated maps: a constant ratio is that of the standing posture", "[long]") {
  CHECK(measureMaps({getBipetto(), getSerial(), Belief::Ratio, getText()}).power > 1e-3);
}

TEST_CASE("generated maps: a walk through them ends as one through the library's") {
  const Walked library = walk("bielle", {}), generated = walk("bielle", getMaps());
  REQUIRE(library.execution.outcome == Outcome::Stood);
  CHECK(generated.execution.outcome == Outcome::Stood);
  CHECK(generated.counts.measured > 4000);
  CHECK(generated.counts.clamped + generated.counts.not_reached == 0);
  CHECK(generated.counts.largest_difference < 1e-11);
  const double growth = calcGrowth(generated.execution);
  CHECK(growth > 0.1);
  // Four maps, there and back.
  CHECK(calcApart(library.execution, generated.execution) < 10 * growth * generated.counts.largest_difference);
}

// Loops gape there, and joints are not where their motors say: by gaps that open and close within the time constant of the closures,
// so that speeds of about 1 rad/s are off as well.
TEST_CASE("generated maps: nor do they lead elsewhere in MuJoCo's world", "[long]") {
  const std::vector<std::string> worlds = listWorlds();
  if (std::find(worlds.begin(), worlds.end(), "mujoco") == worlds.end()) return;
  const Walked soft = walk("mujoco", {}), generated = walk("mujoco", getMaps());
  REQUIRE(soft.execution.outcome == Outcome::Stood);
  CHECK(generated.execution.outcome == Outcome::Stood);
  CHECK(generated.counts.clamped + generated.counts.not_reached == 0);
  CHECK(generated.counts.largest_difference < 1e-4);
  const double speed_error = generated.counts.largest_difference / MjcfOptions().closure_time;
  CHECK(calcApart(soft.execution, generated.execution) < calcGrowth(walk("bielle", getMaps()).execution) * speed_error);
}

TEST_CASE("generated maps: what cannot be generated, compiled or loaded is told") {
  const Model& closed = getBipetto();
  const auto make = [&](const FirmwareText& text) {
    return getError([&] { GeneratedMaps(closed, getSerial(), Belief::Serial, text); });
  };
  FirmwareText text = getText();
  REQUIRE(text.linkages.size() == 4);
  text.linkages.pop_back();
  CHECK_THAT(make(text), Catch::Contains("its linkage has no generated maps") && Catch::Contains("--maps library"));
  ModelParts parts = takeParts(loadOwn("fourbar").model);
  for (Joint& joint : parts.joints)
    if (joint.name == "rocker_joint") joint.name = "rocker-joint";
  for (Reference& reference : parts.references) reference.joints.erase("rocker_joint");
  const Model renamed = ModelBuilder::restore(parts);
  const SerialModel serial = makeSerialModel(renamed, findClosedConfiguration(renamed).q);
  CHECK_THAT(getError([&] { formatMaps(renamed, serial, {}); }),
             Catch::Contains("joint 'rocker-joint': there are no generated maps") && Catch::Contains("--maps library"));
  const char* before = std::getenv("CC");
  const std::string usual = before ? before : "cc";
  for (const auto& [compiler, said] : {std::pair("no-such-compiler", "there is no compiler 'no-such-compiler'"),
                                       {"false", "the compiler 'false' failed, with status 1"}}) {
    setenv("CC", compiler, 1);
    CHECK_THAT(make(getText()), Catch::Contains(said) && Catch::Contains("CC"));
  }
  setenv("CC", usual.c_str(), 1);
}

}  // namespace bielle::worlds
