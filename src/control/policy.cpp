#include "bielle/control/policy.h"

#include <algorithm>
#include <stdexcept>

#include "control/clock.h"
#include "control/policy_stages.h"

namespace bielle {
namespace {

double getMiddle(const Policy::Stage& stage) { return stage.start + 0.5 * stage.duration; }

std::vector<Policy::Stage> makeStages(const Motion& motion, const ShootingTrajectory& trajectory,
                                      const std::vector<Gains>& gains) {
  const RobotProblem& problem = *motion.problem;
  if (problem.hasFreeTimings()) throw std::invalid_argument("makePolicy: the motion has free durations");
  RobotEvaluator evaluator(problem);
  std::vector<Policy::Stage> stages;
  double time = 0;
  int node = 0, phase_index = 0;
  for (const ContactPhase& phase : motion.schedule.phases) {
    for (int i = 0; i < phase.nodes; ++i, ++node) {
      const StageSpec& spec = problem.spec(node);
      if (spec.kind == StageKind::Impact) continue;
      const VectorXd &x = trajectory.xs[node], &next = trajectory.xs[node + 1];
      Policy::Stage stage;
      fillStage(problem, node, time, x, trajectory.us[node], next, stage);
      stage.phase = phase_index;
      if (!gains.empty())  // in the bases of the states that they are about, which need not be those of the trajectory
        problem.mapGains(evaluator.evaluate(node, gains[node].x, trajectory.us[node]), gains[node].K, stage.K);
      stages.push_back(std::move(stage));
      time += spec.dt;
    }
    ++phase_index;
  }
  return stages;
}

// Holds the last posture on the contacts of the last phase. Where springs do not balance the weight there, a further stage leads
// to where they do.
Policy makeHoldingPolicy(const Motion& motion, const ShootingTrajectory& trajectory,
                         std::vector<Policy::Stage> stages) {
  constexpr double kSettling = 0.3;  // s
  const Model& model = motion.problem->model();
  const std::vector<ContactTarget>& contacts = motion.schedule.phases.back().contacts;
  const VectorXd& x = trajectory.xs.back();
  const VectorXd q = settlePosture(model, contacts, x.head(model.nq()));
  const VectorXd u = calcStaticTorques(model, makeConstraintSet(model, contacts), q).u;
  if (q != x.head(model.nq())) {
    Policy::Stage rest = stages.back();
    rest.start += rest.duration;
    rest.duration = kSettling;
    rest.q = x.head(model.nq());
    rest.v = x.segment(model.nq(), model.nv());
    model.difference(rest.q, q, rest.q_change);
    rest.v_next.setZero();
    rest.u = u;
    const auto of_phase = [&rest](const Policy::Stage& stage) { return stage.phase == rest.phase; };
    const auto first = std::find_if(stages.begin(), stages.end(), of_phase);
    rest.K = (first + (stages.end() - first) / 5)->K;  // those of a touchdown itself do not hold for long
    ++rest.phase;
    stages.push_back(std::move(rest));
  }
  return {model, std::move(stages), u};
}

}  // namespace

void fillStage(const RobotProblem& problem, int node, double start, const VectorXd& x, const VectorXd& u,
               const VectorXd& x_next, Policy::Stage& stage) {
  const Model& model = problem.model();
  stage.start = start;
  stage.duration = problem.spec(node).dt;
  stage.q = x.head(model.nq());
  stage.v = x.segment(model.nq(), model.nv());
  stage.q_change.resize(model.nv());
  model.difference(stage.q, x_next.head(model.nq()), stage.q_change);
  stage.v_next = x_next.segment(model.nq(), model.nv());
  stage.u = u.head(model.nu());
}

Policy::Policy(const Model& model, std::vector<Stage> stages, const VectorXd& u_hold)
    : model_(model), stages_(std::move(stages)), u_hold_(u_hold) {
  if (stages_.empty()) throw std::invalid_argument("Policy: there are no stages");
  findLastPhase();
  setLookAhead(0);
  step_.setZero(model.nv());
  q_ = model.makeNeutral();
  error_.setZero(2 * model.nv());
}

void Policy::setLookAhead(double duration) {
  gains_.resize(stages_.size());
  for (size_t begin = 0, end = 0; begin < stages_.size(); begin = end) {
    while (end < stages_.size() && stages_[end].phase == stages_[begin].phase) ++end;
    const double last = stages_[end - 1].start + stages_[end - 1].duration - duration + kClockTolerance;
    size_t taken = begin;
    for (size_t k = begin; k < end; ++k) {
      if (stages_[k].start <= last) taken = k;
      gains_[k] = taken;
    }
  }
}

void Policy::exchange(std::vector<Stage>& stages, VectorXd& u_hold) {
  stages_.swap(stages);
  u_hold_.swap(u_hold);
  findLastPhase();
  setLookAhead(0);
}

void Policy::findLastPhase() {
  last_phase_ = stages_.size() - 1;
  while (last_phase_ > 0 && stages_[last_phase_ - 1].phase == stages_.back().phase) --last_phase_;
}

size_t Policy::findStage(double time) const {
  const auto after = std::upper_bound(stages_.begin(), stages_.end(), time + kClockTolerance,
                                      [](double t, const Stage& stage) { return t < stage.start; });
  return after == stages_.begin() ? 0 : static_cast<size_t>(after - stages_.begin()) - 1;
}

void Policy::getReference(double time, VectorRef q, VectorRef v) const {
  const Stage& stage = stages_[findStage(time)];
  // Before the first stage it goes back along that one: what acts when it begins may have been measured earlier.
  const double s = std::clamp((time - stage.start) / stage.duration, &stage == &stages_[0] ? -1.0 : 0.0, 1.0);
  step_ = s * stage.q_change;
  model_.integrate(stage.q, step_, q);
  if (time > duration()) {
    v.setZero();
    return;
  }
  v = (1 - s) * stage.v + s * stage.v_next;
}

void Policy::update(const Measurement& measurement, VectorRef u) {
  const double time = measurement.actionTime();
  if (hasGains()) updateError(measurement);
  if (time + kClockTolerance >= duration()) {
    u = u_hold_;
    addFeedback(last_phase_, 1, u);
    return;
  }
  const size_t k = findStage(time);
  const Stage& stage = stages_[k];
  const bool early = time < getMiddle(stage);
  const size_t other = early ? (k > 0 ? k - 1 : k) : std::min(k + 1, stages_.size() - 1);
  u = stage.u;
  if (other != k && stages_[other].phase == stage.phase) {
    const double weight = (time - getMiddle(stage)) / (getMiddle(stages_[other]) - getMiddle(stage));
    u += weight * (stages_[other].u - stage.u);
  }
  const bool blends = k + 1 < stages_.size() && stages_[k + 1].phase == stage.phase;
  const double s = blends ? std::clamp((time - stage.start) / stage.duration, 0.0, 1.0) : 0;
  addFeedback(k, 1 - s, u);
  if (blends) addFeedback(k + 1, s, u);
}

// The deviation from the plan.
void Policy::updateError(const Measurement& measurement) {
  auto dq = error_.head(model_.nv()), dv = error_.tail(model_.nv());
  getReference(measurement.time, q_, dv);
  dv = measurement.v - dv;
  model_.difference(q_, measurement.q, dq);
}

void Policy::addFeedback(size_t stage, double weight, VectorRef u) const {
  if (hasGains()) u.noalias() += weight * (stages_[gains_[stage]].K * error_);
}

Policy makePolicy(const Motion& motion, const ShootingTrajectory& trajectory) {
  return makeHoldingPolicy(motion, trajectory, makeStages(motion, trajectory, {}));
}

Policy makePolicy(const Solution& solution) {
  const std::vector<Gains>& gains = solution.gains;
  if (gains.size() != solution.trajectory.us.size())
    throw std::invalid_argument("makePolicy: the solution has no gains");
  return makeHoldingPolicy(solution.motion, solution.trajectory,
                           makeStages(solution.motion, solution.trajectory, gains));
}

}  // namespace bielle
