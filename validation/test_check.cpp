// Oracles: a pendulum integrated from its equation of motion, motions poisoned one number at a time, inconsistent
// files.
#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <regex>

#include "bielle/model/error.h"
#include "bielle/robots/robot_loader.h"
#include "check_trace.h"
#include "run_command.h"
#include "selection.h"
#include "test_motions.h"

namespace fs = std::filesystem;
using namespace bielle;
using namespace bielle::testing;
using namespace bielle::validation;

TEST_CASE("check: a squat of Bipetto passes, in both formulations") {
  for (const Formulation formulation : {Formulation::Reduced, Formulation::Full}) {
    const SolvedSquat& squat = getSquat(formulation);
    CHECK(squat.summary.termination == FddpTermination::Converged);
    const CheckReport report = checkMotion(squat.checked);
    INFO(print(report));
    CHECK(getFailures(report) == Names());
    CHECK(getValue(report, "equations of motion") > 0);
    CHECK(getValue(report, "energy, whole motion") > 0);
  }
}

TEST_CASE("check: the same squat by midpoint steps, and each number of its midpoints poisoned", "[long]") {
  for (const Formulation formulation : {Formulation::Reduced, Formulation::Full}) {
    const SolvedSquat& squat = getSquat(formulation, StepRule::Midpoint);
    CHECK(squat.summary.termination == FddpTermination::Converged);
    const CheckReport report = checkMotion(squat.checked), euler = checkMotion(getSquat(formulation).checked);
    INFO(print(report) << print(euler));
    CHECK(getFailures(report) == Names());
    for (const char* name : {"finite differences of the velocity", "standing feet: slip", "standing feet: slip, angle",
                             "standing feet: off the ground"})
      CHECK(report.findRow(name)->bound == Approx(euler.findRow(name)->bound / 10));
  }
  const CheckedMotion good = getMidpointSquat().checked;
  const int node = 30;  // on the way down
  const auto getNewFailures = [&](const std::function<void(CheckedMotion&)>& poison) {
    CheckedMotion motion = good;
    poison(motion);
    return getFailures(checkMotion(motion));
  };
  const int hip = good.model.joints()[good.model.findJoint("hipy_left")].idx_v;
  const int hip_q = good.model.joints()[good.model.findJoint("hipy_left")].idx_q;
  const int knee_q = good.model.joints()[good.model.findJoint("motor_knee_left")].idx_q;
  const Names moved = {"equations of motion", "accelerations, against Simbody's", "steps of the velocity",
                       "steps of the configuration"};
  CHECK(getNewFailures([&](CheckedMotion& m) { m.record.q_mid(node, hip_q) += 1e-4; }) == moved);
  CHECK(getNewFailures([&](CheckedMotion& m) { m.record.q_mid(node, knee_q) += 1e-4; }).count("loops: gap") == 1);
  CHECK(getNewFailures([&](CheckedMotion& m) {
          m.record.v_mid(node, hip) += 1e-2;
        }).count("accelerations, against Simbody's") == 1);
  CHECK(getNewFailures([&](CheckedMotion& m) { m.record.a(node, hip) += 1e-3; }) ==
        Names{"equations of motion", "steps of the velocity"});
  CHECK(getNewFailures([&](CheckedMotion& m) {
          m.record.q(node, hip_q) += 1e-4;
        }).count("steps of the configuration") == 1);
  CHECK(getNewFailures([&](CheckedMotion& m) { m.record.v_mid(node, 3) = std::nan(""); }) ==
        Names{"numbers not finite"});
  CheckedMotion renamed = good;
  renamed.summary.step = StepRule::Euler;
  CHECK_THROWS_WITH(checkMotion(renamed), Catch::Contains("'step'") && Catch::Contains("midpoints"));
}

