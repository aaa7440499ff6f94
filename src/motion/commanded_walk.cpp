#include "bielle/motion/commanded_walk.h"

#include <algorithm>

#include "motion/applied_options.h"
#include "motion/foot_tasks.h"
#include "motion/locomotion_stages.h"
#include "motion/statics.h"

namespace bielle {
namespace {

constexpr double kTimeStep = 0.012;  // s
constexpr int kForeseenSteps = 2;    // beyond that whose stages are made; one more brings the feet together

LocomotionOptions complete(const Model& model, LocomotionOptions options, const StandingRobot& standing) {
  options.timing.flight = options.landing_speed = 0;
  options.rigid_landing = false;
  const Stance stance = makeStance(model, options, standing);
  if (options.timing.time_step == 0) options.timing.time_step = std::min(kTimeStep, calcSpringStage(model, stance));
  scaleWeights(calcRobotSize(model, stance), options);
  return options;
}

// Single and double support, step by step; the last double support is the longest.
std::vector<GaitPhase> listPhases(const GaitTiming& timing, const std::vector<Footstep>& steps) {
  const double h = timing.time_step;
  std::vector<GaitPhase> phases;
  const int size = static_cast<int>(steps.size());
  for (int i = 0; i < size; ++i) {
    GaitPhase single{countNodes(timing.single, h), i, {-1, -1}};
    single.steps[static_cast<int>(steps[i].side)] = i;
    phases.push_back(single);
    phases.push_back({countNodes(i + 1 < size ? timing.both : timing.end, h), i + 1, {-1, -1}});
  }
  return phases;
}

}  // namespace

// What follows the stages made so far, of which the first `nodes` stages are made.
struct CommandedWalk::Segment {
  LocomotionTask task;
  Gait gait;
  int nodes = 0;
};

CommandedWalk::CommandedWalk(const Model& model, const LocomotionOptions& options, const LimitOptions& limits,
                             CommandSource command, const StandingRobot& standing)
    : model_(model),
      options_(complete(model, options, standing)),
      command_(std::move(command)),
      standing_(makeStance(model, options_, standing)),
      limits_(std::make_shared<Limits>(model, limits, standing_.q)),
      feet_(standing_.feet),
      middle_(standing_.middle),
      com_(standing_.com) {
  makeStages();
}

std::vector<StageSpec> CommandedWalk::makeExamples() const {
  CommandedWalk walk(*this);
  walk.stages_.clear();
  walk.state_ = State::Starting;
  walk.makeStages();
  std::vector<StageSpec> examples;
  for (Stage& stage : walk.stages_) examples.push_back(std::move(stage.spec));
  return examples;
}

CommandedWalk::Stage CommandedWalk::makeNext() {
  if (stages_.empty()) makeStages();
  Stage stage = std::move(stages_.front());
  stages_.pop_front();
  return stage;
}

// Steps by the command from here on, and a last one that brings the feet together.
std::vector<Footstep> CommandedWalk::planSteps(const VelocityCommand& command, int count) const {
  const double T = options_.timing.stepDuration();
  const StepCommand step{T * command.forward, T * command.sideways, T * command.turning};
  std::vector<Footstep> steps;
  SE3 P = middle_;
  Side side = swing_;
  for (int i = 0; i <= count; ++i, side = getOther(side)) {
    if (i < count) P = calcNextMiddle(P, step, side);
    steps.push_back({side, P * standing_.middle.inverseTimes(standing_.feet[static_cast<int>(side)])});
  }
  return steps;
}

// The posture in which the robot would stand on its feet where they are.
Stance CommandedWalk::makeStanceHere() const {
  Stance stance = standing_;
  stance.feet = feet_;
  stance.middle = calcMiddle(feet_[0], feet_[1]);
  const SE3 X = stance.middle * standing_.middle.inverse();
  stance.q = carryPosture(model_, standing_.q, X);
  stance.com = X.act(standing_.com);
  return stance;
}

CommandedWalk::Segment CommandedWalk::planSegment(const Stance& stance) {
  const GaitTiming& timing = options_.timing;
  const VelocityCommand command = command_(made_ * timing.time_step);
  Segment segment;
  segment.task.plan = {feet_, {}};
  segment.task.ground.height = standing_.middle.p.z();
  const auto makeGaitHere = [&](std::vector<GaitPhase> phases) {
    segment.gait = makeGait(segment.task, std::move(phases), timing, options_.swing, options_.stretch,
                            {com_, stance.com}, model_.gravity().norm());
  };
  if (state_ == State::Standing && command.isRest()) {
    makeGaitHere({{countNodes(timing.end, timing.time_step), 0, {-1, -1}}});
    segment.nodes = countNodes(timing.both, timing.time_step);
    return segment;
  }
  if (state_ == State::Standing) {
    // The foot that steps first opens the stance, or turns out.
    const double outward = command.sideways != 0 ? command.sideways : command.turning;
    swing_ = outward > 0 ? Side::Left : Side::Right;
    segment.task.plan.steps = planSteps(command, 1 + kForeseenSteps);
    makeGaitHere(makeStartingGait(model_, stance, segment.task, options_).phases);
    segment.nodes = segment.gait.phases[0].nodes;
    state_ = State::Starting;
    return segment;
  }
  const bool closes = state_ == State::Walking && command.isRest();
  segment.task.plan.steps = planSteps(command, closes ? 0 : 1 + kForeseenSteps);
  std::vector<GaitPhase> phases = listPhases(timing, segment.task.plan.steps);
  if (closes) phases.push_back(phases.back());  // and on, at rest
  makeGaitHere(std::move(phases));
  segment.nodes = segment.gait.phases[0].nodes + segment.gait.phases[1].nodes;
  state_ = closes ? State::Standing : State::Walking;
  const Footstep& step = segment.task.plan.steps.front();
  if (!closes) {
    const double T = timing.stepDuration();
    middle_ = calcNextMiddle(middle_, {T * command.forward, T * command.sideways, T * command.turning}, step.side);
  }
  feet_[static_cast<int>(step.side)] = step.X_WF;
  swing_ = getOther(step.side);
  return segment;
}

void CommandedWalk::makeStages() {
  const Stance stance = makeStanceHere();
  Segment segment = planSegment(stance);
  const RobotSize size = calcRobotSize(model_, standing_);
  const Scene scene{model_,
                    stance,
                    segment.task,
                    options_,
                    size,
                    std::move(segment.gait),
                    makeStageWeights(model_, size, options_),
                    chooseRamp(model_, segment.task.ground, {})};
  std::vector<StageSpec> specs;
  std::vector<Stage> made(segment.nodes);
  for (int k = 0; k < segment.nodes; ++k) {
    const GaitNode& node = scene.gait.nodes[k];
    const GaitPhase& phase = scene.gait.phases[node.phase];
    Stage& stage = made[k];
    stage.contacts = makeTargets(scene, phase);
    stage.phase_name = nameOf(phase);
    specs.push_back(makeStage(scene, k, stage.contacts));
    stage.x = makeGuess(scene, node);
    const VectorXd next = makeGuess(scene, scene.gait.nodes[k + 1]);
    stage.x.tail(model_.nv()) =
        model_.difference(stage.x.head(model_.nq()), next.head(model_.nq())) / options_.timing.time_step;
    const std::array<bool, 2> stands{phase.stands(Side::Left), phase.stands(Side::Right)};
    stage.u = findStaticTorques(stands, stage.contacts);
    if (made_ + k > 0 && stands != standing_feet_) ++phase_;
    standing_feet_ = stands;
    stage.phase = phase_;
  }
  addLimitsTo(specs);
  for (int k = 0; k < segment.nodes; ++k) {
    made[k].spec = std::move(specs[k]);
    stages_.push_back(std::move(made[k]));
  }
  com_ = scene.gait.nodes[segment.nodes].com;
  made_ += segment.nodes;
}

// As makeMotion() does.
void CommandedWalk::addLimitsTo(std::vector<StageSpec>& stages) {
  for (StageSpec& stage : stages) {
    stage.step = StepRule::Midpoint;
    limitGains(stage.step, stage.dt, stage.constraints);
  }
  // Those of the first stage and of the last are those of the ends of a motion.
  stages.insert(stages.begin(), StageSpec());
  stages.emplace_back();
  limits_->addTo(stages, false);
  stages.erase(stages.begin());
  stages.pop_back();
}

const VectorXd& CommandedWalk::findStaticTorques(const std::array<bool, 2>& stands,
                                                 const std::vector<ContactTarget>& contacts) {
  VectorXd& u = static_torques_[(stands[0] ? 1 : 0) + (stands[1] ? 2 : 0)];
  if (u.size() == 0) u = calcStaticTorques(model_, makeConstraintSet(model_, contacts), standing_.q).u;
  return u;
}

}  // namespace bielle
