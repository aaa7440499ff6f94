#include "bielle/motion/jump.h"

#include <algorithm>
#include <cmath>

#include "bielle/model/error.h"
#include "model/rounded_text.h"
#include "motion/com_reach.h"
#include "motion/feasibility.h"
#include "motion/foot_tasks.h"
#include "motion/quintic.h"
#include "motion/robot_size.h"

namespace bielle {
namespace {

// Data common to all stages.
struct JumpScene {
  const Model& model;
  JumpOptions options;  // whose weights suit the size
  RobotSize size;
  JumpFigures figures;
  const StandingRobot& standing;      // at the start
  VectorXd state_weights;             // 2 nv
  Vector3d forward, shift;            // unit vector ahead; displacement of the jump
  std::vector<ContactTarget> before;  // feet at the start and
  std::vector<ContactTarget> after;   // at the landing
};

enum class JumpPhase { Stand, Push, Flight, Land, Settle };

int countStages(double seconds, double time_step, int least) {
  return std::max(least, static_cast<int>(std::lround(seconds / time_step)));
}

int countStages(const JumpOptions& o, JumpPhase phase) {
  switch (phase) {
    case JumpPhase::Stand:
      return countStages(o.stand, o.time_step, 0);
    case JumpPhase::Push:
      return countStages(o.push, o.time_step, 1);
    case JumpPhase::Flight:
      return 2 * countStages(o.flight / 2, o.time_step, 1);
    case JumpPhase::Land:
      return countStages(o.land, o.time_step, 1);
    case JumpPhase::Settle:
      return countStages(o.settle, o.time_step, 0);
  }
  return 0;
}

const char* getName(JumpPhase phase) {
  switch (phase) {
    case JumpPhase::Stand:
      return "stand";
    case JumpPhase::Push:
      return "push";
    case JumpPhase::Flight:
      return "flight";
    case JumpPhase::Land:
      return "land";
    case JumpPhase::Settle:
      return "settle";
  }
  return "";
}

StageSpec makeStage(const JumpScene& scene, const std::vector<ContactTarget>& contacts) {
  const Model& model = scene.model;
  const JumpOptions& o = scene.options;
  StageSpec stage;
  stage.dt = o.time_step;
  stage.constraints = makeConstraintSet(model, contacts);
  setClosureGains({o.contact_kp, o.contact_kd}, stage.constraints);
  stage.state = {o.state_weight, scene.standing.q, VectorXd::Zero(model.nv()), scene.state_weights,
                 calcWeightAxes(scene.size)};
  stage.control = {o.control_weight, VectorXd::Zero(model.nu()), makeControlWeights(model, scene.size)};
  return stage;
}

// Eq. (3) at the progress s of the flight.
Vector3d calcFootOffset(const JumpScene& scene, double s) {
  const double p = 4 * s * (1 - s), height = std::max(scene.figures.rise, scene.options.clearance);
  return s * s * (3 - 2 * s) * scene.shift + height * p * p * (2 - p) * Vector3d::UnitZ();
}

void addSwingCosts(const JumpScene& scene, double s, StageSpec& stage) {
  const JumpOptions& o = scene.options;
  const Vector3d p = Vector3d::Constant(o.swing_weight), r = Vector3d::Constant(o.swing_rotation_weight);
  for (const ContactTarget& start : scene.before) {
    SE3 target = start.X_WT;
    target.p += calcFootOffset(scene, s);
    addSwing(scene.model, start.contact, target, (Vector6d() << p, r).finished(), stage);
  }
}

void addHeightCost(const JumpScene& scene, const std::string& name, double weight, double height, bool defines,
                   StageSpec& stage) {
  stage.costs.push_back({name, weight, Activation::makeQuadratic(Vector3d::UnitZ()),
                         makeComPosition(scene.standing.com + height * Vector3d::UnitZ()), defines});
}

// Node i of n in flight. The first one is where the feet stood.
void addFlightConstraints(const JumpScene& scene, const Ground& ground, int i, int n, StageSpec& stage) {
  if (i == 0) return;
  const double ramp = ground.steps.empty() ? 0 : chooseRamp(scene.model, ground, scene.before);
  for (const ContactTarget& start : scene.before)
    addClearance(scene.model, scene.size, start.contact, ground, ramp, isMidSwing(i, n) ? kMidSwingClearance : 0,
                 stage);
}

void addTouchdown(const JumpScene& scene, StageSpec& stage) {
  for (const ContactTarget& target : scene.after)
    addLanding(scene.model, scene.size, target.contact, target.X_WT, {}, 0, stage);
}

StageSpec makeTerminalStage(const JumpScene& scene) {
  const JumpOptions& o = scene.options;
  StageSpec stage = makeStage(scene, {});
  stage.constraints = {};
  stage.control.weight = 0;
  stage.state.weight *= scene.size.time;
  stage.costs.push_back({"com", o.terminal_weight * scene.size.time, Activation::makeQuadratic(Vector3d::Ones()),
                         makeComPosition(scene.standing.com + scene.shift), true});
  addRest(scene.model, scene.size, stage);
  return stage;
}

// The centre of mass moves on the ground by Eqs. of jump.h as far as legs can bend and stretch.
void checkHeights(const JumpOptions& o, double gravity, double height) {
  constexpr double kLowest = 0.4, kHighest = 1.5;  // over the height at the start
  const JumpFigures f = calcJumpFigures(o, gravity);
  for (double t = 0; t < f.stand + f.push + f.flight + f.land; t += o.time_step) {
    if (t >= f.stand + f.push && t <= f.stand + f.push + f.flight) continue;
    const double over = height + calcJumpHeight(o, gravity, t).height;
    requireOption(over > kLowest * height && over < kHighest * height, "flight",
                  "the centre of mass would have to move to " + formatNumber(over, "%.3g") + " m over the feet, from " +
                      formatNumber(height, "%.3g") + " m at the start, to take off and land",
                  "give a shorter flight, less stretch, or other durations of push and land");
  }
}

// How far feet can be apart that the centre of mass carries over in the flight: it leaves them at the distance that straight legs
// leave it, and with the velocity that they can have given it, from rest, while it moved from as far behind them as legs reach when
// they are bent most; feet push it ahead by friction alone. Landing is the mirror image. No motors count.
void checkLength(const JumpScene& scene, double gravity) {
  const JumpOptions& o = scene.options;
  if (o.length == 0 || !scene.model.hasFreeFlyer()) return;
  const JumpFigures& f = scene.figures;
  double level = 0;
  std::vector<FrameTarget> feet;
  for (const ContactTarget& foot : scene.before) {
    level += foot.X_WT.p.z() / static_cast<double>(scene.before.size());
    feet.push_back(makeFrameTarget(scene.model.contacts()[foot.contact], foot.X_WT));
  }
  const double height = scene.standing.com.z() - level;
  double lowest = height, strongest = gravity;
  for (double t = 0; t < f.stand + f.push; t += o.time_step) {
    const JumpHeight com = calcJumpHeight(o, gravity, t);
    lowest = std::min(lowest, height + com.height);
    strongest = std::max(strongest, gravity + com.acceleration);
  }
  const auto calcMost = [&](double reach) {
    const auto calcAside = [reach](double z) { return std::sqrt(std::max(0.0, reach * reach - z * z)); };
    const double before = calcAside(height + o.stretch), behind = calcAside(lowest);
    const double speed = std::min(o.friction * (gravity * (f.stand + f.push) + f.take_off),
                                  std::sqrt(2 * o.friction * strongest * (before + behind)));
    return 2 * before + speed * f.flight;
  };
  if (std::abs(o.length) <= calcMost(height)) return;  // legs are at least as long as they are at the start
  const double reach = calcReachedComHeight(scene.model, makeConstraintSet(scene.model, scene.before), feet,
                                            scene.standing.q, level + 10 * height) -
                       level;
  const double most = calcMost(reach);
  requireOption(
      std::abs(o.length) <= most, "length",
      "in a flight of " + formatNumber(f.flight) + " s feet with a friction of " + formatNumber(o.friction) +
          " and legs of " + formatNumber(reach, "%.3g") + " m carry it at most " + formatBelow(most, 3) + " m",
      "give a length, e.g. " + formatNumber(std::copysign(most / 3, o.length), "%.1g") + ", or a longer flight");
}

JumpOptions suit(const RobotSize& size, JumpOptions o) {
  scaleWeights(size, o);
  for (double* weight : {&o.apex_weight, &o.com_weight, &o.swing_weight, &o.terminal_weight})
    *weight /= size.length * size.length * size.time;
  o.swing_rotation_weight /= size.time;
  return o;
}

JumpScene makeScene(const Model& model, const JumpOptions& o, const StandingRobot& standing) {
  const RobotSize size = calcRobotSize(model, standing);
  const std::vector<ContactTarget> feet = makeContactTargets(standing, o.contact_kp, o.contact_kd);
  const JumpFigures figures = calcJumpFigures(o, model.gravity().norm());
  JumpScene scene{model, suit(size, o), size, figures, standing, makeStateWeights(model), {}, {}, feet, feet};
  if (model.hasFreeFlyer()) scene.state_weights.segment<3>(3).setConstant(o.torso_weight);
  raiseMotorWeights(model, o.motor_weight, scene.state_weights);
  scaleStateWeights(model, size, scene.state_weights);
  Vector3d forward = Vector3d::Zero();
  for (const SE3& foot : standing.contacts) forward += foot.R.col(0);
  scene.forward = Vector3d(forward.x(), forward.y(), 0).normalized();
  scene.shift = o.length * scene.forward;
  for (ContactTarget& foot : scene.after) foot.X_WT.p += scene.shift;
  return scene;
}

// The initial posture, moving by Eq. (1).
VectorXd makeGuess(const JumpScene& scene, JumpPhase phase, double t) {
  const Model& model = scene.model;
  VectorXd x(model.nq() + model.nv());
  x << scene.standing.q, VectorXd::Zero(model.nv());
  if (!model.hasFreeFlyer()) return x;
  const JumpFigures& f = scene.figures;
  if (phase == JumpPhase::Land || phase == JumpPhase::Settle) x.head<3>() += scene.shift;
  if (phase != JumpPhase::Flight) return x;
  const double g = model.gravity().norm();
  x.head<3>() += scene.shift * t / f.flight + (f.take_off * t - 0.5 * g * t * t) * Vector3d::UnitZ();
  const Vector3d velocity = scene.shift / f.flight + (f.take_off - g * t) * Vector3d::UnitZ();
  x.segment<3>(model.nq()) =
      Eigen::Quaterniond(Eigen::Map<const Eigen::Vector4d>(&scene.standing.q[3])).conjugate() * velocity;
  return x;
}

std::vector<Goal> makeGoals(const JumpScene& scene, int nodes) {
  const JumpOptions& o = scene.options;
  const double height = o.stretch + scene.figures.rise;  // Eq. (1)
  Goal length{GoalKind::Displacement, "length", o.length, calcTolerance(o.length, 0.01), 0, nodes};
  length.direction = scene.forward;
  length.contacts = getContactNames(scene.model, scene.before);
  return {{GoalKind::FlightTime, "flight", o.flight, calcTolerance(o.flight, 0), 0, nodes},
          {GoalKind::Rise, "height", height, calcTolerance(height, 0.01), 0, nodes},
          length};
}

void check(const Model& model, const JumpOptions& o) {
  listOptions(o).check();
  requireOption(o.flight >= 2 * o.time_step && o.flight <= 2, "flight", "it is outside two time steps .. 2 s",
                "give seconds, e.g. 0.3");
  requireStages(o.stand + o.push + o.flight + o.land + o.settle, o.time_step);
  requireGravity(model, o.friction);
  if (model.contacts().empty())
    throw InputError(model.name(), "contacts", "a jump needs feet, but the robot has no contact frames",
                     "add `contacts` to its YAML file");
}

}  // namespace

JumpFigures calcJumpFigures(const JumpOptions& o, double gravity) {
  const auto last = [&o](JumpPhase phase) { return countStages(o, phase) * o.time_step; };
  JumpFigures f{last(JumpPhase::Stand), last(JumpPhase::Push), last(JumpPhase::Flight), last(JumpPhase::Land), 0, 0};
  f.take_off = 0.5 * gravity * f.flight;
  f.rise = gravity * f.flight * f.flight / 8;
  return f;
}

JumpHeight calcJumpHeight(const JumpOptions& o, double gravity, double t) {
  const JumpFigures f = calcJumpFigures(o, gravity);
  const auto follow = [](const PolynomialEnd& begin, const PolynomialEnd& end, double t, double duration) {
    const Quintic height(begin, end, duration);
    return JumpHeight{height.calc(t), height.calcAcceleration(t)};
  };
  t -= f.stand - 1e-6 * o.time_step;  // a node on the boundary of two phases belongs to the later one
  if (t <= 0) return {};
  if (t < f.push) return follow({}, {o.stretch, f.take_off, 0}, t, f.push);
  t -= f.push;
  if (t < f.flight) return {o.stretch + f.take_off * t - 0.5 * gravity * t * t, -gravity};
  t -= f.flight;
  if (t < f.land) return follow({o.stretch, -f.take_off, 0}, {}, t, f.land);
  return {};
}

MotionPlan planJump(const Model& model, const JumpOptions& options, const StandingRobot& standing) {
  check(model, options);
  const JumpScene scene = makeScene(model, options, standing);
  checkHeights(options, model.gravity().norm(), standing.com.z() - scene.before.front().X_WT.p.z());
  checkLength(scene, model.gravity().norm());
  MotionPlan plan;
  plan.name = "jump";
  if (options.length != 0) requireLevel(model, scene.before, "jump forward");
  plan.ground = makeGroundUnder(model, scene.before);
  plan.ground.friction = options.friction;
  std::vector<StageSpec>& stages = plan.stages;
  const double g = model.gravity().norm();
  const JumpOptions& o = scene.options;
  const GroundCosts ground{o.force_weight, o.pressure_weight, ForceAxes::Contact, scene.size.length};
  for (JumpPhase phase : {JumpPhase::Stand, JumpPhase::Push, JumpPhase::Flight, JumpPhase::Land, JumpPhase::Settle}) {
    const bool over = phase == JumpPhase::Land || phase == JumpPhase::Settle;
    const std::vector<ContactTarget> none,
        &contacts = phase == JumpPhase::Flight ? none : (over ? scene.after : scene.before);
    const int nodes = countStages(options, phase);
    if (nodes == 0) continue;
    plan.schedule.phases.push_back({getName(phase), nodes, options.time_step, contacts});
    const VectorXd u = contacts.empty()
                           ? VectorXd::Zero(model.nu()).eval()
                           : calcStaticTorques(model, makeConstraintSet(model, contacts), scene.standing.q).u;
    for (int i = 0; i < nodes; ++i) {
      const JumpHeight com = calcJumpHeight(options, g, stages.size() * options.time_step);
      stages.push_back(makeStage(scene, contacts));
      StageSpec& stage = stages.back();
      const double load = model.mass() * (g + com.acceleration);  // on all feet together, Eq. (2)
      addGroundCosts(model, ground, VectorXd::Constant(contacts.size(), load / contacts.size()), stage);
      addWrenchCones(model, options.friction, options.cone_margin, stage);
      if (phase != JumpPhase::Flight) addHeightCost(scene, "com height", o.com_weight, com.height, false, stage);
      if (phase == JumpPhase::Flight && 2 * i == nodes)
        addHeightCost(scene, "apex", o.apex_weight * scene.size.time / o.time_step, com.height, true, stage);
      if (phase == JumpPhase::Flight && i > 0) addSwingCosts(scene, static_cast<double>(i) / nodes, stage);
      if (phase == JumpPhase::Flight) addFlightConstraints(scene, plan.ground, i, nodes, stage);
      if (phase == JumpPhase::Land && i == 0) addTouchdown(scene, stage);
      plan.guess.xs.push_back(makeGuess(scene, phase, i * options.time_step));
      plan.guess.us.push_back(u);
    }
  }
  stages.push_back(makeTerminalStage(scene));
  plan.guess.xs.push_back(makeGuess(scene, JumpPhase::Settle, 0));
  plan.q_start = standing.q;
  plan.q_end = carryPosture(model, standing.q, {Matrix3d::Identity(), scene.shift});
  plan.options = listOptions(options).listValues();
  plan.goals = makeGoals(scene, plan.schedule.numStages());
  return plan;
}

Motion makeJump(const Model& model, const JumpOptions& options, const ProblemOptions& problem) {
  return makeMotion(model, planJump(model, options, makeStandingRobot(model)), problem);
}

}  // namespace bielle
