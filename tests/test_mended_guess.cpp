// Guesses from elsewhere, made postures and motions of the robot: linkages on the side of the start, standing feet at their places,
// nodes that can be evaluated; and solves that begin with them.
#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/closing.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/linkage.h"
#include "bielle/motion/record.h"
#include "bielle/motion/solve.h"
#include "bielle/motion/stairs.h"
#include "bielle/motion/walk.h"
#include "motion/mended_guess.h"
#include "own_robots.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

Motion makeShortWalk() {
  WalkOptions options;
  options.speed = 0.4;
  options.steps = 3;
  return makeWalk(getBipetto(), options);
}

// The same joint, the motor on the other side of the dead point between.
VectorXd turnOver(const Model& model, const Linkage& linkage, const VectorXd& q) {
  const int motor = model.joints()[model.motors()[linkage.motors[0]].joint].idx_q;
  for (double way : {0.5, 1.0, 1.5, 2.0, 2.5})
    for (double sign : {1, -1}) {
      VectorXd other = q;
      other[motor] += sign * way;
      const AssemblyResult closed = closeConfiguration(model, other, linkage.joint_names);
      if (closed.status == NumericalStatus::Ok && calcTransmission(linkage, model, closed.q) < 0) return closed.q;
    }
  FAIL("no other configuration of " << linkage.output);
  return q;
}

// Smooth random ways of all coordinates, as in suite/guesses.py, loops closed again.
void displace(const Motion& motion, unsigned seed, ShootingTrajectory& nodes) {
  const Model& model = motion.problem->model();
  std::mt19937 generator(seed);
  std::normal_distribution<double> normal;
  const int count = static_cast<int>(nodes.xs.size()), modes = 3;
  MatrixXd amplitudes(model.nv(), modes);
  for (double& a : amplitudes.reshaped()) a = normal(generator);
  for (int k = 0; k < count; ++k) {
    VectorXd way = VectorXd::Zero(model.nv());
    for (int m = 1; m <= modes; ++m) way += std::sin(M_PI * k * m / (count - 1)) / std::sqrt(m) * amplitudes.col(m - 1);
    way *= 0.1;
    way.head<3>() *= 0.2;
    const AssemblyResult closed = closeConfiguration(model, model.integrate(nodes.xs[k].head(model.nq()), way));
    if (closed.status == NumericalStatus::Ok) nodes.xs[k].head(model.nq()) = closed.q;
  }
}

double calcFarthestFoot(const Motion& motion, const std::vector<VectorXd>& xs) {
  const Model& model = motion.problem->model();
  Workspace ws(model);
  double farthest = 0;
  for (size_t k = 0; k < xs.size(); ++k) {
    updatePositions(model, ws, xs[k].head(model.nq()));
    for (const ContactTarget& target : motion.schedule.getPhase(static_cast<int>(k)).contacts) {
      const ContactFrame& foot = model.contacts()[target.contact];
      const SE3 X_WF = getPlacement(ws, foot.body, foot.X_BF);
      farthest = std::max({farthest, (X_WF.p - target.X_WT.p).norm(), (X_WF.R - target.X_WT.R).norm()});
    }
  }
  return farthest;
}

}  // namespace

TEST_CASE("mended guess: linkages that a guess has in their other configuration are led past that") {
  const Motion motion = makeShortWalk();
  const Model& model = motion.problem->model();
  const int nq = model.nq();
  for (const Linkage& linkage : listLinkages(model, motion.problem->initialState().head(nq))) {
    if (linkage.size() != 1) continue;
    CAPTURE(linkage.output);
    ShootingTrajectory nodes = motion.guess;
    for (int k : {30, 31, 32, 60}) nodes.xs[k].head(nq) = turnOver(model, linkage, nodes.xs[k].head(nq));
    leadPastDeadPoints(motion, nodes.xs);
    for (size_t k = 0; k < nodes.xs.size(); ++k) {
      const AssemblyResult closed = closeConfiguration(model, nodes.xs[k].head(nq));
      CHECK(closed.status == NumericalStatus::Ok);
      CHECK(calcTransmission(linkage, model, closed.q) > 0.5);
      CHECK((closed.q - motion.guess.xs[k].head(nq)).lpNorm<Eigen::Infinity>() < 0.05);
    }
    CHECK(nodes.xs[29] == motion.guess.xs[29]);
    CHECK(nodes.xs[33] == motion.guess.xs[33]);
  }
}