TEST_CASE("check: a swinging four-bar by midpoint steps, of second order") {
  for (const Formulation formulation : {Formulation::Reduced, Formulation::Full}) {
    const CheckReport coarse = checkMotion(makeFourBarMotion(4e-3, formulation, nullptr, StepRule::Midpoint));
    const CheckReport fine = checkMotion(makeFourBarMotion(2e-3, formulation, nullptr, StepRule::Midpoint));
    const CheckReport euler = checkMotion(makeFourBarMotion(2e-3, formulation));
    INFO(print(coarse) << print(fine) << print(euler));
    const char* name = "finite differences of the velocity";  // of the full formulation they vanish
    if (formulation == Formulation::Reduced)
      CHECK(getValue(fine, name) == Approx(getValue(coarse, name) / 4).epsilon(0.1));
  }
}

namespace {

double calcMissingEnergy(const MotionTrace& trace, int k) {
  const StageTrace& stage = trace.stages[k];
  return trace.nodes[k + 1].kinetic - trace.nodes[k].kinetic - stage.motor_work - stage.contact_work -
         stage.closure_work - stage.passive_work;
}

}  // namespace

TEST_CASE("check: a midpoint step loses no more than Eq. (12) says, and that is of third order") {
  for (const Formulation formulation : {Formulation::Reduced, Formulation::Full}) {
    double total[2];
    for (int i : {0, 1}) {
      const double h = 4e-3 / (1 + i);
      const MotionTrace trace = traceMotion(makeFourBarMotion(h, formulation, nullptr, StepRule::Midpoint));
      double mean = total[i] = 0;
      for (const StageTrace& stage : trace.stages) mean += stage.energy_scale / trace.stages.size();
      for (int k = 0; k < static_cast<int>(trace.stages.size()); ++k) {
        const double missing = calcMissingEnergy(trace, k), scale = trace.stages[k].energy_scale;
        CAPTURE(getName(formulation), h, k, missing, scale, mean);
        CHECK(std::abs(missing) < 1.2 * scale + 0.05 * mean);
        total[i] += scale;
      }
    }
    CHECK(total[1] == Approx(total[0] / 4).epsilon(0.05));  // twice as many steps of an eighth each
  }
}

TEST_CASE("check: a pendulum by Euler steps passes; the exact one keeps all but them, at first order") {
  const CheckReport steps = checkMotion(makePendulumMotion(1e-3, false));
  INFO(print(steps));
  CHECK(steps.passed());
  const CheckReport coarse = checkMotion(makePendulumMotion(2e-3, true)),
                    fine = checkMotion(makePendulumMotion(1e-3, true));
  INFO(print(fine));
  CHECK(getFailures(fine) == Names{"steps of the velocity", "steps of the configuration"});
  for (const char* name : {"finite differences of the velocity", "steps of the velocity"})
    CHECK(getValue(coarse, name) == Approx(2 * getValue(fine, name)).epsilon(0.02));
}

TEST_CASE("check: a swinging four-bar passes, its defect shrinks with the step") {
  for (const Formulation formulation : {Formulation::Reduced, Formulation::Full}) {
    const CheckReport coarse = checkMotion(makeFourBarMotion(5e-4, formulation));
    const CheckReport fine = checkMotion(makeFourBarMotion(2.5e-4, formulation));
    INFO(print(coarse) << print(fine));
    CHECK(coarse.passed());
    CHECK(fine.passed());
    const std::string name = formulation == Formulation::Reduced ? "finite differences of the velocity" : "loops: gap";
    CHECK(getValue(fine, name) < 0.6 * getValue(coarse, name));
    // Relative to a bound that halves with the step, as the defect does.
    CHECK(getValue(fine, "energy, whole motion") == Approx(getValue(coarse, "energy, whole motion")).epsilon(0.05));
  }
}

