// `bielle solve`, run like a user does: its files, its messages, its exit status.
#include <signal.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>

#include "bielle/motion/record.h"
#include "bielle/motion/squat.h"
#include "bielle/robots/robot_loader.h"
#include "cli_command.h"
#include "motion/refinement.h"
#include "robot_directory.h"

namespace fs = std::filesystem;
using namespace bielle;
using namespace bielle::testing;
using nlohmann::json;

TEST_CASE("solve writes a converged squat and says so") {
  const OutputDirectory directory;
  const CommandResult result = run(makeShortSquat(directory.str()));
  INFO(result.out << result.err);
  CHECK(result.status == 0);
  CHECK_THAT(result.out, Catch::Contains("iter") && Catch::Contains("converged") && Catch::Contains("peak torques"));
  const json summary = directory.readSummary();
  const MotionRecord record = directory.readTrajectory();
  CHECK(summary["converged"] == true);
  CHECK(summary["interrupted"] == false);
  CHECK(summary["formulation"] == "reduced");
  CHECK(summary["options"]["duration"] == 0.6);
  CHECK(summary["options"]["depth"] == 0.95);
  CHECK(summary["command"].size() == kShortSquat.size() + 2);
  CHECK(record.time.size() == 31);
  CHECK(summary["closure_gap"]["position_m"] == record.gap.col(0).maxCoeff());
  CHECK(record.gap.maxCoeff() < 1e-9);
  const auto& motors = record.u_names;
  const auto knee = std::find(motors.begin(), motors.end(), "motor_knee_left") - motors.begin();
  CHECK(summary["peak_torques"]["motor_knee_left"] == record.u.col(knee).cwiseAbs().maxCoeff());
  // The feet carry the weight of a robot that ends where it began.
  CHECK(record.com.col(2).minCoeff() < 0.97 * record.com(0, 2));
  const Model model = loadRobot("bipetto").model;
  const double mean = (record.contact_wrenches.col(2) + record.contact_wrenches.col(8)).mean();
  CHECK(mean == Approx(model.mass() * 9.81).epsilon(0.02));

  const CommandResult quiet = run(makeShortSquat(directory.str(), {"--quiet", "--threads", "1"}));
  CHECK(quiet.status == 0);
  CHECK_THAT(quiet.out, !Catch::Contains("iter ") && Catch::Contains("converged"));
  CHECK(directory.readTrajectory().u == record.u);  // whatever the number of threads
}

TEST_CASE("solve prints requested and achieved values; a goal that is missed is a warning, not a failure") {
  const OutputDirectory directory;
  const CommandResult met = run(makeShortSquat(directory.str(), {"--quiet"}));
  INFO(met.out << met.err);
  CHECK(met.status == 0);
  CHECK_THAT(met.out, Catch::Contains("  depth  ") && Catch::Contains("  requested 0.95, achieved 0.9") &&
                          !Catch::Contains("missed"));
  CHECK_THAT(met.err, !Catch::Contains("warning"));
  CHECK(directory.readSummary()["goals"][0]["met"] == true);
  const CommandResult missed = run(makeShortSquat(directory.str(), {"--quiet", "--set", "com_weight=1"}));
  INFO(missed.out << missed.err);
  CHECK(missed.status == 0);
  CHECK_THAT(missed.out, Catch::Contains("missed (tolerance 0.01)"));
  CHECK_THAT(missed.err, Catch::Contains("bielle: warning: depth: requested 0.95, achieved "));
  const json goal = directory.readSummary()["goals"][0];
  CHECK(goal["met"] == false);
  CHECK(goal["requested"] == 0.95);
  CHECK(goal["achieved"] > 0.96);
}

