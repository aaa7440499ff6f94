#include "worlds/commanded_plan.h"

#include <cmath>

#include "bielle/dynamics/ball_cuts.h"
#include "bielle/model/error.h"
#include "bielle/robots/robot_loader.h"

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

// Sets reference and contacts of the plan, from the walk as it is foreseen.
void foresee(CommandedWalk walk, double duration, Plan& plan) {
  const double h = walk.timeStep();
  const int count = std::max(1, static_cast<int>(std::ceil(duration / h)));
  std::vector<Policy::Stage> stages;
  CommandedWalk::Stage now = walk.makeNext();
  int phase = -1;
  for (int k = 0; k < count; ++k) {
    requireNoInterrupt();
    if (now.phase != phase) plan.schedule.phases.push_back({now.phase_name, 0, h, now.contacts});
    phase = now.phase;
    ++plan.schedule.phases.back().nodes;
    CommandedWalk::Stage next = walk.makeNext();
    stages.push_back(makeStage(plan.robot.model, k * h, h, now, next));
    now = std::move(next);
  }
  plan.policy = std::make_unique<Policy>(plan.robot.model, std::move(stages), now.u);
}

}  // namespace

std::unique_ptr<Plan> makeCommandedPlan(const PlanRequest& request, const std::string& file,
                                        const PredictiveOptions& predictive) {
  if (request.motion != "walk")
    throw InputError(file, "motion '" + request.motion + "'", "it does not follow commands", "give 'walk'");
  auto plan = std::make_unique<Plan>();
  plan->commands = readCommands(file);
  plan->robot = loadRobot(request.robot);
  const Model& model = plan->robot.model;
  OptionSet set = listOptions(LocomotionOptions());
  for (const auto& [name, value] : request.settings) set.set(name, value);
  auto options = readOptions<LocomotionOptions>(set);
  const StandingRobot standing = makeStandingRobot(model);
  for (size_t i = 0; i < plan->commands.size(); ++i)
    checkCommand(model, standing, options, plan->commands[i].velocity, file + ", command " + std::to_string(i + 1));
  freeFeet(options);
  MotionSummary& summary = plan->summary;
  summary.motion = request.motion;
  summary.run = {request.robot, plan->robot.file, {}};
  summary.formulation = Formulation::Reduced;
  summary.step = StepRule::Midpoint;
  summary.options = listOptions(options).listValues();
  const CommandSource source = [commands = plan->commands](double time) { return findCommand(commands, time); };
  const CommandedWalk walk(model, options, {}, source, standing);
  foresee(walk, request.duration > 0 ? request.duration : plan->commands.back().time, *plan);
  plan->ground.height = makeStance(model, options, standing).feet[0].p.z();
  plan->ground.friction = options.friction;
  const Model cut = cutAtBalls(model);
  const StandingRobot standing_cut = makeStandingRobot(cut, restrictConfiguration(model, cut, standing.q));
  plan->predictive =
      std::make_unique<PredictiveController>(CommandedWalk(cut, options, {}, source, standing_cut), predictive);
  adaptPredictive(cut, *plan);
  return plan;
}

}  // namespace bielle::worlds
