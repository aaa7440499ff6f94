#include "paper/walk.h"

#include <optional>

#include "bielle/motion/locomotion.h"

namespace bielle::paper {
namespace {

constexpr int kStart = 13, kSingle = 26, kDouble = 1, kEnd = 14;  // stages

struct WalkScene {
  const Model& model;
  const WalkOptions& options;
  const Stance& stance;
  SE3 start;  // middle of the feet
  FootstepPlan plan;
  VectorXd state_weights;  // 2 nv
};

const ContactFrame& getFoot(const WalkScene& scene, Side side) {
  return scene.model.contacts()[scene.stance.contacts[static_cast<int>(side)]];
}

BodyFrame getFootFrame(const WalkScene& scene, Side side) {
  return {getFoot(scene, side).body, getFoot(scene, side).X_BF};
}

// The feet that stand after `steps` of them, without the one that swings.
std::vector<ContactTarget> makeTargets(const WalkScene& scene, int steps, std::optional<Side> swing) {
  const std::array<SE3, 2> feet = scene.plan.getStance(steps);
  std::vector<ContactTarget> targets;
  for (Side side : {Side::Left, Side::Right})
    if (side != swing)
      targets.push_back({scene.stance.contacts[static_cast<int>(side)], feet[static_cast<int>(side)],
                         scene.options.contacts.kp, scene.options.contacts.kd});
  return targets;
}

StageSpec makeStage(const WalkScene& scene, const std::vector<ContactTarget>& contacts) {
  const WalkOptions& o = scene.options;
  const Model& model = scene.model;
  StageSpec stage = makeRegularizedStage(model, scene.stance.q, o.state_weight, scene.state_weights, o.control_weight);
  stage.constraints = makeConstraintSet(model, contacts);
  setClosureGains(o.closures, stage.constraints);
  const Vector3d forward = scene.start.R.col(0);
  stage.costs.push_back({"com", 1, Activation::makeQuadratic(o.com_height_weight * Vector3d::UnitZ()),
                         makeComPosition(scene.stance.com)});
  stage.costs.push_back({"com velocity", o.com_velocity_weight, Activation::makeQuadratic(forward.cwiseAbs()),
                         makeComVelocity(o.speed * forward)});
  const double weight = model.mass() * model.gravity().norm();
  addGroundCosts(model, {o.force_weight, o.pressure_weight, ForceAxes::World},
                 VectorXd::Constant(contacts.size(), weight / contacts.size()), stage);
  return stage;
}

void addSwingCosts(const WalkScene& scene, Side side, StageSpec& stage) {
  const WalkOptions& o = scene.options;
  const double ground = scene.stance.feet[static_cast<int>(getOther(side))].p.z();
  stage.costs.push_back({"fly high", o.fly_high_weight, Activation::makeQuadratic(Eigen::Vector2d::Ones()),
                         makeFlyHigh(getFootFrame(scene, side), o.fly_high_slope, ground)});
  stage.costs.push_back(
      {"feet distance", o.feet_distance_weight,
       Activation::makeBarrier(VectorXd::Ones(1), VectorXd::Constant(1, o.feet_distance), VectorXd::Constant(1, 1e12)),
       makeFrameDistance(getFootFrame(scene, Side::Left), getFootFrame(scene, Side::Right))});
}

StageSpec makeWalkEnd(const WalkScene& scene) {
  const int nv = scene.model.nv();
  VectorXd weights = VectorXd::Zero(2 * nv);
  weights.tail(nv) = selectMainJoints(scene.model);
  return makeRegularizedStage(scene.model, scene.stance.q, scene.options.terminal_weight, weights, 0);
}

}  // namespace

Motion makeWalk(const Model& model, const WalkOptions& o, const VectorXd& q0, Formulation formulation) {
  const Stance stance = makeStance(model, {}, makeStandingRobot(model, q0));
  const double length = o.speed * (kSingle + kDouble) * kTimeStep;
  WalkScene scene{model,
                  o,
                  stance,
                  calcMiddle(stance.feet[0], stance.feet[1]),
                  planFootsteps(stance.feet[0], stance.feet[1], {length, 0, 0}, o.steps, Side::Left),
                  makeStateWeights(model)};
  scene.state_weights.segment<3>(3) << o.torso_weight, o.torso_weight, 0;
  Motion motion;
  motion.name = "paper-walk";
  motion.ground.height = scene.start.p.z();
  std::vector<StageSpec> stages;
  const auto add = [&](const std::string& name, int nodes, const std::vector<ContactTarget>& contacts) {
    addPhase(model, name, nodes, contacts, q0, motion);
    stages.insert(stages.end(), nodes, makeStage(scene, contacts));
    return stages.end() - nodes;
  };
  add("double support", kStart, makeTargets(scene, 0, {}));
  for (int i = 0; i < o.steps; ++i) {
    const Footstep& step = scene.plan.steps[i];
    auto swing = add(getName(getOther(step.side)), kSingle, makeTargets(scene, i, step.side));
    for (; swing != stages.end(); ++swing) addSwingCosts(scene, step.side, *swing);
    const auto landing = add("double support", i + 1 < o.steps ? kDouble : kEnd, makeTargets(scene, i + 1, {}));
    addLandingCosts(getFoot(scene, step.side), step.X_WF, o.landing, "", *landing);
  }
  stages.push_back(makeWalkEnd(scene));
  VectorXd x = VectorXd::Zero(model.nq() + model.nv());
  x.head(model.nq()) = q0;
  motion.guess.xs.assign(stages.size(), x);
  motion.problem =
      std::make_unique<RobotProblem>(model, q0, VectorXd::Zero(model.nv()), std::move(stages), formulation);
  motion.options = {{"speed", o.speed}, {"steps", o.steps}};
  motion.goals = makeSpeedGoals(motion.schedule, o.speed, scene.start.R.col(0));
  return motion;
}

}  // namespace bielle::paper