TEST_CASE("solve minimizes energy or peak torque, from the motion of least effort or another result") {
  const OutputDirectory directory;
  const std::string effort = directory.str() + "/effort", other = directory.str() + "/other";
  const auto getEnergy = [](const json& summary) { return summary["electrical_energy"]["total_J"].get<double>(); };
  const auto readSummary = [](const std::string& path) { return json::parse(std::ifstream(path + "/summary.json")); };
  CHECK(run(makeShortSquat(effort, {"--quiet"})).status == 0);
  const json first = readSummary(effort);
  CHECK(first["objective"]["kind"] == "effort");
  CHECK(first["electrical_energy"]["cost_of_transport"].is_null());
  CHECK(first["electrical_energy"]["motors_of_assumed_loss"] == 12);
  for (const std::string objective : {"energy", "peak-torque"}) {
    const CommandResult result = run(makeShortSquat(other, {"--objective", objective}));
    INFO(result.out << result.err);
    CHECK(result.status == 0);
    CHECK_THAT(result.out, Catch::Contains("starting with the motion of least effort") &&
                               Catch::Contains("electrical energy") &&
                               Catch::Contains("losses of 12 motors assumed: 0.25"));
    const json summary = readSummary(other);
    CHECK(summary["objective"]["kind"] == objective);
    const auto getPeak = [](const json& of) {
      double peak = 0;
      for (const auto& [motor, value] : of["peak_torques"].items()) peak = std::max(peak, value.get<double>());
      return peak;
    };
    if (objective == "energy") CHECK(getEnergy(summary) < 0.95 * getEnergy(first));
    if (objective == "peak-torque") CHECK(getPeak(summary) < 0.95 * getPeak(first));
    // From the files of the same effort: the same problem, but for a scale that is taken where the base of a warm start is,
    // by the slip of the feet (3e-6 m) from that of the effort.
    const CommandResult warm =
        run(makeShortSquat(other, {"--quiet", "--objective", objective, "--warm-start", effort}));
    CHECK(warm.status == 0);
    CHECK_THAT(warm.out, !Catch::Contains("least effort"));
    CHECK(readSummary(other)["cost"].get<double>() == Approx(summary["cost"].get<double>()).epsilon(1e-4));
  }
  checkRefused(run(makeShortSquat(other, {"--objective", "time"})), "effort,energy,peak-torque");
  checkRefused(run(makeShortSquat(other, {"--objective", "energy", "--regularization", "-1"})), "regularization");
  checkRefused(run(makeShortSquat(other, {"--regeneration", "2"})), "regeneration");
}

TEST_CASE("solve ends by the check of its result, whose failure is its own") {
  const OutputDirectory directory;
  fs::create_directory(directory.str());
  const std::string copy = directory.str() + "/bielle", checker = directory.str() + "/bielle-check";
  fs::copy_file(BIELLE_COMMAND, copy);
  std::vector<std::string> arguments = makeShortSquat(directory.str() + "/motion");
  arguments.erase(std::find(arguments.begin(), arguments.end(), "--no-check"));
  arguments.insert(arguments.begin(), copy);
  const std::string path = std::getenv("PATH");
  setenv("PATH", "/nonexistent", 1);
  const CommandResult absent = runCommand(arguments);
  setenv("PATH", path.c_str(), 1);
  CHECK(absent.status == 0);
  CHECK_THAT(absent.out, Catch::Contains("not checked: bielle-check is not built"));
  // How the check ends, the status of the command, and its error line.
  const std::tuple<const char*, int, const char*> ends[] = {
      {"exit 0", 0, ""},
      {"exit 1", 1, ""},
      {"exit 2", 1, "bielle-check failed with status 2"},
      {"exit 77", 1, "bielle-check failed with status 77"},
      {"kill -KILL $$", 1, "bielle-check was terminated by signal 9"},
  };
  for (const auto& [end, status, error] : ends) {
    std::ofstream(checker) << "#!/bin/sh\necho \"<$@>\"\n" << end << "\n";
    fs::permissions(checker, fs::perms::owner_all);
    const CommandResult result = runCommand(arguments);
    INFO(end << "\n" << result.err);
    CHECK(result.status == status);
    CHECK_THAT(result.out, Catch::Contains("<--brief " + directory.str() + "/motion>\n"));
    CHECK_THAT(result.err, Catch::Contains(error));
    CHECK(result.err.empty() == (*error == 0));
  }
  std::ofstream(checker) << "#!/nonexistent/interpreter\n";
  const CommandResult unable = runCommand(arguments);
  CHECK(unable.status == 1);
  CHECK_THAT(unable.err, Catch::Contains("bielle-check cannot be started"));
}

