#include "bielle/motion/locomotion.h"

#include <algorithm>
#include <cmath>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/model/error.h"
#include "math/so3.h"
#include "motion/foot_constraints.h"
#include "motion/gait.h"

namespace bielle {
namespace {

// Data common to all stages.
struct Scene {
  const Model& model;
  const Stance& stance;
  const LocomotionTask& task;
  const LocomotionOptions& options;
  Gait gait;
  VectorXd state_weights;  // 2 nv
  double ramp = 0;         // around the steps of the ground, m
};

void check(const LocomotionOptions& o) {
  LocomotionOptions copy = o;
  requireNotNegative(listOptions(copy));
  requireOption(std::abs(o.stretch) <= 0.5, "stretch", "it is not within 0.5 m", "give metres, e.g. 0");
  requirePositive(listOptions(copy), {"friction"});
  requireOption(o.swing.apex > 0 && o.swing.apex < 1, "swing_apex", "it is not between 0 and 1", "e.g. 0.5");
  requireOption(o.swing.leave < o.swing.arrive, "swing_leave", "it is not before swing_arrive", "e.g. 0 and 1");
  requireOption(o.swing.arrive <= 1, "swing_arrive", "it is over 1", "give a part of the swing, e.g. 1");
}

// Lengthens the first double support until Eq. (1) holds.
Gait makeStartingGait(const Model& model, const Stance& stance, const LocomotionTask& task,
                      const LocomotionOptions& options) {
  constexpr double kStep = 0.05, kLongest = 2;  // s
  const double gravity = model.gravity().norm(), height = stance.com.z() - stance.feet[0].p.z();
  const double tau = std::sqrt(height / gravity);
  const double half =
      std::min(model.contacts()[stance.contacts[0]].half_length, model.contacts()[stance.contacts[1]].half_length);
  const Vector3d forward = calcMiddle(stance.feet[0], stance.feet[1]).R.col(0);
  GaitTiming timing = options.timing;
  for (;; timing.start += kStep) {
    Gait gait = makeGait(task, timing, options.swing, options.stretch, stance.com, gravity);
    const double v = std::abs(forward.dot(gait.nodes[0].com_velocity)), T = timing.start;
    if (v * tau <= options.start_pressure * half * (1 - std::exp(-T / tau))) return gait;
    if (options.start_pressure == 0 || half == 0 || T > kLongest) return gait;
  }
}

// Placements of both feet at a node.
std::array<SE3, 2> getFeet(const Scene& scene, const GaitNode& node) {
  const GaitPhase& phase = scene.gait.phases[node.phase];
  std::array<SE3, 2> feet = scene.task.plan.getStance(phase.steps_done);
  for (int i = 0; i < 2; ++i)
    if (phase.steps[i] >= 0) feet[i] = node.swings[i].X_WF;
  return feet;
}

// Rejects requests that no motor torques can satisfy.
void check(const Scene& scene) {
  constexpr double kStretch = 1.15, kCrouch = 0.6;  // of the legs, over their length in the standing posture
  const Model& model = scene.model;
  const ContactFrame& left = model.contacts()[scene.stance.contacts[0]];
  const ContactFrame& right = model.contacts()[scene.stance.contacts[1]];
  const auto refuse = [&](int step, const std::string& problem, const std::string& remedy) {
    throw ModelError(model.name(), "step " + std::to_string(step) + " of the " + scene.task.name, problem, remedy);
  };
  for (const GaitNode& node : scene.gait.nodes) {
    const std::array<SE3, 2> feet = getFeet(scene, node);
    if (calcSoleDistance(left, feet[0], right, feet[1]) <= 0)
      refuse(scene.gait.phases[node.phase].steps_done + 1,
             "the feet would collide: the stance is too narrow for the soles on this path",
             "turn or step less at a time, with more steps");
  }
  // Legs as struts from the middle of the hips' plane, half way between two consecutive footholds at touchdown.
  const double strut = (scene.stance.com - scene.stance.feet[0].p).norm(),
               height = scene.stance.com.z() - scene.stance.feet[0].p.z();
  for (const GaitPhase& phase : scene.gait.phases) {
    if (phase.isDoubleSupport() || phase.flies()) continue;
    const int side = phase.stands(Side::Left) ? 0 : 1, i = phase.steps_done;
    const Vector3d apart = scene.task.plan.steps[i].X_WF.p - scene.task.plan.getStance(i)[side].p;
    if (std::hypot(apart.head<2>().norm() / 2, kCrouch * height + std::abs(apart.z()) / 2) > kStretch * strut)
      refuse(i + 1,
             "its foothold is out of the legs' reach: the feet would be " + std::to_string(apart.norm()) + " m apart",
             "ask for a lower speed, or for shorter, lower or more steps");
  }
}

const ContactFrame& getContact(const Scene& scene, Side side) {
  return scene.model.contacts()[scene.stance.contacts[static_cast<int>(side)]];
}

BodyFrame getFoot(const Scene& scene, Side side) {
  const ContactFrame& contact = getContact(scene, side);
  return {contact.body, contact.X_BF};
}

VectorXd makeWeights(const Model& model, const LocomotionOptions& o) {
  VectorXd weights = makeStateWeights(model);
  weights.segment<3>(3) << o.torso_weight, o.torso_weight, o.heading_weight;
  raiseMotorWeights(model, o.motor_weight, weights);
  return weights;
}

bool isPublished(const Scene& scene) { return scene.options.published != 0; }

std::vector<ContactTarget> makeTargets(const Scene& scene, const GaitPhase& phase) {
  const auto feet = scene.task.plan.getStance(phase.steps_done);
  const double kp = scene.options.foothold_room > 0 ? 0 : scene.options.contact_kp;  // a foot stands where it landed
  std::vector<ContactTarget> targets;
  for (Side side : {Side::Left, Side::Right}) {
    const int i = static_cast<int>(side);
    if (!phase.stands(side)) continue;
    targets.push_back({scene.stance.contacts[i], feet[i], kp, scene.options.contact_kd});
  }
  return targets;
}

std::string nameOf(const GaitPhase& phase) {
  if (phase.flies()) return "flight";
  if (phase.isDoubleSupport()) return "double support";
  return getName(phase.stands(Side::Left) ? Side::Left : Side::Right);
}

// Quaternion (x y z w) of the base: the initial one with a new heading.
Eigen::Vector4d makeHeading(const Scene& scene, const GaitNode& node) {
  const Eigen::Quaterniond start(Eigen::Vector4d(scene.stance.q.segment<4>(3)));
  return (Eigen::Quaterniond(Eigen::AngleAxisd(node.heading, Vector3d::UnitZ())) * start).coeffs();
}

StageSpec makeRegularizedStage(const Scene& scene, const GaitNode& node) {
  const Model& model = scene.model;
  StageSpec stage;
  stage.dt = scene.options.timing.time_step;
  stage.state = {scene.options.state_weight, scene.stance.q, VectorXd::Zero(model.nv()), scene.state_weights};
  stage.state.q_ref.segment<4>(3) = makeHeading(scene, node);
  stage.state.v_ref[5] = node.heading_rate;
  stage.control = {scene.options.control_weight, VectorXd::Zero(model.nu()), VectorXd::Ones(model.nu())};
  return stage;
}

void addCost(StageSpec& stage, const std::string& name, double weight, const VectorXd& weights,
             std::unique_ptr<Residual> residual, bool defines = false) {
  if (weight != 0 && !weights.isZero(0))
    stage.costs.push_back({name, weight, Activation::makeQuadratic(weights), std::move(residual), defines});
}

void addComCosts(const Scene& scene, const GaitNode& node, StageSpec& stage) {
  const LocomotionOptions& o = scene.options;
  addCost(stage, "com", 1, Vector3d(o.com_weight, o.com_weight, o.com_height_weight), makeComPosition(node.com));
  addCost(stage, "com velocity", o.com_velocity_weight, scene.task.direction.cwiseAbs(),
          makeComVelocity(scene.task.speed * scene.task.direction));
}

void addForceCosts(const Scene& scene, const GaitNode& node, StageSpec& stage) {
  const LocomotionOptions& o = scene.options;
  const double weight = scene.model.mass() * scene.model.gravity().norm();
  const ConstraintSet& set = stage.constraints;
  VectorXd loads(set.closures.size() - set.num_loops);
  for (int i = 0; i < loads.size(); ++i) {
    const bool left = set.contacts[i] == scene.stance.contacts[0];
    const double share = isPublished(scene) ? 1.0 / loads.size() : node.load[left ? 0 : 1];
    loads[i] = std::max(1.0, weight * share);
  }
  const ForceAxes axes = isPublished(scene) ? ForceAxes::World : ForceAxes::Contact;
  addGroundCosts(scene.model, {o.force_weight, o.pressure_weight, axes}, loads, stage);
  if (!isPublished(scene)) addWrenchCones(scene.model, o.friction, o.cone_margin, stage);
}

Vector6d makeVector(double x, double z, double rotation) {
  return (Vector6d() << x, x, z, Vector3d::Constant(rotation)).finished();
}

// Height of the ground for the fly-high cost; on stairs it rises along the swing.
double calcGround(const Scene& scene, const GaitNode& node, const Footstep& step) {
  const auto feet = scene.task.plan.getStance(scene.gait.phases[node.phase].steps_done);
  const double standing = feet[static_cast<int>(getOther(step.side))].p.z();
  return standing + node.swings[static_cast<int>(step.side)].progress * (step.X_WF.p.z() - standing);
}

void addSwingCosts(const Scene& scene, const GaitNode& node, const Footstep& step, StageSpec& stage) {
  const LocomotionOptions& o = scene.options;
  const BodyFrame foot = getFoot(scene, step.side);
  const SwingNode& swing = node.swings[static_cast<int>(step.side)];
  const bool free = o.foothold_room > 0;  // along the ground
  addCost(stage, "swing", 1,
          makeVector(free ? o.foothold_weight : o.swing_weight, o.swing_weight, o.swing_rotation_weight),
          makeFramePlacement(foot, swing.X_WF));
  addCost(stage, "swing velocity", 1,
          makeVector(free ? 0 : o.swing_velocity_weight, o.swing_velocity_weight, o.swing_velocity_weight),
          makeFrameVelocity(foot, swing.V_F), true);
  if (!isPublished(scene)) return;
  addCost(stage, "fly high", o.paper.fly_high, Eigen::Vector2d::Ones(),
          makeFlyHigh(foot, o.paper.fly_high_slope, calcGround(scene, node, step)));
  if (o.paper.feet_distance_weight != 0)
    stage.costs.push_back({"feet distance", o.paper.feet_distance_weight,
                           Activation::makeBarrier(VectorXd::Ones(1), VectorXd::Constant(1, o.paper.feet_distance),
                                                   VectorXd::Constant(1, 1e12)),
                           makeFrameDistance(getFoot(scene, Side::Left), getFoot(scene, Side::Right))});
}

// A foot at the first node in the air is where it stood.
void addSwingConstraints(const Scene& scene, const GaitNode& node, int k, StageSpec& stage) {
  if (isPublished(scene)) return;
  const std::array<SE3, 2> feet = getFeet(scene, node);
  bool apart = false;
  for (Side side : {Side::Left, Side::Right}) {
    const int foot = static_cast<int>(side), step = scene.gait.phases[node.phase].steps[foot];
    if (step < 0 || k == scene.gait.swings[step].begin) continue;
    const SwingSpan& span = scene.gait.swings[step];
    addClearance(getContact(scene, side), scene.task.ground, scene.ramp,
                 isMidSwing(k - span.begin, span.end - span.begin) ? kMidSwingClearance : 0, stage);
    if (!apart)
      addDistance(getContact(scene, side), feet[foot], getContact(scene, getOther(side)), feet[1 - foot],
                  scene.options.feet_distance, stage);
    apart = true;
  }
}

void addLanding(const Scene& scene, const Footstep& step, StageSpec& stage) {
  const double h = stage.kind == StageKind::Impact ? 1 : stage.dt;
  if (!isPublished(scene)) {
    const LocomotionOptions& o = scene.options;
    if (o.foothold_room > 0)
      addCost(stage, "foothold", o.foothold_weight / h, (Vector6d() << 1, 1, 0, 0, 0, 0).finished(),
              makeFramePlacement(getFoot(scene, step.side), step.X_WF));
    return addLanding(getContact(scene, step.side), step.X_WF, o.foothold_room, stage);
  }
  const LandingWeights& weights = scene.options.paper.landing;
  addFreeLanding(getFoot(scene, step.side), step.X_WF, {weights.height / h, weights.tilt / h, weights.velocity / h},
                 stage);
}

StageSpec makeStage(const Scene& scene, const GaitNode& node, const std::vector<ContactTarget>& contacts) {
  const LocomotionOptions& o = scene.options;
  const GaitPhase& phase = scene.gait.phases[node.phase];
  StageSpec stage = makeRegularizedStage(scene, node);
  stage.constraints = makeConstraintSet(scene.model, contacts);
  setClosureGains({o.closure_kp, o.closure_kd}, stage.constraints);
  addComCosts(scene, node, stage);
  addForceCosts(scene, node, stage);
  for (int step : phase.steps)
    if (step >= 0) addSwingCosts(scene, node, scene.task.plan.steps[step], stage);
  if (node.landed >= 0 && o.rigid_landing == 0) addLanding(scene, scene.task.plan.steps[node.landed], stage);
  return stage;
}

// A foot lands and stops instantly.
StageSpec makeImpact(const Scene& scene, const GaitNode& node, const std::vector<ContactTarget>& contacts) {
  StageSpec stage = makeRegularizedStage(scene, node);
  stage.kind = StageKind::Impact;
  stage.dt = 0;
  stage.constraints = makeConstraintSet(scene.model, contacts);
  stage.state.weight *= scene.options.timing.time_step;
  stage.control.weight *= scene.options.timing.time_step;  // torques have no effect here and go to zero
  addLanding(scene, scene.task.plan.steps[node.landed], stage);
  return stage;
}

std::vector<Goal> makeFootholdGoals(const Scene& scene, const ContactSchedule& schedule) {
  constexpr double kTolerance = 0.01;  // m
  if (isPublished(scene)) return {};
  const double room = std::hypot(scene.options.foothold_room, scene.options.foothold_room);
  Goal goal{GoalKind::Footholds, "footholds", 0, std::max(kTolerance, room), 0, schedule.numStages()};
  const std::vector<int> landings = listLandings(schedule);
  const std::vector<Footstep>& steps = scene.task.plan.steps;
  for (size_t i = 0; i < std::min(steps.size(), landings.size()); ++i)
    goal.footholds.push_back({scene.model.contacts()[scene.stance.contacts[static_cast<int>(steps[i].side)]].name,
                              landings[i], steps[i].X_WF.p});
  return {goal};
}

// The standing posture, moved along the gait.
VectorXd makeGuess(const Scene& scene, const GaitNode& node) {
  const Model& model = scene.model;
  VectorXd x = VectorXd::Zero(model.nq() + model.nv());
  x.head(model.nq()) = scene.stance.q;
  if (isPublished(scene)) {  // on stairs at the height of the path, since fly high grows exponentially below the ground
    x[2] += node.com.z() - scene.stance.com.z();
    return x;
  }
  const Matrix3d turn = makeAxisRotation(Vector3d::UnitZ(), node.heading);
  x.head<3>() = node.com + turn * (scene.stance.q.head<3>() - scene.stance.com);
  x.segment<4>(3) = makeHeading(scene, node);
  return x;
}

StageSpec makeTerminalStage(const Scene& scene) {
  const GaitNode& node = scene.gait.nodes.back();
  const int nv = scene.model.nv();
  StageSpec stage = makeRegularizedStage(scene, node);
  stage.control.weight = 0;
  if (isPublished(scene)) {
    stage.state = {scene.options.paper.terminal, scene.stance.q, VectorXd::Zero(nv), VectorXd::Zero(2 * nv)};
    stage.state.weights.tail(nv) = selectMainJoints(scene.model);
    return stage;
  }
  addCost(stage, "com", scene.options.terminal_weight, Vector3d::Ones(), makeComPosition(node.com), true);
  addRest(scene.model, stage);
  return stage;
}

}  // namespace

Side getFirstFoot(const LocomotionOptions& options) { return options.published != 0 ? Side::Left : Side::Right; }

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

Stance makeStance(const Model& model, const LocomotionOptions& options, const VectorXd& q0) {
  if (!model.hasFreeFlyer())
    throw ModelError(model.name(), "root joint", "the robot cannot walk, its base is fixed",
                     "load it with a free base");
  Stance stance;
  stance.q = q0;
  Workspace ws(model);
  updatePositions(model, ws, stance.q);
  stance.com = calcCom(model, ws);
  for (int i = 0; i < 2; ++i) {
    const std::string& name = i == 0 ? options.left : options.right;
    stance.contacts[i] = model.findContact(name);
    if (stance.contacts[i] < 0)
      throw ModelError(model.name(), "contact '" + name + "'", "a walk needs it, the robot has no such contact",
                       "name the contacts of its left and right foot");
    const ContactFrame& contact = model.contacts()[stance.contacts[i]];
    stance.feet[i] = getPlacement(ws, contact.body, contact.X_BF);
  }
  return stance;
}

MotionPlan planLocomotion(const Model& model, const Stance& stance, const LocomotionTask& task,
                          const LocomotionOptions& requested) {
  check(requested);
  LocomotionOptions options = requested;
  if (options.timing.time_step == 0) options.timing.time_step = chooseTimeStep(task, options.timing, options.swing);
  Scene scene{
      model, stance, task, options, makeStartingGait(model, stance, task, options), makeWeights(model, options)};
  if (!isPublished(scene)) check(scene);
  std::vector<ContactTarget> soles;
  for (const GaitPhase& phase : scene.gait.phases)
    for (const ContactTarget& sole : makeTargets(scene, phase)) soles.push_back(sole);
  scene.ramp = chooseRamp(model, task.ground, soles);
  MotionPlan plan;
  plan.name = task.name;
  plan.ground = task.ground;
  plan.ground.friction = options.friction;
  plan.limited = options.published == 0;
  size_t node = 0;
  for (const GaitPhase& phase : scene.gait.phases) {
    const std::vector<ContactTarget> contacts = makeTargets(scene, phase);
    const VectorXd u = phase.flies() ? VectorXd::Zero(model.nu()).eval()
                                     : calcStaticTorques(model, makeConstraintSet(model, contacts), stance.q).u;
    if (scene.gait.nodes[node].landed >= 0 && options.rigid_landing != 0) {
      plan.schedule.phases.push_back({"impact", 1, 0, contacts});
      plan.stages.push_back(makeImpact(scene, scene.gait.nodes[node], contacts));
      plan.guess.us.push_back(VectorXd::Zero(model.nu()));
      plan.guess.xs.push_back(makeGuess(scene, scene.gait.nodes[node]));
    }
    plan.schedule.phases.push_back({nameOf(phase), phase.nodes, options.timing.time_step, contacts});
    for (int i = 0; i < phase.nodes; ++i, ++node) {
      plan.stages.push_back(makeStage(scene, scene.gait.nodes[node], contacts));
      addSwingConstraints(scene, scene.gait.nodes[node], static_cast<int>(node), plan.stages.back());
      plan.guess.us.push_back(u);
      plan.guess.xs.push_back(makeGuess(scene, scene.gait.nodes[node]));
    }
  }
  plan.stages.push_back(makeTerminalStage(scene));
  plan.guess.xs.push_back(makeGuess(scene, scene.gait.nodes.back()));
  const auto end = task.plan.getStance(static_cast<int>(task.plan.steps.size()));
  const SE3 start = calcMiddle(stance.feet[0], stance.feet[1]);
  plan.goals = makeFootholdGoals(scene, plan.schedule);
  plan.q_start = stance.q;
  plan.q_end = carryPosture(model, stance.q, calcMiddle(end[0], end[1]) * start.inverse());
  return plan;
}

}  // namespace bielle
