// The guess of walks and stairs: closed postures with the feet where the plan has them.
#include <catch2/catch.hpp>
#include <cmath>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/motion/solve.h"
#include "bielle/motion/stairs.h"
#include "bielle/motion/walk.h"
#include "motion/kinematic_guess.h"
#include "own_robots.h"
#include "solve_in_place.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

// Largest distance of a standing foot from its place, and gap of a closure, at the nodes of the guess.
struct Errors {
  double feet = 0, closures = 0;
};
Errors measureErrors(const Motion& motion) {
  const Model& model = getBipetto();
  const ConstraintSet closures = makeConstraintSet(model);
  Workspace ws(model);
  Errors worst;
  size_t k = 0;
  for (const ContactPhase& phase : motion.schedule.phases)
    for (int i = 0; i < phase.nodes; ++i, ++k) {
      updatePositions(model, ws, motion.guess.xs[k].head(model.nq()));
      worst.closures = std::max(worst.closures, calcLargestGap(ws, closures));
      for (const ContactTarget& target : phase.contacts) {
        const ContactFrame& contact = model.contacts()[target.contact];
        const SE3 X = getPlacement(ws, contact.body, contact.X_BF);
        worst.feet = std::max(worst.feet, (X.p - target.X_WT.p).norm());  // soles may tilt at the end of a long step
      }
    }
  return worst;
}

Stance makeStance() { return bielle::makeStance(getBipetto(), LocomotionOptions(), makeStandingRobot(getBipetto())); }

double measureTransmissions(const VectorXd& q) {
  const Model& model = getBipetto();
  Workspace ws(model);
  updatePositions(model, ws, q);
  const VectorXd none;
  const ConstraintSet closures = makeConstraintSet(model);
  double least = 1;
  VectorXd value(1);
  for (const Linkage& linkage : listLinkages(model, makeStandingPosture(model))) {
    makeTransmission(linkage, 1e9)->calc({model, ws, closures, none, none}, value);
    least = std::min({least, value[0], 1 / value[0]});
  }
  return least;
}

}  // namespace

TEST_CASE("guess: loops are closed, and standing feet are where they stand") {
  WalkOptions walk;
  walk.speed = 0.8;
  StairsOptions stairs;
  stairs.height = 0.05;
  for (const Motion& motion : {makeWalk(getBipetto(), walk), makeStairs(getBipetto(), stairs)}) {
    INFO(motion.name);
    const Errors errors = measureErrors(motion);
    CHECK(errors.closures < 1e-10);
    CHECK(errors.feet < 1e-10);
  }
}

TEST_CASE("guess: the base comes down for a long stride, and linkages keep away from dead points") {
  const Stance stance = makeStance();
  PlannedPosture planned{stance.q, stance.feet};
  planned.feet[0].p.x() += 0.23;
  planned.feet[1].p.x() -= 0.23;
  const VectorXd q = placeFeet(getBipetto(), stance, {planned}).front();
  CHECK(q[2] < stance.q[2] - 0.01);
  CHECK((q.head<2>() - stance.q.head<2>()).norm() < 1e-10);
  CHECK(measureTransmissions(q) > kLeastTransmission);
  Workspace ws(getBipetto());
  updatePositions(getBipetto(), ws, q);
  for (int i = 0; i < 2; ++i) {
    const ContactFrame& contact = getBipetto().contacts()[stance.contacts[i]];
    CHECK((getPlacement(ws, contact.body, contact.X_BF).p - planned.feet[i].p).norm() < 1e-10);
    CHECK((getPlacement(ws, contact.body, contact.X_BF).R - planned.feet[i].R).norm() < 1e-10);
  }
}