TEST_CASE("in the full formulation velocities follow accelerations") {
  const OutputDirectory directory;
  CHECK(run(makeShortSquat(directory.str(), {"--formulation", "full"})).status == 0);
  CHECK(directory.readSummary()["formulation"] == "full");
  const MotionRecord record = directory.readTrajectory();
  for (int k = 0; k + 1 < record.time.size(); ++k)
    CHECK((record.v.row(k + 1) - record.v.row(k) - 0.02 * record.a.row(k)).norm() < 1e-8);
}

TEST_CASE("the rule of the steps is what was requested") {
  const OutputDirectory directory;
  CHECK(run(makeShortSquat(directory.str(), {"--formulation", "full", "--step", "midpoint"})).status == 0);
  CHECK(directory.readSummary()["step"] == "midpoint");
  CHECK(run(makeShortSquat(directory.str(), {"--step", "euler"})).status == 0);
  CHECK(directory.readSummary()["step"] == "euler");
  checkRefused(run(makeShortSquat(directory.str(), {"--step", "best"})), "best");
}

TEST_CASE("stages that turn out too long are halved, unless their length was requested") {
  const OutputDirectory directory;
  const std::vector<std::string> walk{
      "solve", "walk",           "--robot", "bipetto", "-o", directory.str(), "--speed", "0.4", "--single-support",
      "0.25",  "--swing-height", "0.14",    "--steps", "2"};
  const auto solve = [&](std::vector<std::string> more) {
    more.insert(more.begin(), walk.begin(), walk.end());
    return run(more);
  };
  const Model model = loadRobot("bipetto").model;
  const CommandResult halved = solve({"--no-check"});
  INFO(halved.out << halved.err);
  CHECK(halved.status == 0);
  CHECK_THAT(halved.out, Catch::Contains("solving again with stages half as long"));
  CHECK(directory.readSummary()["options"]["time_step"] == 0.006);
  CHECK(calcStepError(model, directory.readTrajectory()) < 0.5 * kLargestStepError);
  const CommandResult requested = solve({"--no-check", "--quiet", "--set", "time_step=0.012"});
  CHECK(requested.status == 1);  // it has converged to no motion of the robot
  CHECK(directory.readSummary()["options"]["time_step"] == 0.012);
  CHECK(directory.readSummary()["converged"] == false);
  CHECK_THAT(directory.readSummary()["message"], Catch::Contains("set a shorter time_step"));
  CHECK(calcStepError(model, directory.readTrajectory()) > kAllowedStepError);
}

TEST_CASE("stages of a given length are kept, and a warning says how far soles move in them") {
  const OutputDirectory directory;
  const auto solve = [&directory](const std::string& step) {
    return run({"solve", "squat", "--robot", "bipetto", "--depth", "0.9", "--duration", "0.6", "--set",
                "time_step=" + step, "--quiet", "--no-check", "--no-report", "-o", directory.str()});
  };
  const char* const kTold = "warning: corners of standing soles move by up to ";
  const CommandResult coarse = solve("0.06");
  const std::string kRemedy = "leave time_step out, or set time_step=";
  REQUIRE_THAT(coarse.out, Catch::Contains(kTold) &&
                               Catch::Contains(" mm between nodes, in stages of 0.06 s, as given; " + kRemedy));
  CHECK(directory.readSummary()["options"]["time_step"] == 0.06);
  const std::string shorter = coarse.out.substr(coarse.out.find(kRemedy) + kRemedy.size());
  CHECK_THAT(solve(shorter.substr(0, shorter.find('\n'))).out, !Catch::Contains(kTold));
  const CommandResult sequence = run({"solve", "sequence", "--motions", "squat", "--robot", "bipetto", "--set",
                                      "squat.depth=0.9", "--set", "squat.duration=0.6", "--set", "squat.time_step=0.06",
                                      "--quiet", "--no-check", "--no-report", "-o", directory.str()});
  CHECK_THAT(sequence.out, Catch::Contains(kTold) && Catch::Contains("set a shorter time_step of its motions"));
}

