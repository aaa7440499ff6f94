// The mechanisms as models: closed, with the energies and the accelerations of the true motions, which know nothing of them.
#include <catch2/catch.hpp>
#include <cmath>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/constrained.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/formats/robot_writer.h"
#include "bielle/model/builder.h"
#include "bielle/robots/robot_loader.h"
#include "loops/problem.h"
#include "robot_directory.h"

using namespace bielle;
using namespace bielle::loops;

namespace {

struct Accelerations {
  VectorXd a, lambda;
  std::vector<SE3> X_WB;
};

Accelerations calcAccelerations(const Model& model, const VectorXd& torques, const Motion& motion) {
  Workspace ws(model);
  ConstrainedWorkspace cws;
  REQUIRE(updateConstrainedDynamics(model, ws, cws, makeConstraintSet(model), motion.q, motion.v,
                                    calcMotorForces(model, torques)) == NumericalStatus::Ok);
  return {cws.a, cws.lambda, ws.X_WB};
}

// Over the largest of them, at a time.
double compareAccelerations(const Problem& problem, const Model& model, double t) {
  const double h = 2e-4 * problem.pace;
  std::vector<Motion> near;
  for (int i = -2; i <= 2; ++i) near.push_back(problem.calcMotion(t + i * h));
  const VectorXd a = calcAccelerations(model, problem.torques, near[2]).a;
  const VectorXd slope = (8 * (near[3].v - near[1].v) - (near[4].v - near[0].v)) / (12 * h);
  return (a - slope).cwiseAbs().maxCoeff() / a.cwiseAbs().maxCoeff();
}

Model makeHeavier(const Model& model) {
  ModelParts parts = takeParts(model);
  parts.bodies.back().inertia.mass *= 1.001;
  return ModelBuilder::restore(parts);
}

}  // namespace

TEST_CASE("mechanisms follow their true motions") {
  for (const std::string& name : listProblems()) {
    const Problem problem = makeProblem(name);
    CAPTURE(name);
    const ConstraintSet loops = makeConstraintSet(problem.model);
    Workspace ws(problem.model);
    const double energy = problem.calcInvariant(problem.start.q, problem.start.v);
    for (const double share : {0.0, 0.037, 0.21, 0.4}) {
      const double t = share * problem.duration;
      CAPTURE(t);
      const Motion motion = problem.calcMotion(t);
      updatePositions(problem.model, ws, motion.q);
      updateVelocities<double>(problem.model, ws, motion.v);
      CHECK(calcLargestGap(ws, loops) < 1e-15);
      for (const Closure& closure : loops.closures)
        CHECK(calcClosureVelocity(ws, closure).norm() < 1e-13 * (1 + motion.v.cwiseAbs().maxCoeff()));
      CHECK(std::abs(problem.calcInvariant(motion.q, motion.v) - energy) < 1e-12 * problem.invariant_scale);
      if (share > 0) CHECK(compareAccelerations(problem, problem.model, t) < 1e-7);
    }
    // A body that is heavier by a thousandth is noticed.
    CHECK(compareAccelerations(problem, makeHeavier(problem.model), 0.21 * problem.duration) > 1e-5);
  }
}

TEST_CASE("Andrews' squeezer starts with the accelerations and forces that are published") {
  const Problem problem = makeSqueezer();
  const Accelerations found = calcAccelerations(problem.model, problem.torques, problem.start);
  VectorXd a(7);
  a << 14222.4439199541, -10666.8329399656, 0, 0, 0, 0, 0;
  CHECK((found.a - a).cwiseAbs().maxCoeff() < 1e-8);
  // On the rod, in the axes of its frame; the book's multipliers act on the other body.
  const SE3& rod = found.X_WB[problem.model.closures()[0].body1];
  const Vector3d force = -(rod.R * Vector3d(found.lambda.head<3>()));
  CHECK((force - Vector3d(98.5668703962411, -6.12268834425566, 0)).norm() < 1e-10);
  CHECK(found.lambda.tail<6>().norm() < 1e-10);
}

TEST_CASE("the accelerations printed for 0.03 s do not follow from the angles and velocities printed beside them") {
  const Problem problem = makeSqueezer();
  VectorXd q(7), v(7), printed(7), solved(7);  // beta, Theta, gamma, delta, Phi, epsilon, Omega
  q << 15.81077119629904, -15.75637105984298, 0.04082224013073101, 0.5244099658805304, -0.5347301163226948,
      1.048080741042263, 0.5347301163226948;
  v << 1139.920302151208, -1424.379294994111, 11.03291221937134, 0.5735699284790808, 19.29337464421385,
      0.3231791658026955, -19.29337464421385;
  printed << -24631.76316946196, 51850.37701610329, 324102.5686413781, 16743.62929479361, 566749.3645176213,
      9826.520791458422, -566749.3645176222;
  // By a program of its own, from Newton's and Euler's equations of the seven bodies.
  solved << -24631.76425, 51850.32138, 324102.6006, 16743.6354, 566749.4218, 9826.507826, -566749.4218;
  const VectorXd a = calcAccelerations(problem.model, problem.torques, {q, v}).a;
  CAPTURE((a - solved).transpose(), (a - printed).transpose());
  CHECK((a - solved).cwiseAbs().maxCoeff() < 2e-4);
  CHECK((a - printed).cwiseAbs().maxCoeff() > 0.05);
  const Motion motion = problem.calcMotion(0.03);
  CHECK((motion.v - v).cwiseAbs().maxCoeff() < 6e-7);
  CHECK((calcAccelerations(problem.model, problem.torques, motion).a - printed).cwiseAbs().maxCoeff() < 0.06);
}

TEST_CASE("rank and mobility of the mechanisms") {
  const auto check = [](const Problem& problem, const VectorXd& q, int rows, int rank, int mobility) {
    CAPTURE(problem.name);
    const Mobility found = calcMobility(problem.model, q);
    CHECK(found.rows == rows);
    CHECK(found.rank == rank);
    CHECK(found.mobility == mobility);
  };
  const Problem bricard = makeBricard(), fourbars = makeFourbars(5);
  check(bricard, bricard.start.q, 5, 4, 1);
  check(fourbars, fourbars.start.q, 15, 10, 1);
  VectorXd flat(11);
  for (int i = 0; i < 11; ++i) flat[i] = (i % 2 ? -1 : 1) * std::acos(0.0);
  check(fourbars, flat, 15, 5, 6);
  const Problem squeezer = makeSqueezer(), slider_crank = makeSliderCrank(), spatial = makeSpatialFourbar();
  check(squeezer, squeezer.start.q, 9, 6, 1);
  check(slider_crank, slider_crank.start.q, 3, 3, 1);
  check(spatial, spatial.start.q, 3, 3, 1);
}

TEST_CASE("mechanisms become files of robots and come back") {
  const bielle::testing::RobotDirectory directory;
  for (const std::string& name : listProblems()) {
    CAPTURE(name);
    const Problem problem = makeProblem(name);
    const std::string path = directory.path() + "/" + name;
    writeRobot(problem.model, path);
    const Model back = loadRobot(path).model;
    const Motion motion = problem.calcMotion(0.2 * problem.duration);
    const VectorXd a = calcAccelerations(problem.model, problem.torques, motion).a,
                   b = calcAccelerations(back, problem.torques, motion).a;
    CHECK((a - b).cwiseAbs().maxCoeff() < 1e-6 * a.cwiseAbs().maxCoeff());
  }
}
