// What is known of a motion is said before its first iteration: by name, with what is needed and what is allowed, in little time,
// and with a remedy that works.
#include <algorithm>
#include <catch2/catch.hpp>
#include <chrono>
#include <cmath>
#include <limits>
#include <random>

#include "bielle/formats/robot_writer.h"
#include "bielle/model/builder.h"
#include "bielle/model/error.h"
#include "bielle/motion/jump.h"
#include "bielle/motion/run.h"
#include "bielle/motion/solve.h"
#include "bielle/motion/squat.h"
#include "bielle/motion/stairs.h"
#include "bielle/motion/walk.h"
#include "bielle/robots/robot_loader.h"
#include "change_model.h"
#include "get_error.h"
#include "math/so3.h"
#include "model/rounded_text.h"
#include "motion/feasibility.h"
#include "motion/footholds.h"
#include "motion/obstacles.h"
#include "robot_directory.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

const Model& getRsuBiped() {
  static const LoadedRobot robot = loadRobot(BIELLE_SOURCE_DIR "/robots/rsu_biped");
  return robot.model;
}

ProblemOptions limitKnees(double torque) {
  ProblemOptions problem;
  problem.limits.efforts = {{"knee_left", torque}, {"knee_right", torque}};
  return problem;
}

// All warnings of a motion, one a line; an error is thrown.
std::string listDoubts(const Motion& motion, const StartingPoint* start = nullptr) {
  std::string doubts;
  checkFeasibility(motion, start, [&](const std::string& line) { doubts += line + "\n"; });
  return doubts;
}

std::string makeFoothold(Side side, double x, double y, double z = 0, double yaw = 0, double pitch = 0) {
  std::string text = side == Side::Left ? "{foot: left" : "{foot: right";
  for (const auto& [key, value] : {std::pair("x", x), {"y", y}, {"z", z}, {"yaw", yaw}, {"pitch", pitch}})
    text += std::string(", ") + key + ": " + formatExact(value);
  return text + "}";
}

std::string listFootholds(const std::vector<std::string>& steps) {
  std::string list;
  for (const std::string& step : steps) list += (list.empty() ? "[" : ", ") + step;
  return list + "]";
}

Motion makeStones(const std::vector<std::string>& steps) {
  FootholdsOptions options;
  options.footholds = listFootholds(steps);
  return makeFootholds(getRsuBiped(), options);
}

Solution solveQuietly(const Motion& motion, int iterations = 150) {
  SolveOptions options;
  options.solver.max_iterations = iterations;
  options.refine = false;
  return solve(motion, options);
}

}  // namespace

TEST_CASE("feasibility: default motions of own robots raise no doubt, and are compared in a fraction of a solve") {
  for (const char* name : {"rsu_biped", "bipetto", "humanoid"}) {
    const LoadedRobot robot = loadRobot(std::string(BIELLE_SOURCE_DIR "/robots/") + name);
    const std::vector<Motion> motions = {makeSquat(robot.model, {}), makeWalk(robot.model, {}),
                                         makeJump(robot.model, {})};
    for (const Motion& motion : motions) {
      CAPTURE(name, motion.name);
      const auto begin = std::chrono::steady_clock::now();
      CHECK(listDoubts(motion) == "");
      const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
      CHECK(took.count() < 0.5);  // at -O1 of the test and -O3 or -O1 of the library: 1 to 60 ms
    }
  }
}

