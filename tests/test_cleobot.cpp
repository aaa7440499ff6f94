// Cleobot squats, walks and jumps with the costs of Bipetto; no serial chain stands in for its legs.
#include <Eigen/SVD>
#include <catch2/catch.hpp>
#include <filesystem>

#include "bielle/dynamics/kinematics.h"
#include "bielle/io/record.h"
#include "bielle/model/reader.h"
#include "bielle/motion/walk.h"
#include "measure_steps.h"
#include "robot_directory.h"
#include "run_command.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

const Model& getCleobot() {
  static const LoadedRobot robot = loadRobot(std::string(BIELLE_SOURCE_DIR) + "/robots/cleobot");
  return robot.model;
}

// How far a linkage is from its singularities, over all linkages of the robot.
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

CommandResult run(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), BIELLE_COMMAND);
  return runCommand(arguments);
}

}  // namespace

TEST_CASE("Cleobot: bielle solve squat, walk and jump converge, pass their check and stay far from singularities") {
  struct Request {
    std::vector<std::string> motion;
    double com_lowest, com_highest;  // m
  };
  const double standing = 0.538;
  const std::vector<Request> requests = {{{"squat"}, 0.7 * standing, standing},
                                         {{"squat", "--depth", "0.6"}, 0.6 * standing, standing},
                                         {{"walk"}, 0.97 * standing, 1.02 * standing},
                                         {{"jump"}, 0.88 * standing, standing + 0.02 + 9.81 * 0.09 / 8}};
  for (const Request& request : requests) {
    const RobotDirectory directory;
    std::vector<std::string> arguments = {"solve"};
    arguments.insert(arguments.end(), request.motion.begin(), request.motion.end());
    arguments.insert(arguments.end(), {"--robot", "cleobot", "-o", directory.path() + "/result", "--no-report"});
    CAPTURE(arguments);
    const CommandResult result = run(arguments);
    CAPTURE(result.out, result.err);
    CHECK(result.status == 0);
    CHECK((result.out.find(": passed") != std::string::npos || result.out.find("not checked") != std::string::npos));
    const MotionRecord record = readRecord(directory.path() + "/result/trajectory.npz");
    CHECK(record.gap.maxCoeff() < 1e-10);
    CHECK(record.com.col(2).minCoeff() == Approx(request.com_lowest).margin(0.01));
    CHECK(record.com.col(2).maxCoeff() == Approx(request.com_highest).margin(0.01));
    CHECK(record.u.cwiseAbs().maxCoeff() < 45);
    Margin margin;
    Workspace ws(getCleobot());
    for (int k = 0; k < record.q.rows(); ++k) {
      widen(getCleobot(), ws, record.q.row(k), margin);
      const Eigen::Quaterniond trunk(Eigen::Vector4d(record.q.row(k).segment<4>(3)));
      CHECK((trunk * Vector3d::UnitZ()).z() > std::cos(0.25));
    }
    CAPTURE(margin.closures, margin.motors);
    CHECK(margin.closures > 0.015);
    CHECK(margin.motors > 0.2);
  }
}

TEST_CASE("Cleobot: feet of a walk land where they should and do not slide") {
  Motion motion = makeWalk(getCleobot());
  const FddpSummary summary = Fddp(FddpOptions{}).solve(*motion.problem, motion.guess);
  CAPTURE(summary.message, summary.iterations);
  CHECK(summary.termination == FddpTermination::Converged);
  const StepMeasures m = StepMeter(motion, motion.guess).measure();
  CHECK(m.slip < 1e-3);
  CHECK(m.penetration < 1e-3);
  CHECK(m.lowest > -1e-3);
  CHECK(m.clearance > 0.02);
  CHECK(m.foothold < 2e-3);
  CHECK(m.touchdown < 0.2);
  CHECK(m.pressure < 1);
  CHECK(m.friction < 0.7);
  CHECK(m.load > 5);
  CHECK(m.tilt < 0.1);
  CHECK(m.velocity_jump < 5);
  CHECK(m.feet > 0.05);
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
