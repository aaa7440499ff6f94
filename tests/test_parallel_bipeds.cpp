// Cleobot, the bipeds with RSU ankles, with belts and with ball screws squat, walk and jump with the costs of Bipetto. The legs of Cleobot have no
// equivalent serial chain.
#include <Eigen/SVD>
#include <catch2/catch.hpp>
#include <filesystem>

#include "bielle/dynamics/kinematics.h"
#include "bielle/motion/walk.h"
#include "bielle/results/result.h"
#include "bielle/robots/robot_loader.h"
#include "design/conditioning.h"
#include "formats/text_file.h"
#include "measure_steps.h"
#include "robot_directory.h"
#include "run_bielle.h"
#include "solve_in_place.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

const Model& getCleobot() {
  static const LoadedRobot robot = loadRobot(std::string(BIELLE_SOURCE_DIR) + "/robots/cleobot");
  return robot.model;
}

// Least distance of the robot's linkages from their singularities.
struct Margin {
  double closures = 1e9;  // smallest singular value of the closure Jacobian: rank; about a lever arm, m
  double motors = 1e9;    // of the motors' rows of an orthonormal basis of the motions that are left: motors hold it
};

void widen(const Model& model, Workspace& ws, const VectorXd& q, Margin& margin) {
  updatePositions(model, ws, q);
  for (const LoopCluster& cluster : model.clusters()) {
    MatrixXd J(cluster.rows, model.nv());
    int row = 0;
    for (int c : cluster.closures) {
      const int n = getRows(model.closures()[c].kind);
      MatrixXd rows = MatrixXd::Zero(n, model.nv());
      calcClosureJacobian(ws, model.closures()[c], rows);
      J.middleRows(row, n) = rows;
      row += n;
    }
    MatrixXd J_loop(cluster.rows, cluster.dofs.size());
    for (size_t k = 0; k < cluster.dofs.size(); ++k) J_loop.col(k) = J.col(cluster.dofs[k]);
    const Eigen::JacobiSVD<MatrixXd> svd(J_loop, Eigen::ComputeFullV);
    const MatrixXd N = svd.matrixV().rightCols(J_loop.cols() - cluster.rows);
    MatrixXd motors(N.cols(), N.cols());
    int m = 0;
    for (size_t k = 0; k < cluster.dofs.size(); ++k)
      for (const Motor& motor : model.motors())
        if (motor.dof == cluster.dofs[k]) motors.row(m++) = N.row(k);
    REQUIRE(m == N.cols());
    margin.closures = std::min(margin.closures, svd.singularValues().minCoeff());
    margin.motors = std::min(margin.motors, Eigen::JacobiSVD<MatrixXd>(motors).singularValues().minCoeff());
  }
}

// Runs bielle solve MOTION with its check, which must pass; returns the written motion.
MotionRecord solveByCommand(const std::string& robot, const std::vector<std::string>& motion,
                            const RobotDirectory& directory) {
  std::vector<std::string> arguments = {"solve"};
  arguments.insert(arguments.end(), motion.begin(), motion.end());
  arguments.insert(arguments.end(), {"--robot", robot, "-o", directory.path() + "/result", "--no-report"});
  const CommandResult result = run(arguments);
  CAPTURE(arguments, result.out, result.err);
  CHECK_THAT(result.out, Catch::Contains(": converged"));
  CHECK(result.status == 0);
  if (result.out.find("not checked") == std::string::npos) CHECK_THAT(result.out, Catch::Contains(": passed"));
  return readRecord(directory.path() + "/result/trajectory.npz");
}

struct Request {
  std::vector<std::string> motion;
  double com_lowest, com_highest;  // m
};

// Heights, torques, closed loops, an upright trunk, and linkages away from their singularities.
void checkMotions(const std::string& robot, const std::vector<Request>& requests, double torque, double lean,
                  const Margin& least) {
  const Model model = loadRobot(std::string(BIELLE_SOURCE_DIR) + "/robots/" + robot).model;
  for (const Request& request : requests) {
    CAPTURE(request.motion);
    const RobotDirectory directory;
    const MotionRecord record = solveByCommand(robot, request.motion, directory);
    CHECK(record.gap.maxCoeff() < 1e-10);
    CHECK(record.com.col(2).minCoeff() == Approx(request.com_lowest).margin(0.01));
    CHECK(record.com.col(2).maxCoeff() == Approx(request.com_highest).margin(0.012));
    CHECK(record.u.cwiseAbs().maxCoeff() < torque);
    Margin margin;
    Workspace ws(model);
    for (int k = 0; k < record.q.rows(); ++k) {
      widen(model, ws, record.q.row(k), margin);
      const Eigen::Quaterniond trunk(Eigen::Vector4d(record.q.row(k).segment<4>(3)));
      CHECK((trunk * Vector3d::UnitZ()).z() > std::cos(lean));
    }
    CHECK(margin.closures > least.closures);
    CHECK(margin.motors > least.motors);
  }
}

}  // namespace