TEST_CASE("check: each poisoned number makes its rows fail and no other", "[sweep]") {
  const CheckedMotion good = getSquat().checked;
  Selection selection;
  const auto expect = [&good, &selection](const Names& names, const std::function<void(CheckedMotion&)>& poison) {
    if (selection.isLeftOut()) return;
    CheckedMotion motion = good;
    poison(motion);
    const CheckReport report = checkMotion(motion);
    INFO(print(report));
    CHECK(getFailures(report) == names);
  };
  const Model& model = good.model;
  const int node = 30;  // on the way down
  const Joint& hip = model.joints()[model.findJoint("hipy_left")];
  const int knee = model.joints()[model.findJoint("motor_knee_left")].idx_q;
  const int foot = 6 * model.findContact("foot_left");
  const Names steps = {"equations of motion", "steps of the velocity", "steps of the configuration"};
  Names moved = steps;
  moved.insert("centre of mass, as recorded");
  expect(moved, [&](CheckedMotion& m) { m.record.q(node, hip.idx_q) += 1e-4; });
  expect(steps, [&](CheckedMotion& m) { m.record.v(node, hip.idx_v) += 1e-4; });
  expect({"equations of motion", "steps of the velocity"},
         [&](CheckedMotion& m) { m.record.a(node, hip.idx_v) += 1e-3; });
  expect({"equations of motion"}, [&](CheckedMotion& m) { m.record.u(node, 3) += 1e-3; });
  expect({"equations of motion"}, [&](CheckedMotion& m) { m.record.contact_wrenches(node, foot + 2) += 0.1; });
  expect({"equations of motion"}, [&](CheckedMotion& m) { m.record.closure_wrenches(node, 1) += 0.1; });
  expect({"centre of mass, as recorded", "equations of motion", "steps of the velocity", "steps of the configuration",
          "loops: gap", "loops: gap, angle", "loops: opening velocity"},
         [&](CheckedMotion& m) { m.record.q(node, knee) += 1e-4; });
  expect({"time between nodes"}, [&](CheckedMotion& m) { m.record.time[node] += 1e-6; });
  expect({"contact: tangential over normal", "contact: wrench cone of the sole"},
         [&](CheckedMotion& m) { m.summary.ground.friction = 1e-4; });
  expect({"standing feet: off the ground"}, [&](CheckedMotion& m) { m.summary.ground.height = 3e-3; });
  // A gap of 2 cm under the middle of a sole, out of the way of its corners.
  expect({"standing feet: off the ground"}, [&](CheckedMotion& m) {
    const Vector3d p = m.summary.phases[0].stances[0].X_WT.p;
    m.summary.ground.height = p.z() - 0.2;
    for (double side : {-1, 1}) m.summary.ground.steps.push_back({p + Vector3d(side * 1.01, 0, 0), 2, 4, 0});
  });
  expect({"contact: least normal force", "contact: pressure beyond the sole", "contact: wrench cone of the sole",
          "equations of motion"},
         [&](CheckedMotion& m) { m.record.contact_wrenches(node, foot + 2) = -0.1; });
  expect({"contact: pressure beyond the sole", "contact: wrench cone of the sole", "equations of motion"},
         [&](CheckedMotion& m) { m.record.contact_wrenches(node, foot + 4) = 10; });
  // The torque about the normal alone: a sole bears at most 0.07 m times its load, less with a tangential force.
  const double load = good.record.contact_wrenches(node, foot + 2);
  expect({"contact: wrench cone of the sole", "equations of motion"},
         [&](CheckedMotion& m) { m.record.contact_wrenches(node, foot + 5) = 0.071 * load; });
  expect({"equations of motion"}, [&](CheckedMotion& m) { m.record.contact_wrenches(node, foot + 5) = 0.06 * load; });
  expect({"numbers not finite"}, [&](CheckedMotion& m) { m.record.v(node, 3) = std::nan(""); });
}