TEST_CASE("motions that miss their differences where a linkage is near its dead point are planned farther from it") {
  const OutputDirectory directory;
  REQUIRE(run({"solve", "squat", "--robot", "bipetto", "--dead-point-margin", "0.14", "-o", directory.str(), "--quiet",
               "--no-check"})
              .status == 0);
  const Model model = loadRobot("bipetto").model;
  const Motion squat = makeMotion(model, findMotion("", "squat").request);
  const MotionRecord record = directory.readTrajectory();
  const auto disturb = [&record](int node) {
    MotionRecord disturbed = record;
    disturbed.v(node, 0) += 0.1;
    return disturbed;
  };
  const int deepest = 99, high = 10;  // the knees are near their dead point in the lowest posture alone
  CHECK_FALSE(avoidDeadPoints(squat, record));
  CHECK_FALSE(avoidDeadPoints(squat, disturb(high)));
  const std::optional<Motion> planned = avoidDeadPoints(squat, disturb(deepest));
  REQUIRE(planned);
  int bounded = 0;
  for (const PathConstraint& constraint : planned->problem->spec(deepest).path_constraints)
    if (constraint.name.find("dead points") == 0) {
      ++bounded;
      CHECK(constraint.lower[0] == kWideDeadPointMargin);
    }
  CHECK(bounded >= 2);
  ProblemOptions wide;
  wide.limits.dead_point_margin = kWideDeadPointMargin;
  CHECK_FALSE(avoidDeadPoints(makeMotion(model, *squat.request, wide), disturb(deepest)));
}

// The crank and the coupler of robots/fourbar are one rod where cos crank = (0.5^2 + 0.4^2 - 0.3^2) / (2 * 0.5 * 0.4).
TEST_CASE("the distance of a linkage from its dead points is that of its closed form, of the joint and of the motor") {
  const RobotDirectory directory;
  const std::filesystem::path fourbar = std::filesystem::path(BIELLE_SOURCE_DIR) / "robots/fourbar";
  const std::string yaml = readFile(fourbar / "fourbar.yaml");
  const std::string swapped = replaceOnce(replaceOnce(yaml, "  crank_joint: {effort", "  rocker_joint: {effort"),
                                          "serial_joints: [rocker_joint]", "serial_joints: [crank_joint]");
  for (const std::string& text : {yaml, swapped}) {
    const Model model = loadRobot(directory.writeRobot(readFile(fourbar / "fourbar.urdf"), text)).model;
    for (double off : {0.2, 0.02, 0.007, -0.007}) {
      const double a = 0.15, b = 0.35, c = 0.3, d = 0.4, crank = std::acos(0.8) + off;
      const Vector3d A(a * std::cos(crank), 0, a * std::sin(crank)), to_pivot = Vector3d(d, 0, 0) - A;
      const double e = to_pivot.norm(), corner = std::acos((b * b + e * e - c * c) / (2 * b * e));
      const double coupler = std::atan2(to_pivot.z(), to_pivot.x()) + corner;
      const Vector3d B = A + b * Vector3d(std::cos(coupler), 0, std::sin(coupler));
      const double rocker = std::atan2(B.z(), B.x() - d);
      VectorXd q(4);
      for (const auto& [name, value] : {std::pair{"crank_joint", crank},
                                        {"crank_coupler", coupler - crank},
                                        {"rocker_joint", rocker},
                                        {"rocker_coupler", coupler + EIGEN_PI - rocker}})
        q[model.joints()[model.findJoint(name)].idx_q] = value;
      const std::vector<DeadPointTrace> found = traceDeadPoints(model, q.transpose());
      REQUIRE(found.size() == 1);
      CHECK(found[0].output == model.joints()[model.serialJoints()[0]].name);
      CHECK(found[0].getNearest().distance == Approx(std::abs(off)).epsilon(1e-7));
    }
  }
}

