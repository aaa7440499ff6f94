#include "motion/benchmark_walk.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "bielle/dynamics/kinematics.h"
#include "bielle/model/error.h"
#include "math/constants.h"

namespace bielle {
namespace {

// Data common to all stages.
struct BenchmarkScene {
  const Model& model;
  const BenchmarkWalkOptions& options;
  StandingRobot standing;
  VectorXd state_weights;  ///< 2 nv
  int left, right;         ///< contacts
};

enum class PhaseKind { Double, RightStance, LeftStance, Switch };

struct BenchmarkPhase {
  PhaseKind kind;
  int nodes;
};

std::vector<BenchmarkPhase> makePhases(const Model& model, const BenchmarkWalkOptions& o) {
  std::vector<BenchmarkPhase> phases{{PhaseKind::Double, o.start_nodes}};
  for (int i = 0; i < o.cycles; ++i)
    for (PhaseKind stance : {PhaseKind::RightStance, PhaseKind::LeftStance}) {
      phases.push_back({stance, o.swing_nodes});
      phases.push_back({PhaseKind::Switch, o.switch_nodes});
    }
  int used = 0;
  bool possible = o.time_step > 0;
  for (const BenchmarkPhase& phase : phases) {
    possible = possible && phase.nodes > 0;
    used += phase.nodes;
  }
  if (!possible || used > o.total_nodes)
    throw InputError(model.name(), "benchmark walk",
                     "its phases do not fit into " + std::to_string(o.total_nodes) + " nodes (they need " +
                         std::to_string(used) + ", at least one each)",
                     "give fewer or shorter phases");
  if (used < o.total_nodes) phases.push_back({PhaseKind::Double, o.total_nodes - used});
  return phases;
}

int findFoot(const Model& model, const std::string& name) {
  const int contact = model.findContact(name);
  if (contact < 0)
    throw InputError(model.name(), "contact '" + name + "'",
                     "the benchmark walk needs it, but the robot has no such contact",
                     "name the contacts of its left and right foot");
  return contact;
}

const char* getName(PhaseKind kind) {
  switch (kind) {
    case PhaseKind::Double:
      return "double support";
    case PhaseKind::RightStance:
      return "right foot";
    case PhaseKind::LeftStance:
      return "left foot";
    case PhaseKind::Switch:
      return "switch";
  }
  return "?";
}

std::vector<int> getStance(const BenchmarkScene& scene, PhaseKind kind) {
  if (kind == PhaseKind::RightStance) return {scene.right};
  if (kind == PhaseKind::LeftStance) return {scene.left};
  return {scene.left, scene.right};
}

StageSpec makeRegularizedStage(const BenchmarkScene& scene, double state_weight, double control_weight) {
  const Model& model = scene.model;
  StageSpec stage;
  stage.dt = scene.options.time_step;
  stage.effort_limits.setConstant(model.nu(), std::numeric_limits<double>::infinity());
  stage.state = {state_weight, scene.standing.q, VectorXd::Zero(model.nv()), scene.state_weights};
  stage.control = {control_weight, VectorXd::Zero(model.nu()), VectorXd::Ones(model.nu())};
  return stage;
}

void addForceCosts(const BenchmarkScene& scene, const std::vector<ContactTarget>& contacts, StageSpec& stage) {
  const double weight = scene.model.mass() * scene.model.gravity().norm();
  for (size_t i = 0; i < contacts.size(); ++i) {
    const int constraint = stage.constraints.num_loops + static_cast<int>(i);
    const int rows = getRows(stage.constraints.closures[constraint].kind);
    VectorXd reference = VectorXd::Zero(rows);
    reference[2] = weight / contacts.size();
    stage.costs.push_back(
        {"force " + scene.model.contacts()[contacts[i].contact].name, scene.options.force_weight / (weight * weight),
         Activation::makeQuadratic(VectorXd::Ones(rows)), makeContactForce(stage.constraints, constraint, reference)});
  }
}

// `progress` in the phase, over (0, 1); `time` along the walk, s.
StageSpec makeStage(const BenchmarkScene& scene, PhaseKind kind, const std::vector<ContactTarget>& contacts,
                    double progress, double time) {
  const BenchmarkWalkOptions& o = scene.options;
  StageSpec stage = makeRegularizedStage(scene, o.state_weight, o.control_weight);
  stage.constraints = makeConstraintSet(scene.model, contacts);
  const Vector3d com = scene.standing.com + Vector3d(o.speed * time, 0, 0);
  stage.costs.push_back(
      {"centre of mass", o.com_weight, Activation::makeQuadratic(Vector3d(1, 0, 1)), makeComPosition(com)});
  addForceCosts(scene, contacts, stage);
  if (o.friction > 0) addWrenchCones(scene.model, o.friction, kConeMargin, stage);
  const auto getFrame = [&scene](int contact) {
    return BodyFrame{scene.model.contacts()[contact].body, scene.model.contacts()[contact].X_BF};
  };
  if (kind == PhaseKind::RightStance || kind == PhaseKind::LeftStance) {
    const Vector3d height(0, 0, o.step_height * std::sin(kPi * progress));
    stage.costs.push_back(
        {"swing height", o.height_weight, Activation::makeQuadratic(Vector3d::UnitZ()),
         makeFrameTranslation(getFrame(kind == PhaseKind::RightStance ? scene.left : scene.right), height)});
  }
  if (kind == PhaseKind::Switch)
    for (int contact : {scene.left, scene.right})
      stage.costs.push_back({"landing " + scene.model.contacts()[contact].name, o.switch_weight / o.time_step,
                             Activation::makeQuadratic(Vector6d::Ones()), makeFrameVelocity(getFrame(contact))});
  return stage;
}

StageSpec makeTerminalStage(const BenchmarkScene& scene) {
  StageSpec stage = makeRegularizedStage(scene, 1, 0);
  const int nv = scene.model.nv();
  stage.state.weights.head(nv) *= scene.options.state_weight;
  stage.state.weights.tail(nv).setConstant(scene.options.terminal_weight);
  return stage;
}

}  // namespace

Motion makeBenchmarkWalk(const Model& model, const BenchmarkWalkOptions& o, Formulation formulation) {
  const std::vector<BenchmarkPhase> phases = makePhases(model, o);
  BenchmarkScene scene{model,
                       o,
                       makeStandingRobot(model),
                       makeStateWeights(model).cwiseMax(o.importance_floor),
                       findFoot(model, o.left),
                       findFoot(model, o.right)};

  Motion motion;  // without limits of joints and gains, unlike those of makeMotion()
  motion.name = "benchmark walk";
  std::vector<StageSpec> stages;
  const int last_switch = o.start_nodes + 2 * o.cycles * (o.swing_nodes + o.switch_nodes);
  for (const BenchmarkPhase& phase : phases) {
    const std::vector<ContactTarget> contacts =
        makeContactTargets(model, scene.standing.q, getStance(scene, phase.kind), o.contact_kp, o.contact_kd);
    motion.schedule.phases.push_back({getName(phase.kind), phase.nodes, o.time_step, contacts});
    const VectorXd u = calcStaticTorques(model, makeConstraintSet(model, contacts), scene.standing.q).u;
    for (int i = 0; i < phase.nodes; ++i) {
      const int node = static_cast<int>(stages.size());
      const double time = o.time_step * (std::clamp(node, o.start_nodes, last_switch) - o.start_nodes);
      stages.push_back(makeStage(scene, phase.kind, contacts, (i + 1.0) / (phase.nodes + 1.0), time));
      motion.guess.us.push_back(u);
    }
  }
  stages.push_back(makeTerminalStage(scene));
  VectorXd x0 = VectorXd::Zero(model.nq() + model.nv());
  x0.head(model.nq()) = scene.standing.q;
  motion.guess.xs.assign(stages.size(), x0);
  motion.options = {{"speed", o.speed}, {"step_height", o.step_height}, {"total_nodes", o.total_nodes}};
  motion.problem = std::make_unique<RobotProblem>(model, scene.standing.q, VectorXd::Zero(model.nv()),
                                                  std::move(stages), formulation);
  return motion;
}

}  // namespace bielle