TEST_CASE("mended guess: standing feet are at their places and at rest, with loops closed") {
  const Motion motion = makeShortWalk();
  const Model& model = motion.problem->model();
  const int nq = model.nq(), nv = model.nv();
  ShootingTrajectory nodes = motion.guess;
  displace(motion, 3, nodes);
  for (VectorXd& x : nodes.xs) x.segment(nq, nv).setConstant(0.1);
  REQUIRE(calcFarthestFoot(motion, nodes.xs) > 0.02);
  nodes.xs[5][2] += 0.5;  // in the air, far above
  standOnFeet(motion, nodes.xs);
  CHECK(calcFarthestFoot(motion, nodes.xs) < 1e-9);
  Workspace ws(model);
  for (size_t k = 0; k < nodes.xs.size(); ++k) {
    const ConstraintSet set = makeConstraintSet(model, motion.schedule.getPhase(static_cast<int>(k)).contacts);
    const VectorXd q = nodes.xs[k].head(nq), v = nodes.xs[k].segment(nq, nv);
    updatePositions(model, ws, q);
    CHECK(calcLargestGap(ws, makeConstraintSet(model)) < 1e-10);
    CHECK((projectVelocity(model, ws, set, q, v) - v).norm() < 1e-9);
  }
}

TEST_CASE("mended guess: nodes from which a step would open a loop come to rest, others stay") {
  const Motion motion = makeShortWalk();
  const Model& model = motion.problem->model();
  ShootingTrajectory nodes = motion.guess;
  nodes.xs[40].segment(model.nq(), model.nv()).setConstant(1e4);
  RobotEvaluator evaluator(*motion.problem);
  REQUIRE(evaluator.evaluate(40, nodes.xs[40], nodes.us[40]).status != NumericalStatus::Ok);
  restNodes(*motion.problem, nodes);
  CHECK(evaluator.evaluate(40, nodes.xs[40], nodes.us[40]).status == NumericalStatus::Ok);
  CHECK(nodes.xs[40].segment(model.nq(), model.nv()).isZero());
  CHECK(nodes.xs[40].head(model.nq()) == motion.guess.xs[40].head(model.nq()));
  for (int k : {39, 41}) CHECK(nodes.xs[k] == motion.guess.xs[k]);

  // A solve that is given them begins with what they become.
  SolveOptions options;
  options.start = StartingPoint{motion.guess};
  options.start->trajectory.xs[40].segment(model.nq(), model.nv()).setConstant(1e4);
  CHECK(solve(motion, options).converged());
}

TEST_CASE("mended guess: stairs are solved from displaced guesses, to the same optimum", "[long]") {
  StairsOptions stairs;
  stairs.height = 0.1;
  stairs.stairs = 2;
  const Motion motion = makeStairs(getBipetto(), stairs);
  SolveOptions options;
  options.refine = false;
  const Solution own = solve(motion, options);
  REQUIRE(own.converged());
  for (unsigned seed : {1, 2, 3, 4}) {
    CAPTURE(seed);
    ShootingTrajectory nodes = motion.guess;
    displace(motion, seed, nodes);
    options.start = makeStart(makeRecord(motion, nodes), motion);
    CHECK(calcFarthestFoot(motion, options.start->trajectory.xs) < 1e-9);
    const Solution other = solve(motion, options);
    CAPTURE(other.summary.message, other.summary.iterations);
    CHECK(other.converged());
    CHECK(other.summary.cost == Approx(own.summary.cost).epsilon(1e-6));
  }
}