TEST_CASE("check: a foot that slides, and one that is said to be in the air") {
  CheckedMotion sliding = getSquat().checked;
  for (int k = 0; k <= sliding.numStages(); ++k) sliding.record.q(k, 0) += 4e-5 * k;  // 4 mm, at a speed that v lacks
  const CheckReport slid = checkMotion(sliding);
  INFO(print(slid));
  // The recorded accelerations draw the feet back along the gaps that they had.
  CHECK(getFailures(slid) == Names{"centre of mass, as recorded", "accelerations, against Simbody's",
                                   "standing feet: slip", "steps of the velocity", "steps of the configuration"});

  CheckedMotion lifted = getSquat().checked;
  const auto stances = lifted.summary.phases[0].stances;
  const double h = lifted.getTimeStep(0);
  lifted.summary.phases = {
      {"both", 0, 40, h, stances}, {"one", 40, 20, h, {stances[0]}}, {"both", 60, lifted.numStages() - 60, h, stances}};
  const CheckReport report = checkMotion(lifted);
  INFO(print(report));
  for (const char* name : {"swinging feet: clearance", "contact: force in the air", "equations of motion"})
    CHECK(getFailures(report).count(name) == 1);
  CHECK(std::abs(getValue(report, "swinging feet: least height")) < 1e-3);
  CHECK(getValue(report, "landing velocity") < 0.02);
}

TEST_CASE("check: of a motion carried out, what its record tells is judged, and the rest informs") {
  CheckedMotion motion = getSquat().checked;
  motion.has_happened = true;
  motion.record.closure_wrenches.setConstant(std::nan(""));
  const int node = 40, knee = motion.model.joints()[motion.model.findJoint("motor_knee_left")].idx_q;
  const auto check = [](const CheckedMotion& checked, const Names& failures) {
    const CheckReport report = checkMotion(checked);
    INFO(print(report));
    CHECK(getFailures(report) == failures);
    CHECK(report.findRow("equations of motion") == nullptr);
    return report;
  };
  check(motion, {});
  CheckedMotion weak = motion, open = motion, moved = motion, unknown = motion;
  weak.record.v.row(node).setConstant(0.1);  // feet slip, bodies run into each other
  check(weak, {});
  open.record.q(node, knee) += 1e-4;
  CHECK(getValue(check(open, {"centre of mass, as recorded"}), "loops: gap") > 1e-6);
  open.record = motion.record;
  open.record.gap(node, 0) += 1e-6;
  CHECK(getValue(check(open, {}), "loops: gap, as recorded") == Approx(1e-6).epsilon(0.01));
  moved.record.com(node, 2) += 1e-6;
  check(moved, {"centre of mass, as recorded"});
  unknown.record.contact_wrenches.setConstant(std::nan(""));
  const CheckReport blind = check(unknown, {});
  for (const char* name : {"standing feet: slip", "contact: tangential over normal", "contact: force in the air"})
    CHECK_FALSE(blind.findRow(name)->value);
  unknown.record.contact_wrenches(node, 2) = 1;
  check(unknown, {"numbers not finite"});
}

TEST_CASE("check: a pendulum keeps its energy, but for the work of its motor and of a push") {
  CheckedMotion motion = makePendulumMotion(0.01, true);
  motion.has_happened = true;
  const char* gained = "energy, beyond the motors' work";
  CHECK(getValue(checkMotion(motion), gained) < 1e-6);
  CheckedMotion driven = motion, pushed = motion;
  driven.record.u.setConstant(2);  // had it acted against the swing, the rod would have ended with less
  const double way = motion.record.q.col(0).maxCoeff() - motion.record.q.col(0).minCoeff();
  CHECK(getValue(checkMotion(driven), gained) == Approx(2 * way).epsilon(0.01));
  const double faster = 0.3, before = motion.record.v(50, 0);
  pushed.record.v.col(0).tail(pushed.numStages() + 1 - 50).array() += faster;
  const CheckReport report = checkMotion(pushed);
  const double inertia = 1.3 * kLength * kLength / 3;
  CHECK(getValue(report, gained) >= Approx(inertia * (before * faster + faster * faster / 2)).epsilon(1e-6));
}

