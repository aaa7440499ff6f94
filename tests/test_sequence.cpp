// Sequences: each motion starts where the previous one ends, on one ground, and the whole is solved as one problem.
#include <catch2/catch.hpp>

#include "bielle/dynamics/kinematics.h"
#include "bielle/model/error.h"
#include "bielle/motion/footsteps.h"
#include "bielle/motion/jump.h"
#include "bielle/motion/solve.h"
#include "bielle/motion/squat.h"
#include "bielle/motion/stairs.h"
#include "bielle/motion/walk.h"
#include "get_error.h"
#include "math/so3.h"
#include "measure_steps.h"
#include "own_robots.h"
#include "solve_in_place.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

template <typename Options>
SequencePart makePart(const std::string& name, MotionPlan (*plan)(const Model&, const Options&, const StandingRobot&),
                      const Options& options = {}) {
  return {name, [=](const Model& model, const StandingRobot& standing) { return plan(model, options, standing); }};
}

SquatOptions makeShortSquat() {
  SquatOptions options;
  options.depth = 0.85;
  options.duration = 1;
  options.settle = 0.15;
  return options;
}

StairsOptions makeStairsOf(double height) {
  StairsOptions options;
  options.height = height;
  options.stairs = 2;
  return options;
}

// Pose of the middle of the feet in a posture.
SE3 calcMiddle(const VectorXd& q) {
  const Model& model = getBipetto();
  Workspace ws(model);
  updatePositions(model, ws, q);
  SE3 feet[2];
  for (int i = 0; i < 2; ++i) {
    const ContactFrame& contact = model.contacts()[model.findContact(i == 0 ? "foot_left" : "foot_right")];
    feet[i] = getPlacement(ws, contact.body, contact.X_BF);
  }
  return bielle::calcMiddle(feet[0], feet[1]);
}

void checkWholeSoles(const MotionPlan& plan) {
  for (const ContactPhase& phase : plan.schedule.phases)
    for (const ContactTarget& foot : phase.contacts) {
      const ContactFrame& frame = getBipetto().contacts()[foot.contact];
      for (double x : {-frame.half_length, frame.half_length}) {
        const Vector3d corner = foot.X_WT.act(Vector3d(x, frame.half_width, 0));
        CAPTURE(phase.name, corner.transpose());
        CHECK(plan.ground.calcHeight(corner.x(), corner.y()) == Approx(corner.z()).margin(1e-9));
      }
    }
}

}  // namespace

TEST_CASE("sequence: each motion goes on from where the one before ends") {
  TurnOptions turn;
  turn.angle = 1.2;
  turn.steps = 8;
  JumpOptions jump;
  jump.length = 0.1;
  const MotionPlan plan =
      planSequence(getBipetto(),
                   {makePart("squat", planSquat, makeShortSquat()), makePart("turn", planTurn, turn),
                    makePart("jump", planJump, jump), makePart("stairs", planStairs, makeStairsOf(0.05)),
                    makePart("walk", planWalk, WalkOptions()), makePart("squat2", planSquat, makeShortSquat())},
                   makeStandingRobot(getBipetto()));
  const size_t stages = plan.schedule.numStages();
  CHECK(plan.stages.size() == stages + 1);
  CHECK(plan.guess.xs.size() == stages + 1);
  CHECK(plan.guess.us.size() == stages);
  for (size_t k = 0; k < stages; ++k) CHECK(plan.stages[k].dt == plan.schedule.getPhase(static_cast<int>(k)).dt);
  double duration = 0;
  for (size_t k = 0; k < stages; ++k) duration += plan.stages[k].dt;
  CHECK(plan.schedule.getTime(static_cast<int>(stages)) == Approx(duration));
  CHECK(plan.schedule.phases.front().name == "squat: double support");
  CHECK(plan.schedule.phases.back().name == "squat2: double support");

  // Feet lift off from where they stand, whatever the motion.
  std::map<int, Vector3d> feet;
  for (const ContactPhase& phase : plan.schedule.phases) {
    std::map<int, Vector3d> now;
    for (const ContactTarget& foot : phase.contacts) {
      now[foot.contact] = foot.X_WT.p;
      if (feet.count(foot.contact)) CHECK((feet[foot.contact] - foot.X_WT.p).norm() < 1e-12);
    }
    feet = now;
  }
  checkWholeSoles(plan);

  // Ahead after the turn: the jump, two stairs, five whole steps of the walk.
  const SE3 start = calcMiddle(plan.q_start), end = calcMiddle(plan.q_end);
  CHECK(calcHeading(end) == Approx(1.2));
  const double depth = 0.2;  // of the stairs by default, m
  const double ahead = 0.1 + 2 * depth + 5 * 0.5 * GaitTiming().stepDuration();
  CHECK((end.p - start.p - Vector3d(ahead * std::cos(1.2), ahead * std::sin(1.2), 0.1)).norm() < 1e-9);
  CHECK((plan.guess.xs.back().head<3>() - plan.q_end.head<3>()).norm() < 1e-9);
}