TEST_CASE(
    "feasibility: motors that cannot hold the starting posture are named, and the remedy lets the motion converge") {
  const Model& model = getRsuBiped();
  SquatOptions squat;
  squat.depth = 0.8;
  const Motion weak = makeSquat(model, squat, limitKnees(6));
  const std::string error = getError([&] { solveQuietly(weak, 1); });
  // The posture needs what the torques of least squares say.
  const VectorXd q = weak.problem->initialState().head(model.nq());
  const double needed =
      std::abs(calcStaticTorques(model, weak.problem->spec(0).constraints, q).u[model.findMotor("knee_left")]);
  char text[64];
  std::snprintf(text, sizeof text, "knee_left needs %.3g N m, its limit is 6 N m", needed);
  CHECK_THAT(error, Catch::Contains(text) && Catch::Contains("motor 'knee") && Catch::Contains("--limit knee_left="));
  // Up to the limit with which, by all sharing between motors and feet, the posture is held.
  const double least = 6 * std::stod(error.substr(error.find("however the load is shared, ") + 28));
  CHECK(least > 0.5 * needed);
  CHECK(least < needed);
  CHECK_THAT(listDoubts(makeSquat(model, squat, limitKnees(0.99 * least))), Catch::Contains("cannot be held"));
  CHECK_THAT(listDoubts(makeSquat(model, squat, limitKnees(1.01 * least))), !Catch::Contains("cannot be held"));
  const double remedy = std::stod(error.substr(error.find("--limit knee_left=") + 18));
  CHECK(remedy == Approx(1.05 * needed).epsilon(0.01));
  const Motion strong = makeSquat(model, squat, limitKnees(remedy));
  CHECK(listDoubts(strong) == "");
  CHECK(solveQuietly(strong).converged());
  // Without limits there is nothing to be said.
  ProblemOptions free;
  free.limits.enforced = false;
  CHECK(listDoubts(makeSquat(model, squat, free)) == "");
  // One weak knee is no matter for a robot that can stand on the other leg's share: never an error by that alone.
  ProblemOptions one;
  one.limits.efforts = {{"knee_left", 0.9 * needed}};
  CHECK_NOTHROW(listDoubts(makeSquat(model, squat, one)));
}

TEST_CASE("feasibility: single support needs more of a knee than standing does") {
  // Both feet hold the weight with a tenth to spare; one foot does not.
  const Model& model = getRsuBiped();
  const Motion free = makeWalk(model, {});
  const VectorXd q = free.problem->initialState().head(model.nq());
  const double needed =
      std::abs(calcStaticTorques(model, free.problem->spec(0).constraints, q).u[model.findMotor("knee_left")]);
  const std::string doubts = listDoubts(makeWalk(model, {}, limitKnees(1.1 * needed)));
  CHECK_THAT(doubts, Catch::Contains("motor 'knee_left' may be too weak") && Catch::Contains("foot' at"));
  CHECK(listDoubts(makeWalk(model, {}, limitKnees(4 * needed))) == "");
}

TEST_CASE("feasibility: joints too slow for the planned postures are named") {
  ProblemOptions slow;
  slow.limits.velocities = {{"hipy_left", 0.05}};
  CHECK_THAT(listDoubts(makeWalk(getRsuBiped(), {}, slow)),
             Catch::Contains("joint 'hipy_left' may be too slow") && Catch::Contains("its limit is 0.05 rad/s"));
}

TEST_CASE("feasibility: a robot without motors is refused") {
  const Model limp = changeModel(getRsuBiped(), [](ModelParts& parts) { parts.motors.clear(); });
  CHECK_THAT(getError([&] { listDoubts(makeSquat(limp, {})); }),
             Catch::Contains("motors: the robot has none") && Catch::Contains("under `motors`"));
}

TEST_CASE(
    "feasibility: friction and dampers that are stiff for the steps are told, and the squat converges with what is "
    "said") {
  ModelParts parts = takeParts(getRsuBiped());
  for (const char* name : {"hipy_left", "hipy_right", "knee_left", "knee_right"}) {
    JointForce force;
    force.friction = 4;
    force.joint = getRsuBiped().findJoint(name);
    force.idx_q = parts.joints[force.joint].idx_q, force.dof = parts.joints[force.joint].idx_v;
    parts.joint_forces.push_back(force);
  }
  const Model stiff = ModelBuilder::restore(parts);
  SquatOptions squat;
  squat.depth = 0.85;
  const std::string doubts = listDoubts(makeSquat(stiff, squat));
  CHECK_THAT(doubts,
             Catch::Contains("steps of 15 ms are too long for the friction of") && Catch::Contains("knee_left"));
  // With the entries that it names in the robot's file.
  const size_t begin = doubts.find("`joint_forces: ") + 1;
  RobotText text = formatRobot(stiff);
  const size_t section = text.yaml.find("joint_forces:");
  text.yaml.erase(section, text.yaml.find("\n\n", section) - section);
  const RobotDirectory directory;
  const Model smooth =
      loadRobot(
          directory.writeRobot(text.urdf, text.yaml + doubts.substr(begin, doubts.find('`', begin) - begin) + "\n"))
          .model;
  REQUIRE(smooth.jointForces().size() == 4);
  const Motion motion = makeSquat(smooth, squat);
  CHECK(listDoubts(motion) == "");
  CHECK(solveQuietly(motion).converged());

  for (JointForce& force : parts.joint_forces) force.friction = 0, force.damping = 40;
  const Model damped = ModelBuilder::restore(parts);
  const std::string told = listDoubts(makeSquat(damped, squat));
  CHECK_THAT(told, Catch::Contains("steps of 15 ms are too long for the damper of joint '"));
  squat.time_step = std::stod(told.substr(told.find("time_step=") + 10));
  CHECK(listDoubts(makeSquat(damped, squat)) == "");
}

