#include "motion/locomotion_stages.h"

#include <cmath>

#include "bielle/dynamics/kinematics.h"
#include "math/so3.h"
#include "motion/foot_tasks.h"

namespace bielle {
namespace {

int getContact(const Scene& scene, Side side) { return scene.stance.contacts[static_cast<int>(side)]; }

const ContactFrame& getFoot(const Scene& scene, Side side) { return scene.model.contacts()[getContact(scene, side)]; }

// Quaternion (x y z w) of the base: the initial one with a new heading.
Eigen::Vector4d makeHeading(const Scene& scene, const GaitNode& node) {
  const Eigen::Quaterniond start(Eigen::Vector4d(scene.stance.q.segment<4>(3)));
  return (Eigen::Quaterniond(Eigen::AngleAxisd(node.heading, Vector3d::UnitZ())) * start).coeffs();
}

StageSpec makeRegularizedStage(const Scene& scene, const GaitNode& node) {
  const Model& model = scene.model;
  StageSpec stage;
  stage.dt = scene.options.timing.time_step;
  stage.state = {scene.options.state_weight, scene.stance.q, VectorXd::Zero(model.nv()), scene.state_weights,
                 calcWeightAxes(scene.size)};
  stage.state.q_ref.segment<4>(3) = makeHeading(scene, node);
  if (model.hasFreeFlyer()) stage.state.v_ref.segment<3>(3) = node.heading_rate * scene.size.upright.col(2);
  stage.control = {scene.options.control_weight, VectorXd::Zero(model.nu()), makeControlWeights(model, scene.size)};
  return stage;
}

void addCost(StageSpec& stage, const std::string& name, double weight, const VectorXd& weights,
             std::shared_ptr<const Residual> residual, bool defines = false) {
  if (weight != 0 && !weights.isZero(0))
    stage.costs.push_back({name, weight, Activation::makeQuadratic(weights), std::move(residual), defines});
}

// x along a horizontal unit vector, z up.
Matrix3d makeAxes(const Vector3d& direction) {
  return (Matrix3d() << direction, Vector3d::UnitZ().cross(direction), Vector3d::UnitZ()).finished();
}

void addComCosts(const Scene& scene, const GaitNode& node, StageSpec& stage) {
  const LocomotionOptions& o = scene.options;
  addCost(stage, "com", 1, Vector3d(o.com_weight, o.com_weight, o.com_height_weight), makeComPosition(node.com));
  if (!scene.task.direction.isZero(0))
    addCost(stage, "com velocity", o.com_velocity_weight, Vector3d::UnitX(),
            makeTurned(makeComVelocity(scene.task.speed * scene.task.direction), makeAxes(scene.task.direction)));
}

// Of the weight of a swing's velocity, for the turning of a free foot: one that left aslant then turns flat with a time constant of
// 0.14 s, that with which it returns to the height of its path, in place of 0.45 s, longer than a swing.
constexpr double kTurnShare = 0.1;

bool isFree(const Scene& scene) { return scene.options.foothold_room > 0; }

void addForceCosts(const Scene& scene, const GaitNode& node, StageSpec& stage) {
  const LocomotionOptions& o = scene.options;
  const double weight = scene.model.mass() * scene.model.gravity().norm();
  const ConstraintSet& set = stage.constraints;
  VectorXd loads(set.closures.size() - set.num_loops);
  for (int i = 0; i < loads.size(); ++i) {
    const bool left = set.contacts[i] == scene.stance.contacts[0];
    loads[i] = std::max(scene.size.force(), weight * node.load[left ? 0 : 1]);
  }
  // Feet that may land anywhere stand as they landed, perhaps aslant on an edge.
  const ForceAxes axes = isFree(scene) ? ForceAxes::Ground : ForceAxes::Contact;
  addGroundCosts(scene.model, {o.force_weight, o.pressure_weight, axes, scene.size.length}, loads, stage);
  addWrenchCones(scene.model, o.friction, o.cone_margin, stage, axes);
}

Vector6d makeVector(double x, double z, double rotation) {
  return (Vector6d() << x, x, z, Vector3d::Constant(rotation)).finished();
}

void addSwingCosts(const Scene& scene, const GaitNode& node, Side side, StageSpec& stage) {
  const LocomotionOptions& o = scene.options;
  const SwingNode& swing = node.swings[static_cast<int>(side)];
  // Among steps the path is the way past their edges: only where it ends is free.
  const bool free = isFree(scene) && scene.task.ground.steps.empty(), leaves = swing.progress < o.swing.leave;
  const double turning = o.swing_velocity_weight * scene.size.length * scene.size.length;
  addSwing(scene.model, getContact(scene, side), swing.X_WF,
           makeVector(free ? o.foothold_weight : o.swing_weight, o.swing_weight, o.swing_rotation_weight), stage);
  // Until it moves along its path a free foot rises straight, or its toes would be caught by the side of a higher tile.
  addSwingVelocity(scene.model, getContact(scene, side), swing.V_F,
                   makeVector(free && !leaves ? 0 : o.swing_velocity_weight, o.swing_velocity_weight,
                              free ? kTurnShare * turning : turning),
                   stage);
}

// A foot at the first node in the air is where it stood.
void addSwingConstraints(const Scene& scene, const GaitNode& node, int k, StageSpec& stage) {
  const std::array<SE3, 2> feet = getFeet(scene, node);
  bool apart = false;
  for (Side side : {Side::Left, Side::Right}) {
    const int foot = static_cast<int>(side), step = scene.gait.phases[node.phase].steps[foot];
    if (step < 0 || k == scene.gait.swings[step].begin) continue;
    const SwingSpan& span = scene.gait.swings[step];
    const int since = k - span.begin, n = span.end - span.begin;
    // A free foot may leave from below the ground that was planned.
    if (!(isFree(scene) && scene.task.ground.steps.empty() && 4 * since < n))
      addClearance(scene.model, scene.size, getContact(scene, side), scene.task.ground, scene.ramp,
                   isMidSwing(since, n) ? kMidSwingClearance : 0, stage);
    if (!apart)
      addDistance(scene.size, getFoot(scene, side), feet[foot], getFoot(scene, getOther(side)), feet[1 - foot],
                  scene.options.feet_distance, stage);
    apart = true;
  }
}

void addLanding(const Scene& scene, const Footstep& step, StageSpec& stage) {
  const LocomotionOptions& o = scene.options;
  const double h = stage.kind == StageKind::Impact ? 1 : stage.dt;
  const ContactFrame& foot = getFoot(scene, step.side);
  if (isFree(scene))
    addCost(stage, "foothold", o.foothold_weight * scene.size.time / h, (Vector6d() << 1, 1, 0, 0, 0, 0).finished(),
            makeFramePlacement({foot.body, foot.X_BF}, step.X_WF));
  addLanding(scene.model, scene.size, getContact(scene, step.side), step.X_WF,
             findLandingRegion(foot, step.X_WF, o.foothold_room, scene.task.ground), o.landing_speed, stage);
  if (isFree(scene) && o.foothold_weight > 0) stage.feet.back().aim = stage.costs.back().residual;
}

}  // namespace

VectorXd makeStageWeights(const Model& model, const RobotSize& size, const LocomotionOptions& o) {
  VectorXd weights = makeStateWeights(model);
  weights.segment<3>(3) << o.torso_weight, o.torso_weight, o.heading_weight;
  raiseMotorWeights(model, o.motor_weight, weights);
  scaleStateWeights(model, size, weights);
  return weights;
}

std::array<SE3, 2> getFeet(const Scene& scene, const GaitNode& node) {
  const GaitPhase& phase = scene.gait.phases[node.phase];
  std::array<SE3, 2> feet = scene.task.plan.getStance(phase.steps_done);
  for (int i = 0; i < 2; ++i)
    if (phase.steps[i] >= 0) feet[i] = node.swings[i].X_WF;
  return feet;
}

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

StageSpec makeStage(const Scene& scene, int k, const std::vector<ContactTarget>& contacts) {
  const GaitNode& node = scene.gait.nodes[k];
  const LocomotionOptions& o = scene.options;
  const GaitPhase& phase = scene.gait.phases[node.phase];
  StageSpec stage = makeRegularizedStage(scene, node);
  stage.constraints = makeConstraintSet(scene.model, contacts);
  setClosureGains({o.closure_kp, o.closure_kd}, stage.constraints);
  addComCosts(scene, node, stage);
  addForceCosts(scene, node, stage);
  for (Side side : {Side::Left, Side::Right})
    if (!phase.stands(side)) addSwingCosts(scene, node, side, stage);
  if (node.landed >= 0 && !o.rigid_landing) addLanding(scene, scene.task.plan.steps[node.landed], stage);
  addSwingConstraints(scene, node, k, stage);
  return stage;
}

StageSpec makeImpact(const Scene& scene, const GaitNode& node, const std::vector<ContactTarget>& contacts) {
  StageSpec stage = makeRegularizedStage(scene, node);
  stage.kind = StageKind::Impact;
  stage.dt = 0;
  stage.constraints = makeConstraintSet(scene.model, contacts);
  stage.state.weight *= scene.options.timing.time_step;
  stage.control.weight *= scene.options.timing.time_step;  // torques have no effect here and go to zero
  addLanding(scene, scene.task.plan.steps[node.landed], stage);
  const LocomotionOptions& o = scene.options;
  if (o.landing_speed > 0)
    addImpulseCones(scene.model, o.friction, o.cone_margin,
                    scene.stance.contacts[static_cast<int>(scene.task.plan.steps[node.landed].side)], stage);
  return stage;
}

VectorXd makeGuess(const Scene& scene, const GaitNode& node) {
  const Model& model = scene.model;
  VectorXd x = VectorXd::Zero(model.nq() + model.nv());
  x.head(model.nq()) = scene.stance.q;
  const Matrix3d turn = makeAxisRotation(Vector3d::UnitZ(), node.heading);
  x.head<3>() = node.com + turn * (scene.stance.q.head<3>() - scene.stance.com);
  x.segment<4>(3) = makeHeading(scene, node);
  return x;
}

StageSpec makeTerminalStage(const Scene& scene) {
  const GaitNode& node = scene.gait.nodes.back();
  StageSpec stage = makeRegularizedStage(scene, node);
  stage.control.weight = 0;
  stage.state.weight *= scene.size.time;
  addCost(stage, "com", scene.options.terminal_weight * scene.size.time, Vector3d::Ones(), makeComPosition(node.com),
          true);
  addRest(scene.model, scene.size, stage);
  return stage;
}

StageSpec makeSeam(const Scene& scene) {
  StageSpec stage = makeRegularizedStage(scene, scene.gait.nodes.back());
  stage.state.weight = stage.control.weight = 0;
  return stage;
}

}  // namespace bielle