TEST_CASE("Cleobot: bielle solve squat, walk and jump converge, are checked and stay far from singularities",
          "[long]") {
  const double standing = 0.538, rise = 9.81 * 0.3 * 0.3 / 8;
  checkMotions("cleobot",
               {{{"squat", "--depth", "0.6", "--set", "time_step=0.03"}, 0.6 * standing, standing},
                {{"walk", "--steps", "3", "--set", "time_step=0.02"}, 0.98 * standing, 1.02 * standing},
                {{"jump"}, 0.88 * standing, standing + 0.02 + rise}},
               45, 0.25, {0.015, 0.2});
}

TEST_CASE("RSU biped: bielle solve squat, walk and jump converge, are checked and stay far from singularities",
          "[long]") {
  const double standing = 0.393, rise = 9.81 * 0.3 * 0.3 / 8;
  checkMotions("rsu_biped",
               {{{"squat", "--depth", "0.6", "--set", "time_step=0.03"}, 0.6 * standing, standing},
                {{"walk", "--steps", "3", "--set", "time_step=0.02"}, 0.98 * standing, 1.02 * standing},
                {{"jump"}, 0.83 * standing, standing + 0.02 + rise}},
               70, 0.25, {0.015, 0.2});
}

TEST_CASE("belt biped: bielle solve squat, walk and jump converge and are checked", "[long]") {
  const double standing = 0.403, rise = 9.81 * 0.3 * 0.3 / 8;
  checkMotions("belt_biped",
               {{{"squat", "--depth", "0.6", "--set", "time_step=0.03"}, 0.6 * standing, standing},
                {{"walk", "--steps", "3", "--set", "time_step=0.02"}, 0.98 * standing, 1.055 * standing},
                {{"jump"}, 0.83 * standing, standing + 0.02 + rise}},
               70, 0.25, {0.015, 0.2});
}

TEST_CASE(
    "leg biped with 3-RRS hips: bielle solve squat and walk converge, are checked and stay far from singularities",
    "[long]") {
  const RobotDirectory directory;
  const std::string robot = directory.path() + "/parallel";
  REQUIRE(run({"generate", "leg_biped", "--set", "hip=three_rrs", "-o", robot}).status == 0);
  const Model model = loadRobot(robot).model;
  for (const std::string motion : {"squat", "walk"}) {
    CAPTURE(motion);
    const MotionRecord record = solveByCommand(robot, {motion, "--set", "time_step=0.02"}, directory);
    CHECK(record.gap.maxCoeff() < 1e-10);
    CHECK(record.com.col(2).minCoeff() == Approx(motion == "squat" ? 0.7 * 0.402 : 0.400).margin(0.005));
    CHECK(record.u.cwiseAbs().maxCoeff() < 50);
    LinkageConditioning conditioning(model, record.q.row(0), LinkageSide::Joints);
    for (int k = 0; k < record.q.rows(); ++k) CHECK(conditioning.calc(record.q.row(k)) < 1 / 0.2);
  }
}

TEST_CASE("belt knee and differential ankle: bielle solve squat and walk converge and are checked", "[long]") {
  const double standing = 0.403;
  for (const char* name : {"belt_knee", "differential_ankle"}) {
    CAPTURE(name);
    checkMotions(name,
                 {{{"squat", "--set", "time_step=0.03"}, 0.7 * standing, standing},
                  {{"walk", "--steps", "3", "--set", "time_step=0.02"}, 0.98 * standing, 1.055 * standing}},
                 70, 0.25, {0.015, 0.2});
  }
}

