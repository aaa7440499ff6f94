#include <algorithm>
#include <cmath>

#include "bielle/dynamics/ball_cuts.h"
#include "bielle/model/error.h"
#include "bielle/robots/robot_loader.h"
#include "worlds/plan.h"

namespace bielle::worlds {
namespace {

// A stage of a policy without feedback.
Policy::Stage makeStage(const Model& model, double start, double duration, const CommandedWalk::Stage& now,
                        const CommandedWalk::Stage& next) {
  const int nq = model.nq(), nv = model.nv();
  Policy::Stage stage;
  stage.start = start;
  stage.duration = duration;
  stage.phase = now.phase;
  stage.q = now.x.head(nq);
  stage.v = now.x.tail(nv);
  stage.q_change = model.difference(stage.q, next.x.head(nq));
  stage.v_next = next.x.tail(nv);
  stage.u = now.u;
  return stage;
}

// The path of the commands, as far as it is foreseen.
Plan foresee(CommandedWalk walk, double duration) {
  const double h = walk.timeStep();
  const int count = std::max(1, static_cast<int>(std::ceil(duration / h)));
  ContactSchedule schedule;
  std::vector<Policy::Stage> stages;
  CommandedWalk::Stage now = walk.makeNext();
  int phase = -1;
  for (int k = 0; k < count; ++k) {
    requireNoInterrupt();
    if (now.phase != phase) schedule.phases.push_back({now.phase_name, 0, h, now.contacts});
    phase = now.phase;
    ++schedule.phases.back().nodes;
    CommandedWalk::Stage next = walk.makeNext();
    stages.push_back(makeStage(walk.model(), k * h, h, now, next));
    now = std::move(next);
  }
  return {Policy(walk.model(), std::move(stages), now.u), schedule};
}

}  // namespace

Plan makeCommandedPlan(const PlanRequest& request, const std::string& file) {
  if (request.motion != "walk")
    throw InputError(file, "motion '" + request.motion + "'", "it does not follow commands", "give 'walk'");
  const std::vector<TimedCommand> commands = readCommands(file);
  const LoadedRobot robot = loadRobot(request.robot);
  const Model& model = robot.model;
  OptionSet set = listOptions(LocomotionOptions());
  for (const auto& [name, value] : request.settings) set.set(name, value);
  auto options = readOptions<LocomotionOptions>(set);
  const StandingRobot standing = makeStandingRobot(model);
  for (size_t i = 0; i < commands.size(); ++i)
    checkCommand(model, standing, options, commands[i].velocity, file + ", command " + std::to_string(i + 1));
  freeFeet(model, standing, Ground(), set);
  options = readOptions<LocomotionOptions>(set);
  const CommandSource source = [commands](double time) { return findCommand(commands, time); };
  Plan plan = foresee(CommandedWalk(model, options, {}, source, standing),
                      request.duration > 0 ? request.duration : commands.back().time);
  plan.ground.height = makeStance(model, options, standing).feet[0].p.z();
  plan.ground.friction = options.friction;
  plan.robot = robot;
  MotionSummary& summary = plan.summary;
  summary.motion = request.motion;
  summary.run = makeRunInfo(request.robot, robot);
  summary.formulation = Formulation::Reduced;
  summary.step = StepRule::Midpoint;
  summary.options = set.listValues();
  const Model cut = cutAtBalls(model);
  const StandingRobot standing_cut = makeStandingRobot(cut, restrictConfiguration(model, cut, standing.q));
  plan.walk.emplace(cut, options, LimitOptions(), source, standing_cut);
  plan.commands = commands;
  return plan;
}

}  // namespace bielle::worlds