TEST_CASE("check: limits of joints and motors, and soles that overlap") {
  const auto read = [](const char* name) {
    std::ifstream file(findBipetto() + "/" + name);
    return std::string(std::istreambuf_iterator<char>(file), {});
  };
  const auto check = [](const std::string& urdf, const std::string& yaml) {
    const RobotDirectory directory;
    CheckedMotion motion = getSquat().checked;
    motion.model = loadRobot(directory.writeRobot(urdf, yaml)).model;
    return checkMotion(motion);
  };
  const std::string urdf = read("bipetto.urdf"), yaml = read("bipetto.yaml");
  const std::regex motors("effort=\"1e16\" velocity=\"1e16\""), range("upper=\"0.523599\""),
      sole("sole: \\[0.10, 0.10\\]");
  CHECK(getFailures(check(std::regex_replace(urdf, motors, "effort=\"20\" velocity=\"30\""), yaml)) == Names());
  CHECK(getFailures(check(std::regex_replace(urdf, motors, "effort=\"14\" velocity=\"30\""), yaml)) ==
        Names{"motors: effort over limit"});
  CHECK(getFailures(check(std::regex_replace(urdf, motors, "effort=\"20\" velocity=\"1\""), yaml)) ==
        Names{"joints: velocity over limit", "motors: velocity over limit"});
  CHECK(getFailures(check(std::regex_replace(urdf, range, "upper=\"0.0001\""), yaml)) ==
        Names{"joints: beyond their range"});
  CHECK(getFailures(check(urdf, std::regex_replace(yaml, sole, "sole: [0.10, 0.40]"))) ==
        Names{"distance of the soles"});
}

TEST_CASE("check: a limit may be exceeded by what a converged solver leaves, and by no more") {
  CheckedMotion motion = getSquat().checked;
  const int m = motion.model.findMotor("motor_knee_left"), dof = motion.model.motors()[m].dof;
  const double torque = motion.record.u.col(m).cwiseAbs().maxCoeff(),
               speed = motion.record.v.col(dof).cwiseAbs().maxCoeff();
  const auto check = [&](double effort, double velocity) {
    ModelParts parts = takeParts(getSquat().checked.model);
    parts.motors[m].effort_limit = effort;
    parts.motors[m].velocity_limit = velocity;
    motion.model = ModelBuilder::restore(parts);
    return getFailures(checkMotion(motion));
  };
  CHECK(check((1 - 1e-8) * torque, (1 - 1e-8) * speed) == Names());
  CHECK(check((1 - 1e-5) * torque, speed) == Names{"motors: effort over limit"});
  CHECK(check(torque, (1 - 1e-5) * speed) == Names{"motors: velocity over limit"});
}

TEST_CASE("check: voltages and heat of motors, where their windings are known") {
  CheckedMotion motion = getMidpointSquat().checked;
  const char *voltage = "motors: voltage over supply", *heat = "motors: rms torque over thermal";
  const CheckReport without = checkMotion(motion);
  CHECK_FALSE(without.findRow(voltage)->value);
  CHECK_FALSE(without.findRow(heat)->value);
  const int m = motion.model.findMotor("motor_knee_left"), dof = motion.model.motors()[m].dof;
  ModelParts parts = takeParts(motion.model);
  Motor& motor = parts.motors[m];
  motor.drive.ratio = 9;
  motor.drive.torque_constant = 0.1;
  motor.drive.resistance = 0.5;
  motor.drive.efficiency = 0.9;
  motor.drive.back_efficiency = 0.8;
  double largest = 0, heats = 0, time = 0;
  for (int k = 0; k < motion.numStages(); ++k) {
    const double u = motion.record.u(k, m), w = motion.record.v_mid(k, dof), c = u * w < 0 ? 0.8 : 1 / 0.9;
    const double h = motion.record.time[k + 1] - motion.record.time[k];
    largest = std::max(largest, std::abs(0.5 * c * u / 0.9 + 0.9 * w));
    heats += h * c * u * c * u;
    time += h;
  }
  const auto check = [&](double volts, double continuous) {
    motor.drive.voltage = volts;
    motor.continuous_effort = continuous;
    motion.model = ModelBuilder::restore(parts);
    return checkMotion(motion);
  };
  const double rms = std::sqrt(heats / time);
  const CheckReport good = check(largest, (1 + 1e-9) * rms);
  CHECK(getFailures(good) == Names());
  CHECK(getValue(good, voltage) == Approx(1));
  CHECK(getValue(good, heat) == Approx(1));
  CHECK(getFailures(check(0.999 * largest, 1.001 * rms)) == Names{voltage});
  CHECK(getFailures(check(1.001 * largest, 0.999 * rms)) == Names{heat});
}