TEST_CASE("Kangaroo on ball screws: squat and walk are solved and checked, with 96 redundant rows", "[long]") {
  const double standing = 0.744;
  // Longer time steps than usual, and a walk of two steps: the redundant rows make it slow.
  const std::vector<std::string> squat = {"squat", "--set", "time_step=0.03"},
                                 walk = {"walk", "--steps", "2", "--set", "time_step=0.02"};
  struct Case {
    std::vector<std::string> motion;
    double lowest, lean;  // m, rad
  };
  for (const Case& each : {Case{squat, 0.7 * standing, 0.4}, Case{walk, 0.998 * standing, 0.25}}) {
    CAPTURE(each.motion);
    const RobotDirectory directory;
    const MotionRecord record = solveByCommand("kangaroo", each.motion, directory);
    CHECK(record.gap.maxCoeff() < 1e-10);
    CHECK(record.com.col(2).minCoeff() == Approx(each.lowest).margin(0.01));
    CHECK(record.u.cwiseAbs().maxCoeff() < 2500);  // N
    for (int k = 0; k < record.q.rows(); ++k) {
      const Eigen::Quaterniond trunk(Eigen::Vector4d(record.q.row(k).segment<4>(3)));
      CHECK((trunk * Vector3d::UnitZ()).z() > std::cos(each.lean));
    }
  }
  const RobotDirectory directory;
  const MotionRecord record = solveByCommand("kangaroo_leg", {"squat"}, directory);
  CHECK(record.com.col(2).minCoeff() == Approx(0.7 * record.com(0, 2)).margin(0.015));
}

TEST_CASE("spring biped: a squat, a walk and a hop are solved and checked; its leaves take energy in at the landing",
          "[long]") {
  const Model model = loadRobot(std::string(BIELLE_SOURCE_DIR) + "/robots/spring_biped").model;
  const double standing = 0.849;
  const auto calcElastic = [&](const VectorXd& q) {
    double energy = 0;
    for (const JointForce& spring : model.jointForces()) energy += spring.stiffness * std::pow(q[spring.idx_q], 2) / 2;
    return energy;
  };
  struct Case {
    std::vector<std::string> motion;
    double lowest;  // m
  };
  for (const Case& each : {Case{{"squat", "--set", "duration=1.2", "--set", "settle=0.1"}, 0.7 * standing},
                           {{"walk", "--speed", "0.5"}, 0.998 * standing},
                           {{"hop"}, 0.952 * standing}}) {
    CAPTURE(each.motion);
    const RobotDirectory directory;
    const MotionRecord record = solveByCommand("spring_biped", each.motion, directory);
    CHECK(record.gap.maxCoeff() < 1e-10);
    CHECK(record.com.col(2).minCoeff() == Approx(each.lowest).margin(0.01));
    double most = 0;
    for (int k = 0; k < record.q.rows(); ++k) {
      const Eigen::Quaterniond trunk(Eigen::Vector4d(record.q.row(k).segment<4>(3)));
      CHECK((trunk * Vector3d::UnitZ()).z() > std::cos(0.4));
      most = std::max(most, calcElastic(record.q.row(k)));
    }
    const double start = calcElastic(record.q.row(0));
    CAPTURE(start, most);
    CHECK(start > 0.5);                                         // J, under the weight
    if (each.motion.front() == "hop") CHECK(most > 4 * start);  // one leg bears more than the whole weight
  }
}

TEST_CASE("belt biped: springs, dampers and friction are in the energy that the check counts", "[long]") {
  const RobotDirectory files;
  std::string forces = "joint_forces:\n";
  for (const std::string side : {"_left", "_right"})
    forces += "  knee" + side + ": {stiffness: 20, rest: 1, preload: 2, damping: 0.5}\n  motor_ankle1" + side +
              ": {friction: 0.3, friction_speed: 3}\n  ankley" + side + ": {stiffness: 10, damping: 0.2}\n";
  forces += "point_springs:\n";
  for (const std::string side : {"_left", "_right"})
    forces +=
        "  calf" + side + ": {frames: [thigh" + side + ", shank" + side +
        "], points: [[-0.04, 0, -0.05], [-0.04, 0, -0.06]], stiffness: 300, rest: 0.2, preload: 2, damping: 3}\n" +
        "  heel" + side + ": {frames: [shank" + side + ", foot" + side +
        "], points: [[-0.03, 0, -0.1], [-0.06, 0, 0.01]], stiffness: 200, rest: 0.15, damping: 2}\n";
  files.write("springy/springy.yaml", "generator: belt_biped\n" + forces);
  const std::string robot = files.path() + "/springy";
  REQUIRE(loadRobot(robot).model.pointSprings().size() == 4);
  REQUIRE(loadRobot(robot).model.jointForces().size() == 6);
  for (const std::vector<std::string>& motion :
       {std::vector<std::string>{"squat"}, {"walk"}, {"walk", "--step", "euler"}}) {
    const RobotDirectory directory;
    solveByCommand(robot, motion, directory);
  }
}

