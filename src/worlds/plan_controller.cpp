#include <algorithm>

#include "bielle/dynamics/ball_cuts.h"
#include "control/restricted_controller.h"
#include "worlds/plan.h"

namespace bielle::worlds {
namespace {

constexpr double kStopShare = 0.5;  // of the margin to dead points that the plan keeps

// In states of a model that has fewer joints.
ShootingTrajectory restrictTrajectory(const Model& from, const Model& model, ShootingTrajectory trajectory) {
  for (VectorXd& x : trajectory.xs) {
    const VectorXd all = x;
    x.resize(model.nq() + model.nv());
    x << restrictConfiguration(from, model, all.head(from.nq())), restrictVelocity(from, model, all.tail(from.nv()));
  }
  return trajectory;
}

// Of a motion that repeats, so many times. The last state of each is the first of the next.
ShootingTrajectory repeatTrajectory(const Solution& solution, int cycles) {
  const Motion& motion = solution.motion;
  const ShootingTrajectory& cycle = solution.trajectory;
  ShootingTrajectory out = cycle;
  SE3 X;
  for (int i = 1; i < cycles; ++i) {
    X = *motion.cycle * X;
    for (size_t k = 0; k < cycle.us.size(); ++k) {
      out.xs.push_back(carryState(motion.problem->model(), cycle.xs[k + 1], X));
      out.us.push_back(cycle.us[k]);
    }
  }
  return out;
}

// Along a plan, with the model cut at its balls. \param goals  of the plan, then as far as feet that may land elsewhere meet them
std::unique_ptr<PredictiveController> predict(const Plan& plan, const Model& cut, PredictiveOptions options,
                                              std::vector<Goal>& goals) {
  const Model& model = plan.model();
  const Solution& solution = *plan.solution;
  const Motion& motion = solution.motion;
  const ProblemOptions& problem = motion.problem_options;
  // A plan may be closer to a dead point than motors would let it come, or start from one: without a margin there is no stop.
  options.dead_point_stop = std::min(options.dead_point_stop, kStopShare * problem.limits.dead_point_margin);
  const VectorXd q0 = restrictConfiguration(model, cut, motion.problem->initialState().head(model.nq()));
  MotionRequest freed = *motion.request;
  const StandingRobot standing = makeStandingRobot(cut, q0);
  freeFeet(cut, standing, motion.ground, freed.options);
  if (plan.cycles > 1) freed.options.set("cycles", plan.cycles * freed.options.get<int>("cycles"));
  MotionPlan planned = freed.plan(cut, standing);
  for (size_t i = 0; i < std::min(goals.size(), planned.goals.size()); ++i)
    if (goals[i].kind == GoalKind::Footholds) goals[i].tolerance = planned.goals[i].tolerance;
  return std::make_unique<PredictiveController>(makePredictiveMotion(cut, std::move(planned), problem, options),
                                                restrictTrajectory(model, cut, repeatTrajectory(solution, plan.cycles)),
                                                options);
}

}  // namespace

PlanController makeController(const Plan& plan, const ControlOptions& options) {
  const Model& model = plan.model();
  PlanController out;
  out.goals = plan.goals;
  if (options.control == PlanControl::Predictive) {
    const Model cut = plan.walk ? plan.walk->model() : plan.serial ? model : cutAtBalls(model);
    auto prediction = plan.walk ? std::make_unique<PredictiveController>(*plan.walk, options.predictive)
                                : predict(plan, cut, options.predictive, out.goals);
    out.prediction = prediction.get();
    out.law = std::move(prediction);
    if (!cut.isCopyOf(model)) out.law = std::make_unique<RestrictedController>(model, cut, std::move(out.law));
  } else {
    out.law = std::make_unique<Policy>(plan.policy);
  }
  if (plan.serial) {
    auto serial =
        std::make_unique<SerialController>(plan.robot.model, *plan.serial, std::move(out.law), plan.belief, plan.maps);
    out.maps = serial->maps();
    out.law = std::move(serial);
  }
  return out;
}

}  // namespace bielle::worlds
