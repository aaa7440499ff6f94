#include "bielle/motion/walk.h"

#include <cmath>

#include "bielle/model/error.h"

namespace bielle {
namespace {

template <typename Options>
Motion makeSteps(const Model& model, const char* name, const StepCommand& command, const Vector3d& velocity, Side first,
                 const Options& options, const ProblemOptions& problem) {
  const int steps = countSteps("steps", options.steps);
  const Stance stance = makeStance(model, options.gait);
  LocomotionTask task;
  task.name = name;
  task.plan = planFootsteps(stance.feet[0], stance.feet[1], command, steps, first);
  task.com_velocity = velocity;
  Motion motion = makeLocomotion(model, stance, task, options.gait, problem);
  Options copy = options;
  for (const OptionEntry& entry : listOptions(copy)) motion.requested.emplace_back(entry.name, *entry.value);
  return motion;
}

std::vector<OptionEntry> join(std::vector<OptionEntry> entries, LocomotionOptions& gait) {
  for (OptionEntry& entry : listOptions(gait)) entries.push_back(std::move(entry));
  return entries;
}

}  // namespace

std::vector<OptionEntry> listOptions(WalkOptions& o) {
  return join({{"speed", &o.speed, "m/s", "of the steady steps; negative: backward"},
               {"steps", &o.steps, "1", "number of steps, the last one brings the feet together"}},
              o.gait);
}

std::vector<OptionEntry> listOptions(SideWalkOptions& o) {
  return join({{"speed", &o.speed, "m/s", "to the left, of the steady steps; negative: to the right"},
               {"steps", &o.steps, "1", "number of steps: one opens the stance, the next one closes it"}},
              o.gait);
}

std::vector<OptionEntry> listOptions(TurnOptions& o) {
  return join({{"angle", &o.angle, "rad", "to turn to the left; negative: to the right"},
               {"radius", &o.radius, "m", "of the arc to walk along; 0: on the spot"},
               {"steps", &o.steps, "1", "number of steps, the last one brings the feet together"}},
              o.gait);
}

void setPaperWeights(WalkOptions& o) { setPaperWeights(o.gait); }

void setPaperWeights(SideWalkOptions& o) {
  setPaperWeights(o.gait);
  o.gait.state_weight = 0.3;
  o.gait.pressure_weight = 1;
  o.gait.feet_distance_weight = 10;
}

Motion makeWalk(const Model& model, const WalkOptions& o, const ProblemOptions& problem) {
  return makeSteps(model, "walk", {o.speed * o.gait.timing.stepDuration(), 0, 0}, Vector3d(o.speed, 0, 0), Side::Right,
                   o, problem);
}

Motion makeSideWalk(const Model& model, const SideWalkOptions& o, const ProblemOptions& problem) {
  return makeSteps(model, "side walk", {0, o.speed * o.gait.timing.stepDuration(), 0}, Vector3d(0, o.speed, 0),
                   o.speed > 0 ? Side::Left : Side::Right, o, problem);
}

Motion makeTurn(const Model& model, const TurnOptions& o, const ProblemOptions& problem) {
  if (!(o.radius >= 0))
    throw ModelError("", "option 'radius'", "it is negative", "give metres, and a negative angle to turn to the right");
  const double yaw = o.angle / std::max(1, countSteps("steps", o.steps) - 1);
  return makeSteps(model, "turn", {2 * o.radius * std::sin(std::abs(yaw) / 2), 0, yaw}, Vector3d::Zero(),
                   yaw > 0 ? Side::Left : Side::Right, o, problem);
}

}  // namespace bielle
