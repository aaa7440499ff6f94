#include "control/window_grid.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "bielle/motion/motion.h"

namespace bielle {
namespace {

constexpr double kUsualStage = 0.015;  // s
constexpr int kMostRatio = 16, kRamp = 8;

// R of Eq. (1) for stages of h s.
int calcRatio(double h) {
  int ratio = 1;
  while (ratio < kMostRatio && std::sqrt(2) * ratio * h < kUsualStage) ratio *= 2;
  return ratio;
}

// Eq. (1).
int getMostStages(int distance, int fine, int ratio) {
  if (distance < fine) return 1;
  const int most = (distance < (1 + 2 * ratio) * fine ? 2 : 4) * ratio;
  for (int length = 2, end = fine + kRamp; length < most; length *= 2, end += kRamp)
    if (distance < end) return length;
  return most;
}

bool areSame(ConstVectorRef a, ConstVectorRef b) { return a.size() == b.size() && a == b; }

bool areSame(const Activation& a, const Activation& b) {
  return a.kind == b.kind && areSame(a.weights, b.weights) && areSame(a.lower, b.lower) && areSame(a.upper, b.upper) &&
         areSame(a.losses, b.losses) && a.share == b.share && a.smoothing == b.smoothing;
}
bool areSame(const Cost& a, const Cost& b) {
  return a.residual == b.residual && a.weight == b.weight && areSame(a.activation, b.activation);
}
bool areSame(const PathConstraint& a, const PathConstraint& b) {
  return a.residual == b.residual && areSame(a.lower, b.lower) && areSame(a.upper, b.upper) &&
         areSame(a.scale, b.scale);
}
bool areSame(const ControlCost& a, const ControlCost& b) {
  return a.weight == b.weight && areSame(a.weights, b.weights) && areSame(a.reference, b.reference);
}

// A name says that it is the same thing at another time, wherever its reference is by then.
template <typename Terms>
bool areAlike(const Terms& a, const Terms& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const auto& one, const auto& other) {
    return one.name == other.name && (!one.name.empty() || areSame(one, other));
  });
}

// But for the attitude and its rate, about whichever axis of the base: the robot turns while it walks.
bool areAlike(const Model& model, const StateCost& a, const StateCost& b) {
  if (a.weight != b.weight || !areSame(a.weights, b.weights) || a.axes != b.axes) return false;
  if (a.weight == 0 || !model.hasFreeFlyer()) return areSame(a.q_ref, b.q_ref) && areSame(a.v_ref, b.v_ref);
  const int joints = model.nq() - 7, others = model.nv() - 6;
  return areSame(a.q_ref.head<3>(), b.q_ref.head<3>()) && areSame(a.q_ref.tail(joints), b.q_ref.tail(joints)) &&
         areSame(a.v_ref.head<3>(), b.v_ref.head<3>()) && areSame(a.v_ref.tail(others), b.v_ref.tail(others));
}

}  // namespace

int countMostStages(const PredictiveOptions& options, double h) {
  int stages = 0;
  for (int k = 0; k < options.nodes; ++k) stages += getMostStages(stages, options.fine_nodes, calcRatio(h));
  return stages;
}

WindowGrid::WindowGrid(Horizon& horizon, const PredictiveOptions& options)
    : horizon_(horizon), options_(options), time_(calcTimeScale(horizon.getProblem())) {}

void WindowGrid::clear() {
  for (Node& node : nodes_) restore(node);
  nodes_.clear();
}

void WindowGrid::move(int first, int changed, int changed_end) {
  first_ = first;
  before_.swap(nodes_);
  nodes_.clear();
  next_.reset();
  const int count = options_.nodes, begin = before_.empty() ? first : before_.front().begin;
  for (int stage = first; stage < begin; ++stage) add({stage, 1, Origin::Earlier, 0});
  for (size_t i = 0; i < before_.size(); ++i) {
    Node node = before_[i];
    node.source = static_cast<int>(i);
    node.origin = Origin::Kept;
    const int end = node.end();
    if (node.begin < first) {
      restore(node);
      if (end <= first) continue;
      node = {first, end - first, Origin::Cut, node.source};
    }
    add(node);
  }
  while (static_cast<int>(nodes_.size()) < count) append();
  for (; static_cast<int>(nodes_.size()) > count; nodes_.pop_back()) {
    restore(nodes_.back());
    next_ = nodes_.back();
  }

  stages_.clear();
  sources_.clear();
  for (const Node& node : nodes_) {
    stages_.push_back(getStage(node.begin));
    const bool is_new = before_.empty() || node.origin == Origin::Earlier;
    const int length = is_new ? 1 : before_[node.source].length;
    const bool replaced = node.begin >= changed && node.begin < changed_end;
    sources_.push_back({node.source, is_new ? 0 : std::sqrt(static_cast<double>(node.length) / length),
                        node.origin == Origin::Kept && node.length == length && !replaced});
  }
  sources_.front().same = false;  // it has a new state
  sources_.push_back({count, 1, false});
}