TEST_CASE("a motion that starts near a dead point says so at its start and in its failure") {
  const RobotDirectory directory;
  const OutputDirectory out;
  const auto solve = [&](const std::string& robot) {
    return run({"solve", "squat", "--robot", robot, "--depth", "0.95", "--max-iterations", "1", "--no-check",
                "--no-report", "-o", out.str()});
  };
  const std::string told = "distance from dead points at the start (rad or m): ";
  const CommandResult usual = solve("bipetto");
  CHECK(usual.status == 1);
  CHECK_THAT(usual.out, Catch::Contains(told + "knee_") && !Catch::Contains("starts near a dead point") &&
                            !Catch::Contains("come near dead points"));

  // Knees bent to 0.01 rad before their four-bar's dead point at 1.325 rad.
  const fs::path bipetto = fs::path(BIELLE_SOURCE_DIR) / "robots/bipetto";
  std::string yaml = readFile(bipetto / "bipetto.yaml");
  for (const auto& [from, to] : {std::pair{"value: 0.575", "value: 0.35"},
                                 {"knee_right: 0.4913", "knee_right: 1.3"},
                                 {"knee_left: -0.4890", "knee_left: -1.3"}})
    yaml = replaceOnce(yaml, from, to);
  const CommandResult bent = solve(directory.writeRobot(readFile(bipetto / "bipetto.urdf"), yaml));
  CHECK(bent.status == 1);
  CHECK_THAT(bent.out, Catch::Contains("this motion starts near a dead point") &&
                           Catch::Contains("come near dead points") &&
                           Catch::Contains(" at the start; start farther from them"));
  CHECK_THAT(out.readSummary()["message"], Catch::Contains("knee_left 0.07"));
}

// Its knees end just before the dead point of their four-bar at 1.3256 rad, and nothing keeps them from it.
TEST_CASE(
    "a squat that ends just before a dead point: solve, summary, check and report tell how far, and so do info and "
    "ratio") {
  const OutputDirectory out;
  const CommandResult solved = run({"solve", "squat", "--robot", "bipetto", "--depth", "0.72", "--dead-point-margin",
                                    "0", "--quiet", "-o", out.str()});
  INFO(solved.out << solved.err);
  const json summary = out.readSummary();
  const json* nearest = nullptr;
  for (const json& linkage : summary["dead_points"])
    if (linkage["distance"].is_number() && (!nearest || linkage["distance"] < (*nearest)["distance"]))
      nearest = &linkage;
  REQUIRE(nearest);
  const double distance = (*nearest)["distance"];
  const std::string name = (*nearest)["linkage"];
  CHECK(distance < 0.1);
  CHECK_THAT(name, Catch::StartsWith("knee_"));
  CHECK((*nearest)["of"] == "output");

  // The same number by the posture of that node alone, as `info` and `ratio` take it.
  const Model model = loadRobot("bipetto").model;
  const MotionRecord record = readRecord(out.str() + "/trajectory.npz");
  Eigen::Index node = 0;
  (record.time.array() - (*nearest)["time_s"].get<double>()).abs().minCoeff(&node);
  const VectorXd q = record.q.row(node);
  CHECK(findDeadPoint(makeLinkage(model, q, {name}), model, q).distance == Approx(distance).epsilon(1e-6));

  const std::string text = formatDistance({DeadPointKind::Output, distance});
  CHECK_THAT(solved.out, Catch::Contains("  dead points ") && Catch::Contains(name + " " + text));
  CHECK_THAT(solved.err, Catch::Contains("linkage of " + name + ": " + text));
  const std::string check = out.str() + "/check.json";
  if (fs::exists(check)) {  // by Simbody
    const json rows = json::parse(readFile(check))["rows"];
    bool told = false;
    for (const json& row : rows)
      if (row["name"] == "linkages: from dead points") {
        told = true;
        CHECK(row["value"].get<double>() == Approx(distance).epsilon(1e-3).margin(1e-4));
        CHECK_THAT(row["note"].get<std::string>(), Catch::Contains("knee_"));
        CHECK(row["pass"] == true);
      }
    CHECK(told);
  }
  CHECK_THAT(readFile(out.str() + "/report.html"),
             Catch::Contains("\"linkages\"") && Catch::Contains("\"dead_points\""));
}