TEST_CASE("Cleobot, the RSU biped and the belt biped walk at 0.9 m/s", "[long]") {
  for (const std::string robot : {"cleobot", "rsu_biped", "belt_biped"}) {
    CAPTURE(robot);
    const RobotDirectory directory;
    const MotionRecord record = solveByCommand(robot, {"walk", "--speed", "0.9"}, directory);
    CHECK(record.com(record.com.rows() - 1, 0) - record.com(0, 0) > 1.7);
  }
}

TEST_CASE("Cleobot: feet of a walk land where they should and do not slide", "[long]") {
  Motion motion = makeWalk(getCleobot());
  const FddpSummary summary = test::solveInPlace(*motion.problem, motion.guess);
  CAPTURE(summary.message, summary.iterations);
  CHECK(summary.termination == FddpTermination::Converged);
  const StepMeasures m = StepMeter(motion, motion.guess).measure();
  checkFeet(m);
  CHECK(m.clearance > 0.02);
  CHECK(m.tilt < 0.1);
  CHECK(m.velocity_jump < 5);
  CHECK(m.end.x() - m.start.x() > 0.9);
  CHECK(m.final_speed < 0.02);
}

TEST_CASE("Cleobot: the serial model is refused, and why") {
  const RobotDirectory directory;
  const CommandResult result =
      run({"solve", "squat", "--robot", "cleobot", "--model", "serial", "-o", directory.path() + "/result"});
  CHECK(result.status == 2);
  CHECK_THAT(result.err, Catch::Contains("there is no equivalent serial chain") && Catch::Contains("mobility 3") &&
                             Catch::Contains("use the closed model"));
  CHECK_FALSE(std::filesystem::exists(directory.path() + "/result"));
}

TEST_CASE("bielle generate writes a robot that every command takes, and refuses what makes none") {
  const RobotDirectory directory;
  const std::string place = directory.path() + "/other";
  const CommandResult made =
      run({"generate", "cleobot", "--set", "upper_length=0.2", "--set", "hip_arm=0.07", "-o", place});
  CAPTURE(made.out, made.err);
  REQUIRE(made.status == 0);
  const LoadedRobot robot = loadRobot(place);
  CHECK(robot.file == place + "/other.urdf");
  const Model& model = robot.model;
  CHECK(model.joints()[model.findJoint("knee1_left")].X_PJ.p.norm() == Approx(0.2));
  const Frame& arm = model.frames()[model.findFrame("thigh_end_hip1_left")];
  CHECK(arm.X_BF.p.x() == Approx(-0.07));
  CHECK(run({"info", place}).status == 0);
  CHECK_THAT(run({"generate", "cleobot", "--help"}).out,
             Catch::Contains("upper_length") && Catch::Contains("[kg m^2]") && Catch::Contains("0.05 .. 1"));

  // What completes a robot may complete a generated one.
  CHECK(run({"adopt", "rsu_biped", "-o", directory.path() + "/adopted"}).status == 0);
  CHECK(loadRobot(directory.path() + "/adopted").model.nu() == 12);
  CHECK_THAT(run({"adopt", directory.path() + "/adopted", "-o", directory.path() + "/again"}).err,
             Catch::Contains("already completes another robot"));

  const auto refuse = [&](const std::string& kind, const std::string& setting, const std::string& text) {
    const CommandResult result = run({"generate", kind, "--set", setting, "-o", directory.path() + "/none"});
    CAPTURE(kind, setting);
    CHECK(result.status == 2);
    CHECK_THAT(result.err, Catch::Contains(text));
    CHECK_FALSE(std::filesystem::exists(directory.path() + "/none"));
  };
  refuse("cleobot", "uper_length=0.2", "choose one of: hip_height");
  refuse("cleobot", "upper_length=-1", "outside 0.05 .. 1");
  refuse("cleobot", "upper_length=long", "'long' is not a number");
  refuse("cleobot", "shank_length=0.15", "do not meet");
  refuse("delta", "forearm_length=0.1", "do not reach the platform");
  refuse("fivebar_leg", "lower_length=0.05", "do not meet");
  refuse("rsu_biped", "hip_height=0.8", "do not reach the ground");
  refuse("spring_leg", "crank_place=0.5", "beyond the toe");
  refuse("fourbar_chain", "count=2.5", "not a whole number");
  refuse("fourbar_chain", "rocker=2", "do not meet");
}