TEST_CASE("guess: feet farther apart than legs reach under the planned base have it turned, and stand flat") {
  const Stance stance = makeStance();
  PlannedPosture planned{stance.q, stance.feet};
  planned.feet[0].p.x() -= 0.175;
  planned.feet[1].p.x() += 0.311;
  const VectorXd q = placeFeet(getBipetto(), stance, {planned}).front();
  CHECK((q.segment<4>(3) - stance.q.segment<4>(3)).norm() > 0.01);
  CHECK(measureTransmissions(q) > kLeastTransmission);
  Workspace ws(getBipetto());
  updatePositions(getBipetto(), ws, q);
  CHECK(calcLargestGap(ws, makeConstraintSet(getBipetto())) < 1e-10);
  for (int i = 0; i < 2; ++i) {
    const ContactFrame& contact = getBipetto().contacts()[stance.contacts[i]];
    CHECK((getPlacement(ws, contact.body, contact.X_BF).p - planned.feet[i].p).norm() < 1e-10);
    CHECK((getPlacement(ws, contact.body, contact.X_BF).R - planned.feet[i].R).norm() < 1e-10);
  }
}

TEST_CASE("guess: out of reach, legs are as in the stance") {
  const Stance stance = makeStance();
  PlannedPosture planned{stance.q, stance.feet};
  planned.feet[0].p.x() += 2;
  const VectorXd q = placeFeet(getBipetto(), stance, {planned}).front();
  CHECK((q.tail(q.size() - 7) - stance.q.tail(q.size() - 7)).norm() < 1e-12);
}

TEST_CASE("guess: how high the centre of mass can be over a foot") {
  const Stance stance = makeStance();
  LegReach reach(getBipetto(), stance);
  const double height = stance.com.z() - stance.feet[0].p.z();
  const auto measure = [&](double ahead, double z) {  // transmissions with flat soles, or 0 if there is no such posture
    PlannedPosture planned{stance.q, stance.feet};
    for (SE3& foot : planned.feet) foot.p.x() -= ahead;
    planned.q[2] += z - height;
    const VectorXd q = placeFeet(getBipetto(), stance, {planned}).front();
    return std::abs(q[2] - planned.q[2]) < 1e-12 ? measureTransmissions(q) : 0;
  };
  for (double ahead : {-0.08, 0.0, 0.08}) {
    CAPTURE(ahead);
    const auto [shortest, longest] = reach.calc(ahead, 0);
    CHECK(shortest < height);
    CHECK(longest > height);
    for (double z : {shortest, longest}) CHECK(measure(ahead, z) > 0.45);  // heights are interpolated
    for (double z : {shortest - 0.02, longest + 0.02}) CHECK(measure(ahead, z) < 0.5);
  }
  // Ahead of a foot the ankle bends as well as the knee, and so the leg less. A leg set aside is a slanted strut.
  CHECK(reach.calc(0.1, 0).shortest > reach.calc(0, 0).shortest + 0.02);
  CHECK(reach.calc(-0.1, 0).shortest < reach.calc(0, 0).shortest);
  CHECK(reach.calc(0, 0.1).longest == Approx(std::sqrt(std::pow(reach.calc(0, 0).longest, 2) - 0.01)));
}

TEST_CASE("guess: one that cannot be evaluated gives way to the posture at the start") {
  WalkOptions options;  // long, slow strides, in which a knee is nearly straight
  options.speed = 0.697;
  options.gait.timing.single = 0.475;
  options.gait.timing.both = 0.194;
  options.gait.swing.height = 0.032;
  options.steps = 4;
  Motion motion = makeWalk(getBipetto(), options);
  FddpOptions solver;
  solver.initial_regularization = kGuessRegularization;
  solver.max_iterations = 5;
  ShootingTrajectory guess = motion.guess;
  CHECK(test::solveInPlace(*motion.problem, guess, solver).termination == FddpTermination::Failed);
  SolveOptions how;
  how.solver = solver;
  const FddpSummary summary = solve(motion, how).summary;
  CAPTURE(summary.message);
  CHECK(summary.termination == FddpTermination::MaxIterations);
  CHECK(summary.iterations == 5);
}