TEST_CASE("a leg on a rail squats on one foot, and is told what steps need") {
  const OutputDirectory directory;
  const std::vector<std::string> rest = {"--robot", "fivebar_leg", "--max-iterations", "1", "--no-check", "--no-report",
                                         "--quiet", "-o",          directory.str()};
  const auto solve = [&rest](const std::string& motion) {
    std::vector<std::string> arguments = {"solve", motion};
    arguments.insert(arguments.end(), rest.begin(), rest.end());
    return run(arguments);
  };
  solve("squat");
  CHECK(directory.readSummary()["phases"][0]["name"] == "single support");
  for (const char* motion : {"hop", "run", "walk"})
    checkRefused(solve(motion),
                 "moves on a rail, but a motion with steps needs a free one over two feet; take `squat`");
}

TEST_CASE("without limits there is none for one motor either") {
  const OutputDirectory directory;
  checkRefused(run(makeShortSquat(directory.str(), {"--no-limits", "--limit", "motor_knee_right=80"})), "limit");
}

TEST_CASE("options that others make useless are told, and what is given twice is refused") {
  const OutputDirectory directory;
  const auto plan = [&](std::vector<std::string> options) {
    options.insert(options.end(), {"--dry-run"});
    return run(makeShortSquat(directory.str(), options));
  };
  for (const auto& [options, told] : std::vector<std::pair<std::vector<std::string>, std::string>>{
           {{"--serial-armature", "1e-2"}, "--serial-armature has no effect: the model is closed"},
           {{"--regularization", "0.5"}, "--regularization has no effect: the objective is effort"},
           {{"--dead-point-margin", "0.3", "--no-limits"}, "--dead-point-margin has no effect: --no-limits"},
           {{"--set", "closure_kp=500"}, "--set closure_kp has no effect: loops are closed at every node"}}) {
    const CommandResult result = plan(options);
    CHECK(result.status == 0);
    CHECK_THAT(result.err, Catch::StartsWith("bielle: warning: ") && Catch::Contains(told));
  }
  CHECK(plan({"--dead-point-margin", "0.3"}).err.empty());
  // By a robot of a generator, which needs another program: once.
  for (const auto& [options, told] : std::vector<std::pair<std::vector<std::string>, std::string>>{
           {{"walk", "--serial-armature", "1e-2"}, "--serial-armature has no effect: the model is closed"},
           {{"walk", "--periodic", "--steps", "4"}, "option 'steps' has no effect: a cycle has two steps"},
           {{"walk", "--set", "cycles=2"}, "option 'cycles' has no effect: the motion is no cycle"},
           {{"stairs", "--height", "0.05", "--slope", "0.2"}, "option 'height' has no effect: slope replaces it"}}) {
    std::vector<std::string> command = {"solve", "--robot", "rsu_biped", "--dry-run"};
    command.insert(command.begin() + 1, options.begin(), options.end());
    const CommandResult result = run(command);
    CHECK(result.status == 0);
    CHECK(result.err == "bielle: warning: " + told + (told.back() == 'e' ? ", without periodic\n" : "\n"));
  }
  checkRefused(plan({"--set", "depth=0.9"}), "'depth' is given twice");
  checkRefused(plan({"--set", "com_weight=1e4", "--set", "com_weight=1e5"}), "'com_weight' is given twice");
  checkRefused(plan({"--limit", "motor_knee_left=80", "--limit", "motor_knee_left=90"}), "is given twice");
  checkRefused(plan({"--free-timings", "all=0.6:1.6", "--free-timings", "all=0.5:2"}), "'all' is given twice");
  checkRefused(plan({"--set", "cone_margin=1"}), "cone_margin");
}