TEST_CASE("feasibility: a start that cannot be evaluated is named by node and coordinate") {
  const Motion motion = makeSquat(getRsuBiped(), {});
  const auto refuse = [&](const std::function<void(ShootingTrajectory&)>& spoil) {
    StartingPoint start{motion.guess, {}};
    spoil(start.trajectory);
    SolveOptions options;
    options.start = start;
    return getError([&] { solve(motion, options); });
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  CHECK_THAT(refuse([&](auto& t) { t.xs[7][7] = nan; }), Catch::Contains("node 7") && Catch::Contains("position"));
  CHECK_THAT(refuse([&](auto& t) { t.xs[3][getRsuBiped().nq() + 6] = nan; }),
             Catch::Contains("node 3") && Catch::Contains("velocity"));
  CHECK_THAT(refuse([&](auto& t) { t.us[2][3] = nan; }), Catch::Contains("node 2") && Catch::Contains("knee_left"));
  CHECK_THAT(refuse([&](auto& t) { t.xs.pop_back(); }), Catch::Contains("states"));
  CHECK_THAT(refuse([&](auto& t) { t.us[0].resize(3); }), Catch::Contains("node 0") && Catch::Contains("3 controls"));
  // Of another robot of the same joints.
  StartingPoint other{motion.guess, {}};
  for (VectorXd& x : other.trajectory.xs)
    for (int i = 7; i < getRsuBiped().nq(); ++i)
      if (getRsuBiped().joints()[2].nq == 1) x[i] += 0.02 * (i % 3);
  CHECK_THAT(listDoubts(motion, &other), Catch::Contains("open loops") && Catch::Contains("ankle"));
}

TEST_CASE("feasibility: a warm start of another robot, or without numbers, is named") {
  const Motion motion = makeSquat(getRsuBiped(), {});
  MotionRecord record = makeRecord(motion, motion.guess);
  MotionRecord renamed = record;
  renamed.u_names[3] = "knie_left";
  CHECK_THAT(getError([&] { makeStart(renamed, motion); }),
             Catch::Contains("motors") && Catch::Contains("'knie_left'") && Catch::Contains("'knee_left'"));
  record.v(5, 8) = std::numeric_limits<double>::infinity();
  CHECK_THAT(getError([&] { makeStart(record, motion); }),
             Catch::Contains("velocity of " + record.v_names[8]) && Catch::Contains("row 5"));
}

TEST_CASE("feasibility: a stone under a foot where it stands is refused, and may lie as far away as the message says") {
  const auto make = [](double x) {
    return makeStones({makeFoothold(Side::Left, x, 0.125, 0.02), makeFoothold(Side::Right, 0.22, -0.125, 0.04),
                       makeFoothold(Side::Left, 0.34, 0.125, 0.04)});
  };
  const std::string error = getError([&] { make(0.11); });
  CHECK_THAT(error, Catch::Contains("step 1") && Catch::Contains("under the left foot where it stands"));
  const double away = std::stod(error.substr(error.find("move it ") + 8));
  CHECK(away == Approx(0.011));  // the stone begins at 11 - 5 - 2 cm, the sole ends at 5 cm; and a millimetre
  CHECK_NOTHROW(make(0.11 + away));
  // Under the sole of another step.
  CHECK_THAT(getError([&] {
               makeStones({makeFoothold(Side::Right, 0.18, -0.12, 0.03), makeFoothold(Side::Left, 0.36, 0.13, 0.02),
                           makeFoothold(Side::Right, 0.25, -0.12, 0.05)});
             }),
             Catch::Contains("step 1") && Catch::Contains("in the stone of step 3, by 0.02 m"));
  // Under the other foot.
  CHECK_THAT(getError([&] {
               makeStones({makeFoothold(Side::Left, 0.2, 0.125, 0.02), makeFoothold(Side::Right, 0.1, -0.125, 0.02),
                           makeFoothold(Side::Left, 0.3, 0.125, 0.02)});
             }),
             Catch::Contains("step 2") && Catch::Contains("under the right foot where it stands"));
}

TEST_CASE("feasibility: boxes and treads suit the soles by default, and are refused with the least that is allowed") {
  for (const double half : {0.05, 0.12}) {
    CAPTURE(half);
    const Model model = changeModel(getRsuBiped(), [&](ModelParts& parts) {
      for (ContactFrame& contact : parts.contacts) contact.half_length = half;
    });
    const double sole = 2 * half;
    StairsOptions two;
    two.stairs = 2;
    CHECK_NOTHROW(makeBox(model, {}));
    const double usual = std::max(0.2, 1.25 * sole);
    const Motion stairs = makeStairs(model, two);
    CHECK(std::get<double>(std::find_if(stairs.options.begin(), stairs.options.end(), [](const auto& option) {
                             return option.first == "depth";
                           })->second) == Approx(usual));
    two.depth = sole + 2e-3;
    CHECK_NOTHROW(makeStairs(model, two));
    for (const double length : {0.7 * sole, sole}) {
      StairsOptions narrow = two;
      narrow.depth = length;
      BoxOptions box;
      box.length = length;
      for (const std::string& error :
           {getError([&] { makeStairs(model, narrow); }), getError([&] { makeBox(model, box); })}) {
        CHECK_THAT(error, Catch::Contains("soles of " + formatNumber(sole) + " m"));
        const double least = std::stod(error.substr(error.find("give ") + 5));
        CHECK(least == Approx(sole + 2e-3));
      }
    }
  }
}

TEST_CASE("feasibility: angles in degrees and lengths in millimetres are told") {
  const auto read = [](const std::string& entry) {
    return getError([&] {
      const RobotDirectory directory;
      readFootholds(directory.write("stones.yaml", "footholds:\n  - " + entry + "\n"));
    });
  };
  CHECK_THAT(read("{foot: right, x: 0.15, y: -0.12, yaw: 5}"),
             Catch::Contains("half a turn") && Catch::Contains("radians"));
  CHECK_THAT(read("{foot: right, x: 0.15, y: -0.12, yaw: -15}"),
             Catch::Contains("half a turn") && Catch::Contains("line 2"));
  CHECK(read("{foot: right, x: 0.15, y: -0.12, yaw: -3.1}") == "");
  CHECK_THAT(
      listDoubts(makeStones({makeFoothold(Side::Right, 0.15, -0.2, 0, -1.5), makeFoothold(Side::Left, 0.2, 0.2)})),
      Catch::Contains("foot_right") && Catch::Contains("1.5 rad") && Catch::Contains("degrees"));
  TurnOptions turn;
  turn.angle = 90;
  CHECK_THAT(getError([&] { makeTurn(getRsuBiped(), turn); }),
             Catch::Contains("half a turn per step") && Catch::Contains("radians"));
  CHECK_THAT(getError([&] { makeStones({makeFoothold(Side::Right, 150, -120)}); }),
             Catch::Contains("out of reach") && Catch::Contains("metres") && Catch::Contains("these legs bridge"));
  // Heights alone, and turns until the feet collide.
  CHECK_THAT(getError([&] {
               makeStones({makeFoothold(Side::Right, 0.18, -0.12, 30), makeFoothold(Side::Left, 0.36, 0.13, 20)});
             }),
             Catch::Contains("out of reach") && Catch::Contains("metres"));
  CHECK_THAT(getError([&] {
               makeStones({makeFoothold(Side::Right, 0.18, -0.12, 0, 3), makeFoothold(Side::Left, 0.36, 0.13, 0, 2)});
             }),
             Catch::Contains("collide") && Catch::Contains("give radians if degrees were meant"));
  WalkOptions slow;
  slow.gait.timing.single = 360;  // ms
  CHECK_THAT(getError([&] { makeWalk(getRsuBiped(), slow); }),
             Catch::Contains("'single_support'") && Catch::Contains("give seconds"));
  WalkOptions walk;
  walk.gait.swing.height = 40;
  CHECK_THAT(getError([&] { makeWalk(getRsuBiped(), walk); }),
             Catch::Contains("swing_height") && Catch::Contains("metres"));
}

TEST_CASE("feasibility: gravity has to press feet on the ground, in m/s^2") {
  const auto make = [](const Vector3d& gravity) {
    return changeModel(getRsuBiped(), [&](ModelParts& parts) { parts.gravity = gravity; });
  };
  for (const auto& [gravity, words] :
       std::vector<std::pair<Vector3d, std::string>>{{Vector3d::Zero(), "nothing presses the feet"},
                                                     {{0, 0, 9.81}, "does not point down"},
                                                     {{0, 0, -9810}, "9810 m/s^2"},
                                                     {{-9.81, 0, -9.81}, "friction of 1"}}) {
    CAPTURE(words);
    const Model model = make(gravity);
    for (const std::string& error : {getError([&] { makeSquat(model, {}); }), getError([&] { makeWalk(model, {}); }),
                                     getError([&] { makeJump(model, {}); })})
      CHECK_THAT(error, Catch::Contains("gravity") && Catch::Contains(words) && Catch::Contains("[0, 0, -9.81]"));
  }
  CHECK_THAT(listDoubts(makeSquat(make({0, 0, -98.1}), {})), Catch::Contains("gravity is 98.1 m/s^2"));
  CHECK_THAT(listDoubts(makeSquat(make({0, 0, -1}), {})), Catch::Contains("a tenth of the Earth's"));
  CHECK_THAT(listDoubts(makeSquat(make({1, 0, -9.76}), {})), Catch::Contains("beside down"));
  CHECK(listDoubts(makeSquat(make({0, 0, -1.62}), {})) == "");
}

TEST_CASE("feasibility: a robot that falls over where it starts, and soles one in the other, are named") {
  // Soles that end behind the weight.
  const Model behind = changeModel(getRsuBiped(), [](ModelParts& parts) {
    for (ContactFrame& contact : parts.contacts) {
      contact.half_length = 0.02;
      contact.X_BF.p.x() -= 0.1;
    }
  });
  CHECK_THAT(listDoubts(makeSquat(behind, {})),
             Catch::Contains("falls over where it starts") && Catch::Contains("beyond its soles"));
  const Model wide = changeModel(getRsuBiped(), [](ModelParts& parts) {
    for (ContactFrame& contact : parts.contacts) contact.half_width = 0.2;
  });
  CHECK_THAT(getError([&] { listDoubts(makeSquat(wide, {})); }),
             Catch::Contains("foot_left") && Catch::Contains("foot_right") && Catch::Contains("overlap"));
  CHECK_THAT(getError([&] { makeWalk(wide, {}); }), Catch::Contains("overlap") && Catch::Contains("in the reference"));
}

TEST_CASE(
    "feasibility: heights and lengths out of the legs' reach are refused at once, and what is offered is reached") {
  const LoadedRobot robot = loadRobot(BIELLE_SOURCE_DIR "/robots/bipetto");
  const auto refuse = [](const auto& make) {
    const auto begin = std::chrono::steady_clock::now();
    const std::string error = getError(make);
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
    CHECK(took.count() < 0.5);
    return error;
  };
  const auto makeSquatOf = [&](double depth) {
    SquatOptions squat;
    squat.depth = depth, squat.time_step = 0.03;
    return makeSquat(robot.model, squat);
  };
  const auto findRatio = [&](double depth, const std::string& bound) {
    const Motion motion = makeSquatOf(depth);
    const std::string error = refuse([&] { listDoubts(motion); });
    CAPTURE(error);
    REQUIRE(error.find("give at " + bound + " ") != std::string::npos);
    return std::stod(error.substr(error.find("give at " + bound + " ") + 8 + bound.size() + 1));
  };
  const double highest = findRatio(1.3, "most"), lowest = findRatio(0.06, "least");
  CHECK(highest > 1);
  CHECK(highest < 1.25);
  CHECK(lowest < 0.5);
  CHECK(findRatio(2, "most") == highest);  // wherever it comes from
  CHECK_NOTHROW(listDoubts(makeSquatOf(highest)));
  CHECK_NOTHROW(listDoubts(makeSquatOf(lowest)));
  CHECK_THROWS(listDoubts(makeSquatOf(highest + 0.03)));
  CHECK_THROWS(listDoubts(makeSquatOf(lowest - 0.06)));
  const std::string error_of_squat = getError([&] { listDoubts(makeSquatOf(1.3)); });
  const Solution stretched =
      solveQuietly(makeSquatOf(std::stod(error_of_squat.substr(error_of_squat.find("e.g. ") + 5))));
  CHECK(stretched.converged());

  const auto makeJumpOf = [&](double length) {
    JumpOptions jump;
    jump.length = length, jump.time_step = 0.01;
    return makeJump(robot.model, jump);
  };
  const std::string error = refuse([&] { makeJumpOf(2); });
  CAPTURE(error);
  const double most = std::stod(error.substr(error.find("at most ") + 8));
  CHECK(most < 2);
  CHECK_NOTHROW(makeJumpOf(0.99 * most));
  CHECK_THROWS(makeJumpOf(-1.01 * most));
  const Motion offered = makeJumpOf(std::stod(error.substr(error.find("e.g. ") + 5)));
  CHECK(solveQuietly(offered).converged());
  // Longer flights carry farther.
  JumpOptions longer;
  longer.length = 1.01 * most, longer.flight = 0.4, longer.time_step = 0.01;
  CHECK_NOTHROW(makeJump(robot.model, longer));
}

TEST_CASE("feasibility: flights that legs cannot give are refused before solving") {
  JumpOptions jump;
  jump.flight = 1;
  CHECK_THAT(getError([&] { makeJump(getRsuBiped(), jump); }),
             Catch::Contains("flight") && Catch::Contains("over the feet"));
  RunOptions run;
  run.flight = 0.9;
  run.speed = 0.1;
  CHECK_THAT(getError([&] { makeRun(getRsuBiped(), run); }),
             Catch::Contains("shorter flight") && Catch::Contains("over the feet"));
}

TEST_CASE("feasibility: a foothold too steep for the ground's friction is doubtful, and not with more of it") {
  const std::vector<std::string> steps = {makeFoothold(Side::Right, 0.15, -0.12, 0.04, 0, 0.5),
                                          makeFoothold(Side::Left, 0.35, 0.12)};
  FootholdsOptions options;
  options.footholds = listFootholds(steps);
  options.gait.swing.height = 0.08;
  const std::string doubts = listDoubts(makeFootholds(getRsuBiped(), options));
  CHECK_THAT(doubts, Catch::Contains("foot_right would slip") && Catch::Contains("the ground has 0.7"));
  // tan(0.5) = mu / sqrt(2) * 0.99
  CHECK_THAT(doubts, Catch::Contains("friction of 0.78"));
  options.gait.friction = 0.79;
  CHECK_THAT(listDoubts(makeFootholds(getRsuBiped(), options)), !Catch::Contains("would slip"));
}

TEST_CASE("feasibility: a walk on a ground with too little friction is doubtful, and not with what it needs") {
  WalkOptions walk;
  walk.gait.friction = 0.05;
  const std::string doubts = listDoubts(makeWalk(getRsuBiped(), walk)), told = "needs a friction of ";
  REQUIRE_THAT(doubts,
               Catch::Contains("would slip") && Catch::Contains(told) && Catch::Contains("the ground has 0.05"));
  walk.gait.friction = 1.1 * std::stod(doubts.substr(doubts.find(told) + told.size()));
  CHECK(walk.gait.friction > 0.1);
  CHECK(walk.gait.friction < 0.4);
  CHECK_THAT(listDoubts(makeWalk(getRsuBiped(), walk)), !Catch::Contains("would slip"));
}

TEST_CASE("feasibility: a walk whose steps are out of reach is offered a speed at which it converges") {
  WalkOptions walk;
  walk.gait.timing.time_step = 0.02;
  walk.steps = 4;
  walk.speed = -5;
  const std::string error = getError([&] { makeWalk(getRsuBiped(), walk); }), told = "by a speed of e.g. ";
  REQUIRE_THAT(error, Catch::Contains(told));
  walk.speed = std::stod(error.substr(error.find(told) + told.size()));
  CHECK(walk.speed < -0.5);
  const Motion slower = makeWalk(getRsuBiped(), walk);
  CHECK(listDoubts(slower) == "");
  CHECK(solveQuietly(slower).converged());
}

TEST_CASE("feasibility: a walk beyond the speed of walks is doubtful") {
  WalkOptions walk;
  walk.speed = 2.5;
  walk.gait.timing.single = 0.1;
  const std::string doubt = listDoubts(makeWalk(getRsuBiped(), walk));
  REQUIRE_THAT(doubt, Catch::Contains("Froude number") && Catch::Contains("run"));
  walk.speed = std::stod(doubt.substr(doubt.find("up to ") + 6));
  CHECK_THAT(listDoubts(makeWalk(getRsuBiped(), walk)), !Catch::Contains("Froude number"));
  CHECK(walk.speed > 1.8);
}

TEST_CASE("feasibility: bounds in remedies are on their own side, whatever their last digit") {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> exponent(-4, 4);
  for (int i = 0; i < 2000; ++i) {
    const double value = (i % 2 ? -1 : 1) * std::pow(10, exponent(random));
    for (int digits : {1, 2, 3}) {
      CAPTURE(value, digits);
      const double below = *parseNumber(formatBelow(value, digits)), above = *parseNumber(formatAbove(value, digits)),
                   unit = std::pow(10, std::floor(std::log10(std::abs(value))) + 1 - digits);
      CHECK((below <= value && value < below + 1.000001 * unit));
      CHECK((above >= value && value > above - 1.000001 * unit));
      CHECK(*parseNumber(formatNumber(below, ("%." + std::to_string(digits) + "g").c_str())) == Approx(below));
    }
  }
  CHECK(formatBelow(0.3, 1) == "0.3");
  CHECK(formatAbove(0.7, 2) == "0.7");
  CHECK(formatBelow(0, 2) == "0");
}

TEST_CASE("feasibility: feet that planned postures leave off their places are doubtful") {
  Motion walk = makeWalk(getRsuBiped(), {});
  for (VectorXd& x : walk.guess.xs) x = walk.guess.xs.front();  // nobody moves
  CHECK_THAT(listDoubts(walk), Catch::Contains("no posture was found in which the legs reach") &&
                                   Catch::Contains("m (or rad) off its place in '"));
}

TEST_CASE("feasibility: legs that reach once the pelvis turns raise no doubt") {
  const LoadedRobot bipetto = loadRobot(BIELLE_SOURCE_DIR "/robots/bipetto");
  WalkOptions options;
  for (double speed : {1.0, 1.1}) {
    CAPTURE(speed);
    options.speed = speed;
    CHECK(listDoubts(makeWalk(bipetto.model, options)) == "");
  }
  options.speed = 1.5;
  CHECK_THAT(listDoubts(makeWalk(bipetto.model, options)), Catch::Contains("no posture was found"));
}

TEST_CASE("feasibility: a robot in other units, and a box too narrow for both feet, are told with their sizes") {
  const Model heavy = changeModel(getRsuBiped(), [](ModelParts& parts) {
    for (Body& body : parts.bodies) body.inertia.mass *= 1000;
  });
  CHECK_THAT(listDoubts(makeSquat(heavy, {})), Catch::Contains("a mass of") && Catch::Contains("kg"));
  const Model light = changeModel(getRsuBiped(), [](ModelParts& parts) {  // of 4 kg, in g
    for (Body& body : parts.bodies) body.inertia.mass *= 160;
  });
  CHECK_THAT(listDoubts(makeSquat(light, {})), Catch::Contains("a mass of") && Catch::Contains("in g"));
  BoxOptions box;
  box.width = 0.1;
  const std::string error = getError([&] { makeBox(getRsuBiped(), box); });
  CHECK_THAT(error, Catch::Contains("'width'") && Catch::Contains("both feet, which need"));
  box.width = std::stod(error.substr(error.find("give ") + 5));
  CHECK_NOTHROW(makeBox(getRsuBiped(), box));
}