TEST_CASE("check: files that are missing, broken or of another robot are refused") {
  const RobotDirectory directory;
  const auto refuse = [&directory](const std::string& what) {
    CHECK_THROWS_WITH(readMotion(directory.path()), Catch::Contains(what));
    CHECK_THROWS_AS(readMotion(directory.path()), InputError);
  };
  refuse("summary.json");
  using Json = nlohmann::json;
  const fs::path solved = getSquat().directory.path();
  const Json good = Json::parse(std::ifstream(solved / "summary.json"));
  const auto write = [&directory](const Json& json) { directory.write("summary.json", json.dump()); };
  write(good);
  refuse("trajectory.npz");
  fs::copy(solved / "trajectory.npz", directory.path());
  CHECK_NOTHROW(readMotion(directory.path()));
  const auto poison = [&](const char* pointer, const Json& value, const std::string& what) {
    Json bad = good;
    bad[Json::json_pointer(pointer)] = value;
    write(bad);
    refuse(what);
  };
  poison("/phases/0/start_node", 1, "does not start");
  poison("/phases/0/nodes", 99, "not as long");
  poison("/phases/0/nodes", 101, "do not fit");
  poison("/phases/0/nodes", -3, "not a number of nodes");
  poison("/phases", Json::array(), "not as long");
  poison("/phases/0/contacts/0/name", "hand", "no contact 'hand'");
  poison("/phases/0/contacts/0/name", "foot_right", "stands twice");
  poison("/phases/0/time_step_s", -1, "time_step_s");
  poison("/phases/0/time_step_s", "soon", "summary.json");
  poison("/ground/friction", -1, "friction");
  poison("/ground", 7, "summary.json");
  poison("/model", "serial", "not those of the robot");
  poison("/robot_file", std::string(BIELLE_SOURCE_DIR) + "/robots/fourbar/fourbar.urdf", "not those of the robot");
  directory.write("summary.json", "{");
  refuse("summary.json");
  write(good);
  directory.write("trajectory.npz", "PK but no archive");
  refuse("trajectory.npz");
}

TEST_CASE("check: the program writes check.json and tells by its status") {
  const RobotDirectory directory;
  const fs::path solved = getSquat().directory.path();
  for (const char* name : {"summary.json", "trajectory.npz"}) fs::copy(solved / name, directory.path());
  const CommandResult passed = runCommand({BIELLE_CHECK, directory.path(), "--json"});
  INFO(passed.out << passed.err);
  CHECK(passed.status == 0);
  const auto json = nlohmann::json::parse(passed.out);
  CHECK(json == nlohmann::json::parse(std::ifstream(fs::path(directory.path()) / "check.json")));
  CHECK(json.at("pass") == true);
  for (const auto& row : json.at("rows"))
    for (const char* key : {"name", "value", "bound", "unit", "pass", "note"}) CHECK(row.contains(key));

  auto summary = nlohmann::json::parse(std::ifstream(solved / "summary.json"));
  summary["ground"]["friction"] = 0;
  directory.write("summary.json", summary.dump());
  const CommandResult failed = runCommand({BIELLE_CHECK, directory.path(), "--brief"});
  CHECK(failed.status == 1);
  CHECK_THAT(failed.out, Catch::Contains("FAIL") && Catch::Contains("tangential"));
  CHECK(nlohmann::json::parse(std::ifstream(fs::path(directory.path()) / "check.json")).at("pass") == false);

  const CommandResult refused = runCommand({BIELLE_CHECK, directory.path() + "/nowhere"});
  CHECK(refused.status == 2);
  CHECK(refused.out.empty());
  CHECK_THAT(refused.err, Catch::StartsWith("bielle: error: "));
}
