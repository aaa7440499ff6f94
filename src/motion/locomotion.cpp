#include "bielle/motion/locomotion.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "bielle/model/error.h"
#include "math/constants.h"
#include "math/so3.h"
#include "model/number_text.h"
#include "motion/cycle.h"
#include "motion/feasibility.h"
#include "motion/foot_tasks.h"
#include "motion/kinematic_guess.h"
#include "motion/locomotion_stages.h"
#include "motion/neighbour_plans.h"
#include "motion/statics.h"

namespace bielle {
namespace {

void check(const LocomotionOptions& o) {
  listOptions(o).check();
  requireOption(std::abs(o.stretch) <= 0.5, "stretch", "it is not within 0.5 m", "give metres, e.g. 0");
  requireOption(o.swing.apex > 0 && o.swing.apex < 1, "swing_apex", "it is not between 0 and 1", "e.g. 0.5");
  requireOption(o.swing.leave < o.swing.arrive, "swing_leave", "it is not before swing_arrive", "e.g. 0 and 1");
  requireOption(o.landing_speed == 0 || o.rigid_landing, "landing_speed",
                "without an impact nothing stops a landing foot", "add rigid_landing=true, or leave it out");
  requireOption(o.landing_speed < 0.1, "landing_speed", "feet that land at 0.1 m/s or more do not pass the check",
                "give a lower speed, e.g. 0.05");
}

// The left one if both are level.
const SE3& getLowerFoot(const Stance& stance) {
  return stance.feet[stance.feet[1].p.z() < stance.feet[0].p.z() - kLevelSoles ? 1 : 0];
}

// The same with both feet on the ground on which it steps.
Stance putDown(const Stance& stance) {
  Stance down = stance;
  if (!areLevel(listSoles(stance)))
    for (SE3& foot : down.feet) foot.p.z() = stance.middle.p.z();
  return down;
}

[[noreturn]] void refuseStep(const Scene& scene, int step, const std::string& problem, const std::string& remedy) {
  throw InputError(scene.model.name(), "step " + std::to_string(step) + " of the " + scene.task.name, problem, remedy);
}

// A speed that robots reach, for a remedy: with a share of the steps' length, and walks at half of the speed at which weight no longer
// holds a body on the arc about a straight leg.
double calcModerateSpeed(const Scene& scene, double share, double height) {
  double most = share * std::abs(scene.task.speed);
  if (scene.options.timing.flight == 0) most = std::min(most, 0.5 * std::sqrt(scene.model.gravity().norm() * height));
  return std::copysign(most, scene.task.speed);
}

// The share of a step's length and turn at which feet that would be `apart`, and stand `still` apart, are `wanted` apart.
double calcShare(const Eigen::Vector2d& still, const Eigen::Vector2d& apart, double wanted) {
  const Eigen::Vector2d moved = apart - still;
  const double a = moved.squaredNorm(), b = still.dot(moved), c = still.squaredNorm() - wanted * wanted;
  if (c >= 0) return 0;
  return a > 0 ? (std::sqrt(b * b - a * c) - b) / a : std::numeric_limits<double>::infinity();
}

// Legs as struts from the middle of the hips' plane, half way between two consecutive footholds at touchdown.
// \param strut, height  of the centre of mass over the feet, at the start
void checkReach(const Scene& scene, double strut, double height) {
  constexpr double kStretch = 1.15, kCrouch = 0.6;  // of the legs, over their length in the standing posture
  constexpr double kEasy = 0.45;                    // of what legs bridge: steps for which postures are found
  const double bridged = 2 * std::sqrt(std::pow(kStretch * strut, 2) - std::pow(kCrouch * height, 2));
  int refused = 0;  // the first step, the way to which is too far
  double share = std::numeric_limits<double>::infinity(), across = 0, up = 0;
  for (const GaitPhase& phase : scene.gait.phases) {
    if (phase.isDoubleSupport() || phase.flies()) continue;
    const int side = phase.stands(Side::Left) ? 0 : 1, i = phase.steps_done;
    const Vector3d apart = scene.task.plan.steps[i].X_WF.p - scene.task.plan.getStance(i)[side].p;
    const double level = apart.head<2>().norm(), height_apart = std::abs(apart.z());
    const Vector3d still = scene.stance.feet[1 - side].p - scene.stance.feet[side].p;
    share = std::min(share, calcShare(still.head<2>(), apart.head<2>(), kEasy * bridged));
    if (refused > 0 || std::hypot(level / 2, kCrouch * height + height_apart / 2) <= kStretch * strut) continue;
    refused = i + 1, across = level, up = height_apart;
  }
  if (refused == 0) return;
  const double slack = std::pow(kStretch * strut, 2) - std::pow(across / 2, 2);
  const double climb = up > 1e-3 && slack > 0 ? 2 * (std::sqrt(slack) - kCrouch * height) : 0;
  // That of stairs changes no step.
  const double speed = up > 1e-3 ? 0 : calcModerateSpeed(scene, share, height);
  refuseStep(scene, refused,
             "its foothold is out of reach: the feet would be " + formatNumber(across, "%.3g") + " m apart" +
                 (up > 1e-3 ? ", and " + formatNumber(up, "%.3g") + " m in height" : "") + "; these legs bridge " +
                 formatNumber(bridged, "%.3g") + " m on the level" +
                 (climb > 0 ? ", or climb " + formatNumber(0.99 * climb, "%.3g") + " m with feet that far apart" : ""),
             "give lengths in metres; request shorter or lower steps" +
                 (speed != 0 ? ", by a speed of e.g. " + formatNumber(speed, "%.2g") + " m/s" : ""));
}

// Of a foot in one of the steps up to `last`, rad.
double calcLargestTurn(const FootstepPlan& plan, int last) {
  double most = 0;
  for (int i = 0; i <= std::min(last, static_cast<int>(plan.steps.size()) - 1); ++i) {
    const Footstep& step = plan.steps[i];
    const SE3 before = plan.getStance(i)[static_cast<int>(step.side)];
    most = std::max(most, std::abs(std::remainder(calcHeading(step.X_WF) - calcHeading(before), 2 * kPi)));
  }
  return most;
}

// Rejects requests that no motor torques can satisfy.
void check(const Scene& scene) {
  constexpr double kLowest = 0.4, kHighest = 1.5;  // of the centre of mass over the feet, over its height at the start
  const Model& model = scene.model;
  const ContactFrame& left = model.contacts()[scene.stance.contacts[0]];
  const ContactFrame& right = model.contacts()[scene.stance.contacts[1]];
  requireSolesApart(model, listSoles(scene.stance));
  for (const GaitNode& node : scene.gait.nodes) {
    const std::array<SE3, 2> feet = getFeet(scene, node);
    if (calcSoleDistance(left, feet[0], right, feet[1]) > 0) continue;
    const double turn = calcLargestTurn(scene.task.plan, scene.gait.phases[node.phase].steps_done);
    refuseStep(scene, scene.gait.phases[node.phase].steps_done + 1,
               "the feet would collide: the stance is too narrow for the soles on this path",
               std::string(turn > kLargeTurn ? "give radians if degrees were meant; " : "") +
                   "turn or step less at a time, with more steps");
  }
  const Vector3d strut_of_stance = scene.stance.com - getLowerFoot(scene.stance).p;
  const double strut = strut_of_stance.norm(), height = strut_of_stance.z();
  requireOption(scene.options.swing.height < strut, "swing_height",
                formatNumber(scene.options.swing.height) + " m is more than the legs are long, " +
                    formatNumber(strut, "%.3g") + " m",
                "give metres, e.g. " + formatNumber(0.1 * strut, "%.1g"));
  if (scene.options.timing.flight > 0)
    for (const GaitNode& node : scene.gait.nodes) {
      const GaitPhase& phase = scene.gait.phases[node.phase];
      const std::array<SE3, 2> feet = scene.task.plan.getStance(phase.steps_done);
      const double over = node.com.z() - std::min(feet[0].p.z(), feet[1].p.z());
      if (!phase.flies() && !(over > kLowest * height && over < kHighest * height))
        refuseStep(scene, phase.steps_done + 1,
                   "the centre of mass would have to move to " + formatNumber(over, "%.3g") +
                       " m over the feet, from " + formatNumber(height, "%.3g") +
                       " m at the start, to take off and land",
                   "request a shorter flight, or a longer stance");
    }
  checkReach(scene, strut, height);
}

std::vector<Goal> makeFootholdGoals(const Scene& scene, const ContactSchedule& schedule) {
  constexpr double kTolerance = 0.01;  // m
  const double room = std::hypot(scene.options.foothold_room, scene.options.foothold_room);
  Goal goal{GoalKind::Footholds, "footholds", 0, std::max(kTolerance, room), 0, schedule.numStages()};
  const std::vector<int> landings = listLandings(schedule);
  const std::vector<Footstep>& steps = scene.task.plan.steps;
  for (size_t i = 0; i < std::min(steps.size(), landings.size()); ++i)
    goal.footholds.push_back({scene.model.contacts()[scene.stance.contacts[static_cast<int>(steps[i].side)]].name,
                              landings[i], steps[i].X_WF.p});
  return {goal};
}

// Of heights from their limits, over the height of the centre of mass: more than the steps in which LegReach measures those, so
// that robots a little beside one another have no limits if one of them is that far from all.
constexpr double kReachMargin = 0.02;

// Raises the path of the centre of mass where a leg would have to bend too far, and lowers it where one would be too short;
// between two legs that cannot both be helped it stays in the middle.
void keepReach(Scene& scene) {
  const Stance& stance = scene.stance;
  std::optional<bool>* reaches = stance.neighbours ? &stance.neighbours->getReach() : nullptr;
  if (reaches && reaches->value_or(false)) return;
  bool all = true;
  const Stance down = putDown(stance);
  LegReach reach(scene.model, down);
  Gait& gait = scene.gait;
  const int size = static_cast<int>(gait.nodes.size());
  VectorXd lift(size);
  for (int k = 0; k < size; ++k) {
    const GaitNode& node = gait.nodes[k];
    const std::array<SE3, 2> feet = getFeet(scene, node);
    const Matrix3d turn = makeAxisRotation(Vector3d::UnitZ(), node.heading);
    const Matrix3d axes = turn * stance.middle.R;
    double lower = -std::numeric_limits<double>::infinity(), upper = -lower;
    for (int i = 0; i < 2; ++i) {
      const Vector3d apart = axes.transpose() * (node.com + turn * (stance.feet[i].p - stance.com) - feet[i].p);
      const LegReach::Heights heights = reach.calc(apart.x(), apart.y());
      lower = std::max(lower, feet[i].p.z() + heights.shortest);
      upper = std::min(upper, feet[i].p.z() + heights.longest);
    }
    const double z = node.com.z(), margin = kReachMargin * (stance.com.z() - getLowerFoot(stance).p.z());
    all &= lower + margin < z && z < upper - margin;
    lift[k] = (lower < upper ? std::clamp(z, lower, upper) : 0.5 * (lower + upper)) - z;
  }
  if (reaches) *reaches = all;
  if (all) return;
  const double h = scene.options.timing.time_step;
  const VectorXd smooth = smoothen(lift, countNodes(scene.options.timing.stepDuration() / 4, h));
  for (int k = 0; k < size; ++k) gait.nodes[k].com.z() += smooth[k];
  for (int k = 0; k + 1 < size; ++k) gait.nodes[k].com_velocity = (gait.nodes[k + 1].com - gait.nodes[k].com) / h;
}

// At rest at every node of the gait, with the feet where it has them.
std::vector<VectorXd> makeGuesses(const Scene& scene) {
  std::vector<VectorXd> xs;
  std::vector<PlannedPosture> postures;
  for (const GaitNode& node : scene.gait.nodes) {
    xs.push_back(makeGuess(scene, node));
    const GaitPhase& phase = scene.gait.phases[node.phase];
    postures.push_back({xs.back().head(scene.model.nq()),
                        getFeet(scene, node),
                        {phase.stands(Side::Left), phase.stands(Side::Right)}});
  }
  if (scene.stance.neighbours) return xs;
  const std::vector<VectorXd> qs = placeFeet(scene.model, scene.stance, postures);
  for (size_t k = 0; k < xs.size(); ++k) xs[k].head(scene.model.nq()) = qs[k];
  return xs;
}

}  // namespace

Gait makeStartingGait(const Model& model, const Stance& stance, const LocomotionTask& task,
                      const LocomotionOptions& options) {
  constexpr double kStep = 0.05, kLongest = 2;  // s
  const double gravity = model.gravity().norm(), height = stance.com.z() - getLowerFoot(stance).p.z();
  const double tau = std::sqrt(height / gravity);
  const double half =
      std::min(model.contacts()[stance.contacts[0]].half_length, model.contacts()[stance.contacts[1]].half_length);
  const Vector3d forward = stance.middle.R.col(0);
  GaitTiming timing = options.timing;
  for (;; timing.start += kStep) {
    Gait gait = makeGait(task, timing, options.swing, options.stretch, stance.com, gravity);
    const double v = std::abs(forward.dot(gait.nodes[0].com_velocity)), T = timing.start;
    if (v * tau <= options.start_pressure * half * (1 - std::exp(-T / tau))) return gait;
    if (options.start_pressure == 0 || half == 0 || T > kLongest) return gait;
  }
}

std::vector<Goal> makeSpeedGoals(const ContactSchedule& schedule, double speed, const Vector3d& direction,
                                 int steps_per_cycle) {
  const std::vector<int> landings = listLandings(schedule);
  const int size = static_cast<int>(landings.size());
  const int first = size - 4 >= steps_per_cycle ? 1 : 0, cycles = (size - 2 - 2 * first) / steps_per_cycle;
  if (cycles < 1) return {};
  const int last = first + cycles * steps_per_cycle;
  Goal goal{GoalKind::Speed, "speed", speed, calcTolerance(speed, 0.02), landings[first], landings[last]};
  goal.direction = direction;
  return {goal};
}

Stance makeStance(const Model& model, const LocomotionOptions& options, const StandingRobot& standing) {
  if (!model.hasFreeFlyer())
    throw InputError(model.name(), "root joint",
                     "its base is fixed, or moves on a rail, but a motion with steps needs a free one over two feet",
                     "take `squat` or `jump`, which need no steps, or a robot with a free base");
  requireGravity(model, options.friction);
  Stance stance{standing.q, standing.com, {}, {}, {}, standing.neighbours};
  for (int i = 0; i < 2; ++i) {
    const std::string& name = i == 0 ? options.left : options.right;
    stance.contacts[i] = model.findContact(name);
    if (stance.contacts[i] < 0)
      throw InputError(model.name(), "contact '" + name + "'", "a walk needs it, but the robot has no such contact",
                       "name the contacts of its left and right foot");
    stance.feet[i] = standing.contacts[static_cast<size_t>(stance.contacts[i])];
  }
  stance.middle = calcMiddle(stance.feet[0], stance.feet[1]);
  if (!areLevel(listSoles(stance))) stance.middle.p.z() = getLowerFoot(stance).p.z();
  return stance;
}

std::vector<ContactTarget> listSoles(const Stance& stance) {
  std::vector<ContactTarget> soles;
  for (int i = 0; i < 2; ++i) soles.push_back({stance.contacts[i], stance.feet[i]});
  return soles;
}

Goal makeCycleSpeedGoal(const ContactSchedule& schedule, double speed, const Vector3d& direction) {
  Goal goal{GoalKind::Speed, "speed", speed, calcTolerance(speed, 0.02), 0, schedule.numStages()};
  goal.direction = direction;
  return goal;
}

MotionPlan planLocomotion(const Model& model, const Stance& stance, const LocomotionTask& requested_task,
                          const LocomotionOptions& requested) {
  check(requested);
  LocomotionTask task = requested_task;
  LocomotionOptions options = requested;
  if (options.timing.time_step == 0)
    options.timing.time_step = chooseTimeStep(task, options.timing, options.swing, calcSpringStage(model, stance));
  const RobotSize size = calcRobotSize(model, stance);
  scaleWeights(size, options);
  Scene scene{model,
              stance,
              task,
              options,
              size,
              makeStartingGait(model, stance, task, options),
              makeStageWeights(model, size, options)};
  check(scene);
  if (options.timing.flight == 0) keepReach(scene);
  MotionPlan plan;
  if (task.lead > 0) plan.cycle = cutCycle(stance.middle, task, scene.gait);
  std::vector<ContactTarget> soles;
  for (const GaitPhase& phase : scene.gait.phases)
    for (const ContactTarget& sole : makeTargets(scene, phase)) soles.push_back(sole);
  scene.ramp = chooseRamp(model, task.ground, soles);
  plan.name = task.name;
  plan.ground = task.ground;
  plan.ground.friction = options.friction;
  const std::vector<VectorXd> guess = makeGuesses(scene);
  size_t node = 0;
  for (const GaitPhase& phase : scene.gait.phases) {
    const std::vector<ContactTarget> contacts = makeTargets(scene, phase);
    const VectorXd u = phase.flies() || stance.neighbours
                           ? VectorXd::Zero(model.nu()).eval()
                           : calcStaticTorques(model, makeConstraintSet(model, contacts), stance.q).u;
    if (scene.gait.nodes[node].landed >= 0 && options.rigid_landing) {
      plan.schedule.phases.push_back({"impact", 1, 0, contacts});
      plan.stages.push_back(makeImpact(scene, scene.gait.nodes[node], contacts));
      plan.guess.us.push_back(VectorXd::Zero(model.nu()));
      plan.guess.xs.push_back(guess[node]);
    }
    plan.schedule.phases.push_back({nameOf(phase), phase.nodes, options.timing.time_step, contacts});
    for (int i = 0; i < phase.nodes; ++i, ++node) {
      plan.stages.push_back(makeStage(scene, static_cast<int>(node), contacts));
      plan.guess.us.push_back(u);
      plan.guess.xs.push_back(guess[node]);
    }
  }
  plan.stages.push_back(plan.cycle ? makeSeam(scene) : makeTerminalStage(scene));
  plan.guess.xs.push_back(guess.back());
  const auto end = task.plan.getStance(static_cast<int>(task.plan.steps.size()));
  plan.goals = makeFootholdGoals(scene, plan.schedule);
  plan.q_start = stance.q;
  if (plan.cycle) {
    plan.q_end = carryPosture(model, stance.q, *plan.cycle);
    return plan;
  }
  plan.q_end = areLevel(listSoles(stance))
                   ? carryPosture(model, stance.q, calcMiddle(end[0], end[1]) * stance.middle.inverse())
                   : guess.back().head(model.nq()).eval();  // on level feet
  return plan;
}

}  // namespace bielle