TEST_CASE("durations are free within the bounds given, or as planned") {
  const OutputDirectory directory;
  const auto solve = [&](std::vector<std::string> options) {
    const CommandResult result = run(makeShortSquat(directory.str(), options));
    CHECK(result.status == 0);
    return directory.readSummary();
  };
  CHECK(solve({}).at("free_timings").empty());
  const double planned = solve({}).at("duration_s");
  for (const std::vector<std::string>& options :
       {std::vector<std::string>{"--free-timings"},
        std::vector<std::string>{"--free-timings", "double support=0.5:0.8"}}) {
    const bool all = options.size() == 1;
    const json summary = solve(options), &timing = summary.at("free_timings").at(0);
    CHECK(timing.at("nominal_s").get<double>() == Approx(planned));
    CHECK(timing.at("lower_s").get<double>() == Approx((all ? 0.6 : 0.5) * planned));
    CHECK(timing.at("upper_s").get<double>() == Approx((all ? 1.6 : 0.8) * planned));
    CHECK(timing.at("chosen_s").get<double>() == Approx(summary.at("duration_s").get<double>()));
    CHECK(std::abs(timing.at("chosen_s").get<double>() - planned) > 1e-3);
  }
  for (const char* wrong :
       {"double support", "double support=1", "double support=a:b", "double support=2:1", "swing=1:2"})
    checkRefused(run(makeShortSquat(directory.str(), {"--free-timings", wrong})), "free");
  checkRefused(run(makeShortSquat(directory.str(), {"--time-weight", "1"})), "time-weight");
  checkRefused(run(makeShortSquat(directory.str(), {"--free-timings", "--time-weight", "-1"})), "time-weight");
}

TEST_CASE("a squat that does not converge is written, marked, and status 1") {
  const OutputDirectory directory;
  const CommandResult result = run(makeShortSquat(directory.str(), {"--max-iterations", "1"}));
  CHECK(result.status == 1);
  const json summary = directory.readSummary();
  CHECK(summary["converged"] == false);
  CHECK(summary["interrupted"] == false);
  CHECK(summary["termination"] == "iteration limit");
  CHECK(directory.readTrajectory().time.size() == 31);
}

TEST_CASE("an interrupted squat leaves whole files that say so") {
  const OutputDirectory directory;
  // Long enough that the signal comes first.
  Command command({BIELLE_COMMAND, "solve", "squat", "--robot", "bipetto", "--set", "duration=30", "--no-check", "-o",
                   directory.str()});
  REQUIRE(command.waitForOutput("\n    1 ", 60));
  command.sendSignal(SIGINT);
  const CommandResult result = command.wait();
  CHECK(result.status == 1);
  CHECK_THAT(result.out, Catch::Contains("interrupted"));
  const json summary = directory.readSummary();
  CHECK(summary["interrupted"] == true);
  CHECK(summary["converged"] == false);
  CHECK(directory.readTrajectory().time.size() == 2041);
}
