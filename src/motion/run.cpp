#include "bielle/motion/run.h"

#include <algorithm>

#include "motion/gait.h"
#include "motion/statics.h"

namespace bielle {
namespace {

constexpr int kSteadySteps = 8;  // shorter runs do not reach their speed: the steps at both ends are half as long

// Every foot lands by `displacements` ahead of where it stood at the start, along x of the feet.
std::vector<Footstep> moveAhead(const Stance& stance, const std::vector<std::pair<Side, double>>& displacements) {
  const Vector3d forward = stance.middle.R.col(0);
  std::vector<Footstep> steps;
  for (const auto& [side, displacement] : displacements) {
    SE3 X = stance.feet[static_cast<int>(side)];
    X.p += displacement * forward;
    steps.push_back({side, X});
  }
  return steps;
}

// Steps with flights along x of the feet at the start.
template <typename Options>
MotionPlan planFlights(const Model& model, const Stance& stance, LocomotionTask task, const Options& options) {
  LocomotionOptions gait = options.gait;
  gait.timing.flight = options.flight;
  gait.timing.single = options.stance;
  if (gait.timing.time_step == 0)
    gait.timing.time_step = chooseTimeStep(task, gait.timing, gait.swing, calcSpringStage(model, stance));
  requireOption(options.stance >= 4 * gait.timing.time_step, "stance", "it is shorter than four time steps",
                "give seconds, e.g. 0.25");
  task.ground.height = stance.middle.p.z();
  task.direction = stance.middle.R.col(0);
  MotionPlan plan = planLocomotion(model, stance, task, gait);
  plan.options = listOptions(options).listValues();
  return plan;
}

// All flights together.
Goal makeFlightGoal(const ContactSchedule& schedule, int flights, double flight) {
  const double time_step = schedule.phases.front().dt;
  return {GoalKind::FlightTime, "time in the air", flights * flight, flights * calcTolerance(flight, time_step / 2), 0,
          schedule.numStages()};
}

}  // namespace

MotionPlan planRun(const Model& model, const RunOptions& o, const StandingRobot& standing) {
  listOptions(o).check();
  const int steps = o.periodic ? countCycleSteps(o.cycles) : o.steps;
  const Stance stance = makeStance(model, o.gait, standing);
  requireLevel(model, listSoles(stance), "run");
  const double length = o.speed * (o.stance + o.flight);
  std::vector<std::pair<Side, double>> landings;
  for (int i = 1; i <= steps; ++i)
    landings.emplace_back(i % 2 != 0 ? Side::Right : Side::Left,
                          i + 1 < steps ? (i - 0.5) * length : (steps - 2) * length);
  LocomotionTask task;
  task.name = "run";
  task.plan = {stance.feet, moveAhead(stance, landings)};
  task.support = Side::Left;
  task.speed = o.speed;
  task.lead = o.periodic ? kCycleLead : 0;
  task.cycles = o.cycles;
  MotionPlan plan = planFlights(model, stance, task, o);
  const Vector3d forward = stance.middle.R.col(0);
  std::vector<Goal> goals;
  if (o.periodic)
    goals = {makeCycleSpeedGoal(plan.schedule, o.speed, forward)};
  else if (steps >= kSteadySteps)
    goals = makeSpeedGoals(plan.schedule, o.speed, forward);
  goals.push_back(makeFlightGoal(plan.schedule, o.periodic ? 2 * o.cycles : steps - 1, o.flight));
  plan.goals.insert(plan.goals.begin(), goals.begin(), goals.end());
  return plan;
}

MotionPlan planHop(const Model& model, const HopOptions& o, const StandingRobot& standing) {
  listOptions(o).check();
  const Stance stance = makeStance(model, o.gait, standing);
  requireLevel(model, listSoles(stance), "hop");
  const Side side = o.foot;
  const int hops = o.hops;
  std::vector<std::pair<Side, double>> landings;
  for (int i = 1; i <= hops; ++i) landings.emplace_back(side, i * o.length);
  landings.emplace_back(getOther(side), hops * o.length);
  LocomotionTask task;
  task.name = "hop";
  task.plan = {stance.feet, moveAhead(stance, landings)};
  task.support = side;
  MotionPlan plan = planFlights(model, stance, task, o);
  Goal length{GoalKind::Displacement,   "length", hops * o.length, calcTolerance(hops * o.length, 0.01), 0,
              plan.schedule.numStages()};
  length.direction = stance.middle.R.col(0);
  for (int contact : stance.contacts) length.contacts.push_back(model.contacts()[contact].name);
  const Goal flight = makeFlightGoal(plan.schedule, hops, o.flight);
  plan.goals.insert(plan.goals.begin(), {flight, length});
  return plan;
}

Motion makeRun(const Model& model, const RunOptions& options, const ProblemOptions& problem) {
  return makeMotion(model, planRun(model, options, makeStandingRobot(model)), problem);
}

Motion makeHop(const Model& model, const HopOptions& options, const ProblemOptions& problem) {
  return makeMotion(model, planHop(model, options, makeStandingRobot(model)), problem);
}

}  // namespace bielle