TEST_CASE("sequence: up, over the top and down again, on one ground") {
  WalkOptions walk;
  walk.steps = 4;
  const std::vector<SequencePart> parts = {makePart("stairs", planStairs, makeStairsOf(0.06)),
                                           makePart("walk", planWalk, walk),
                                           makePart("stairs2", planStairs, makeStairsOf(-0.06))};
  const MotionPlan plan = planSequence(getBipetto(), parts, makeStandingRobot(getBipetto()));
  CHECK(plan.ground.height == Approx(0).margin(1e-9));
  CHECK(calcMiddle(plan.q_end).p.z() == Approx(0).margin(1e-9));
  checkWholeSoles(plan);
  // Down first: what was the ground is now higher than the plane.
  const MotionPlan down = planSequence(getBipetto(), {parts[1], parts[2]}, makeStandingRobot(getBipetto()));
  CHECK(down.ground.height == Approx(-0.12));
  checkWholeSoles(down);
}

TEST_CASE("sequence: unlike motions are solved as one problem", "[long]") {
  TurnOptions turn;
  turn.angle = 0.3;
  turn.steps = 2;
  turn.gait.timing.time_step = 0.02;
  WalkOptions walk;
  walk.steps = 2;
  walk.gait.timing.time_step = 0.02;
  StairsOptions stairs = makeStairsOf(0.1);
  stairs.stairs = 1;
  stairs.gait.timing.time_step = 0.02;
  JumpOptions jump;
  jump.time_step = 0.01;
  const std::vector<SequencePart> parts = {makePart("squat", planSquat, makeShortSquat()),
                                           makePart("turn", planTurn, turn), makePart("walk", planWalk, walk),
                                           makePart("stairs", planStairs, stairs), makePart("jump", planJump, jump)};
  const Model& model = getBipetto();
  Motion motion = makeSequence(model, parts);
  std::vector<std::string> solved;
  const auto report = [&](const std::string& part, const FddpSummary& summary) {
    solved.push_back(part);
    CHECK(summary.termination == FddpTermination::Converged);
  };
  motion.guess = solveParts(model, parts, makeStandingRobot(model), {}, {}, {}, report);
  CHECK(solved == std::vector<std::string>{"squat", "turn", "walk", "stairs", "jump"});
  FddpOptions options;
  options.max_iterations = 100;
  const FddpSummary summary = test::solveInPlace(*motion.problem, motion.guess, options);
  CAPTURE(summary.message, summary.iterations);
  CHECK(summary.termination == FddpTermination::Converged);
  const StepMeasures m = StepMeter(motion, motion.guess).measure();
  CHECK(m.slip < 2e-3);
  CHECK(m.penetration < 1.5e-3);
  CHECK(m.foothold < 2e-3);
  CHECK(m.pressure < 1);
  CHECK(m.tilt < 0.3);
  CHECK(m.end.z() - m.start.z() == Approx(0.1).margin(0.01));
  CHECK(m.final_speed < 5e-3);
}

TEST_CASE("sequence: what does not fit together is refused by name") {
  const auto getErrorOf = [](const std::vector<SequencePart>& parts) {
    return getError([&] { makeSequence(getBipetto(), parts); });
  };
  CHECK_THAT(getErrorOf({}), Catch::Contains("no motion"));
  WalkOptions slippery;
  slippery.gait.friction = 0.4;
  CHECK_THAT(getErrorOf({makePart("walk", planWalk, WalkOptions()), makePart("walk2", planWalk, slippery)}),
             Catch::Contains("walk2.friction"));
  // Down again at a right angle: its steps lie across those that lead up.
  TurnOptions turn;
  turn.angle = 1.57;
  CHECK_THAT(getErrorOf({makePart("stairs", planStairs, makeStairsOf(0.06)), makePart("turn", planTurn, turn),
                         makePart("stairs2", planStairs, makeStairsOf(-0.06))}),
             Catch::Contains("higher ground"));
}