int WindowGrid::getStage(int stage) const {
  const int size = horizon_.getProblem().numStages();
  return (horizon_.getNode(first_) + stage - first_ + size) % size;
}

bool WindowGrid::areAlike(int stage, int next) const {
  const RobotProblem& problem = horizon_.getProblem();
  const StageSpec &a = problem.spec(getStage(stage)), &b = problem.spec(getStage(next));
  return a.kind == StageKind::Dynamics && b.kind == StageKind::Dynamics && a.dt == b.dt && a.step == b.step &&
         horizon_.getPhase(stage) == horizon_.getPhase(next) && a.constraints.contacts == b.constraints.contacts &&
         bielle::areAlike(problem.model(), a.state, b.state) && areSame(a.control, b.control) &&
         areSame(a.effort_limits, b.effort_limits) && bielle::areAlike(a.costs, b.costs) &&
         bielle::areAlike(a.path_constraints, b.path_constraints);
}

int WindowGrid::getMost(const Node& node) const {
  const double h = node.numbers >= 0 ? numbers_[node.numbers].dt : horizon_.getProblem().spec(getStage(node.begin)).dt;
  return getMostStages(node.begin - first_, options_.fine_nodes, h > 0 ? calcRatio(h / time_) : 1);
}

// Of the first of a node's stages, which stands for all of them. In place: a copy would be sixty blocks of memory.
void WindowGrid::stretch(StageSpec& spec, int length, Numbers& before) const {
  before.dt = spec.dt;
  spec.dt *= length;
  // Eq. (7) of robot_problem.h: the steps of stages follow the springs of joints, longer ones need not.
  const Model& model = horizon_.getProblem().model();
  if (!model.jointForces().empty()) {
    before.armature.swap(spec.armature);
    spec.armature.setZero(model.nv());
    for (const JointForce& force : model.jointForces())
      spec.armature[force.dof] += 0.25 * spec.dt * spec.dt * std::max(0.0, force.stiffness);
  }
  before.others.clear();
  for (const Closure& closure : spec.constraints.closures)
    before.others.insert(before.others.end(), {closure.kp, closure.kd});
  limitGains(spec.step, spec.dt, spec.constraints);
  // Costs grow with the length, and penalties, which are of squares, likewise.
  for (PathConstraint& constraint : spec.path_constraints) {
    before.others.insert(before.others.end(), constraint.scale.begin(), constraint.scale.end());
    constraint.scale /= std::sqrt(length);
  }
}

void WindowGrid::restore(StageSpec& spec, Numbers& before) const {
  spec.dt = before.dt;
  if (!horizon_.getProblem().model().jointForces().empty()) spec.armature.swap(before.armature);
  auto next = before.others.begin();
  for (Closure& closure : spec.constraints.closures) {
    closure.kp = *next++;
    closure.kd = *next++;
  }
  for (PathConstraint& constraint : spec.path_constraints)
    for (double& scale : constraint.scale) scale = *next++;
}

void WindowGrid::restore(Node& node) {
  if (node.numbers < 0) return;
  if (node.begin >= horizon_.begin())  // else the problem has another stage there by now
    horizon_.getProblem().changeNumbers(getStage(node.begin),
                                        [&](StageSpec& spec) { restore(spec, numbers_[node.numbers]); });
  free_.push_back(std::exchange(node.numbers, -1));
}

// Adds a node, in parts if it is too long.
void WindowGrid::add(Node node) {
  const int most = getMost(node);
  if (node.length > most) {
    const int half = (node.length + 1) / 2;
    restore(node);
    const Node rest{node.begin + half, node.length - half, Origin::Cut, node.source};
    node.length = half;
    add(node);
    add(rest);
    return;
  }
  if (node.length > 1 && node.numbers < 0) {
    if (free_.empty()) {
      free_.push_back(static_cast<int>(numbers_.size()));
      numbers_.emplace_back();
    }
    node.numbers = free_.back();
    free_.pop_back();
    horizon_.getProblem().changeNumbers(getStage(node.begin),
                                        [&](StageSpec& spec) { stretch(spec, node.length, numbers_[node.numbers]); });
  }
  nodes_.push_back(node);
}

void WindowGrid::append() {
  Node node;
  node.begin = nodes_.empty() ? first_ : end();
  node.source = std::max(0, static_cast<int>(before_.size()) - 1);
  const int most = getMost(node);
  while (node.length < most && areAlike(node.begin, node.begin + node.length)) ++node.length;
  add(node);
}

}  // namespace bielle
