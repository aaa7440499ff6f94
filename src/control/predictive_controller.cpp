#include "bielle/control/predictive_controller.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <stdexcept>

#include "bielle/dynamics/impact.h"
#include "bielle/model/error.h"
#include "control/policy_stages.h"
#include "solve/lq_sweep.h"
#include "solve/window.h"

namespace bielle {
namespace {

constexpr double kClockTolerance = 1e-9;  // s: a clock that sums up its steps may be this much early
constexpr int kAhead = 3;                 // stages of a policy: what is left when solves fail
constexpr int kEarly = 2;                 // stages before its landing at which a foot counts as early
constexpr int kFirstIterations = 10;      // of the solve before the start
constexpr size_t kExpectedSolves = 100000;

// Where a window should end.
StateCost makeEndCost(const Model& model, const VectorXd& q, const PredictiveOptions& o) {
  const int nv = model.nv();
  VectorXd weights(2 * nv);
  weights << o.end_posture * selectMainJoints(model), o.end_velocity * selectMainJoints(model);
  if (model.hasFreeFlyer()) {
    weights.head<6>() << o.end_place, o.end_place, o.end_posture, o.end_posture, o.end_posture, o.end_place;
    weights.segment<6>(nv).setConstant(o.end_velocity);
  }
  return {1, q, VectorXd::Zero(nv), weights};
}

FddpOptions makeSolverOptions(const Motion& motion, const PredictiveOptions& options, int iterations) {
  FddpOptions out;
  out.threads = options.threads;
  out.max_iterations = iterations;
  out.initial_regularization = out.min_regularization = options.regularization;
  out.last_rollout = LastRollout::Segments;
  // One penalty for all solves: each takes a few iterations only, and multipliers are moved on from one to the next.
  out.constraints.initial_penalty = options.penalty;
  out.constraints.penalty_increase = 1;
  if (motion.bounded) out.bounds = ControlBounds::Enforce;
  return out;
}

}  // namespace

Motion makePredictiveMotion(const Model& model, MotionPlan plan, const ProblemOptions& problem,
                            const PredictiveOptions& options) {
  const size_t copies = static_cast<size_t>(options.nodes);
  const StageSpec last = *(plan.stages.end() - 2);
  if (last.kind != StageKind::Dynamics)
    throw ModelError(model.name(), "motion '" + plan.name + "'", "it ends with an impact", "let it end standing");
  plan.stages.insert(plan.stages.end() - 1, copies, last);
  plan.schedule.phases.back().nodes += options.nodes;
  plan.guess.xs.insert(plan.guess.xs.end(), copies, VectorXd(plan.guess.xs.back()));
  plan.guess.us.insert(plan.guess.us.end(), copies, VectorXd(plan.guess.us.back()));
  plan.stages.back() = StageSpec();
  plan.stages.back().state = makeEndCost(model, plan.q_end, options);
  plan.goals.clear();
  return makeMotion(model, std::move(plan), problem);
}

class PredictiveController::Planner {
 public:
  Planner(Motion motion, const ShootingTrajectory& plan, const PredictiveOptions& options)
      : options_(options),
        motion_(std::move(motion)),
        problem_(*motion_.problem),
        model_(problem_.model()),
        window_(problem_, options.nodes),
        evaluator_(problem_),
        impact_(model_),
        solver_(makeSolverOptions(motion_, options, options.iterations)) {
    if (problem_.formulation() != Formulation::Reduced || problem_.hasFreeTimings())
      throw std::invalid_argument("PredictiveController: the problem is not reduced, or its durations are free");
    last_ = problem_.numStages() - options.nodes;
    if (static_cast<int>(plan.us.size()) != last_)
      throw std::invalid_argument("PredictiveController: the plan is not one of the motion");
    listStages();
    extendPlan(plan);
    const VectorXd u0 = VectorXd::Zero(model_.nu());
    next_u_hold_ = u_ = u0;
    x_ = problem_.initialState();
    next_stages_.resize(kAhead);
    for (Policy::Stage& stage : next_stages_) stage.K.setZero(model_.nu(), 2 * model_.nv());
    startFromPlan();
    Fddp first(makeSolverOptions(motion_, options, kFirstIterations));
    first.solve(window_, trajectory_);
    counts_.seconds.reserve(kExpectedSolves);
    makePolicy(first, 0);
    policy_ = std::make_unique<Policy>(model_, next_stages_, next_u_hold_);
  }

  double getPlanTime(double time) const { return time + advance_; }
  void update(const Measurement& measurement, VectorRef u) {
    if (ready_ && measurement.getActionTime() + kClockTolerance >= getStart(target_)) bringIntoForce();
    while (measurement.time + kClockTolerance >= getStart(stage_ + 1)) enter(stage_ + 1, measurement);
    policy_->update(measurement, u);
  }
  const PredictiveCounts& getCounts() const { return counts_; }

 private:
  void listStages() {
    double time = 0;
    for (int k = 0; k < problem_.numStages(); ++k) {
      starts_.push_back(time);
      time += problem_.spec(k).dt;
    }
    int phase = 0;
    for (const ContactPhase& p : motion_.schedule.phases) phases_.insert(phases_.end(), p.nodes, phase++);
  }
  void extendPlan(const ShootingTrajectory& plan) {
    plan_ = plan;
    VectorXd rest = plan.xs.back();
    rest.tail(model_.nv()).setZero();
    const VectorXd u = calcStaticTorques(model_, problem_.spec(last_).constraints, rest.head(model_.nq())).u;
    plan_.xs.resize(problem_.numStages() + 1, rest);
    plan_.us.resize(problem_.numStages(), u);
  }

  // The stages of the motion, then the copies of the last one, of which there is no end.
  int getNode(int stage) const { return std::min(stage, last_); }
  double getPlanned(int stage) const {
    return stage <= last_ ? starts_[stage] : starts_[last_] + (stage - last_) * problem_.spec(last_).dt;
  }
  double getStart(int stage) const { return getPlanned(stage) - advance_; }
  bool isImpact(int stage) const { return problem_.spec(getNode(stage)).kind == StageKind::Impact; }

  void bringIntoForce() {
    policy_->exchange(next_stages_, next_u_hold_);
    ready_ = false;
  }

  void enter(int stage, const Measurement& measurement) {
    stage_ = stage;
    if (ready_) bringIntoForce();
    if (isImpact(stage)) return;
    const auto begin = std::chrono::steady_clock::now();
    try {
      ready_ = predict(measurement) && solve();
    } catch (const std::exception&) {
      ready_ = false;
    }
    if (!ready_) {
      ++counts_.failed;
      solver_ = Fddp(makeSolverOptions(motion_, options_, options_.iterations));
      startFromPlan();
    }
    ++counts_.solves;
    counts_.seconds.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
    counts_.missed += counts_.seconds.back() > problem_.spec(getNode(stage_)).dt - measurement.delay;
  }

  // The stage with which a foot stands that swings in this one but is on the ground early, or this stage.
  int findLanding(int stage, const std::vector<char>& contacts) const {
    if (contacts.empty()) return stage;
    const auto stands = [this](int k, int contact) {
      const std::vector<int>& standing = problem_.spec(getNode(k)).constraints.contacts;
      return std::find(standing.begin(), standing.end(), contact) != standing.end();
    };
    const int contacts_of_model = static_cast<int>(contacts.size());
    for (int contact = 0; contact < contacts_of_model; ++contact) {
      if (!contacts[contact] || stands(stage, contact)) continue;
      int begin = stage, end = stage;  // of the swing
      while (begin > 0 && !stands(begin - 1, contact)) --begin;
      while (end < last_ && !stands(end, contact)) ++end;
      if (end < last_ && stage - begin > (end - begin) / 2 && end - stage >= kEarly) return end;
    }
    return stage;
  }

  // Eq. (1), and through an impact if one follows: the stage from which the next policy is to be in force, and its state.
  bool predict(const Measurement& measurement) {
    policy_->update(measurement, u_);
    const int node = getNode(stage_);
    for (int m = 0; m < model_.nu(); ++m) {
      const double limit = model_.motors()[m].effort_limit;
      u_[m] = std::clamp(u_[m], -limit, limit);
    }
    measured_.resize(problem_.stateSize());
    measured_ << measurement.q, measurement.v;
    // About the state that was predicted: there the last window began.
    if (evaluator_.evaluate(node, x_, u_).status != StepStatus::Ok) return false;
    measured_ = evaluator_.integrate(evaluator_.difference(measured_));
    if (updateImpact(model_, impact_, problem_.spec(node).constraints, measured_.head(model_.nq()),
                     measured_.tail(model_.nv())) == DynamicsStatus::Ok)
      measured_.tail(model_.nv()) = impact_.v_plus;
    const RobotEvaluation* step = &evaluator_.evaluate(node, measured_, u_);
    if (step->status != StepStatus::Ok) return false;
    x_ = step->x_next;
    target_ = stage_ + 1;
    if (const int landing = findLanding(target_, measurement.contacts); landing != target_) {
      advance_ += getPlanned(landing) - getPlanned(target_);
      target_ = landing;
      stage_ = landing - 1;
      ++counts_.early;
    }
    while (isImpact(target_)) {
      step = &evaluator_.evaluate(getNode(target_), VectorXd(x_), VectorXd::Zero(model_.nu()));
      if (step->status != StepStatus::Ok) return false;
      x_ = step->x_next;
      ++target_;
    }
    return true;
  }

  bool solve() {
    const int first = getNode(target_), nodes = options_.nodes;
    for (; first_ < first; ++first_) {
      solver_.advance(trajectory_);
      trajectory_.xs[nodes] = plan_.xs[first_ + 1 + nodes];
      trajectory_.us[nodes - 1] = plan_.us[first_ + nodes];
    }
    moveWindow();
    if (solver_.solve(window_, trajectory_).termination == FddpTermination::Failed) return false;
    makePolicy(solver_, target_);
    return true;
  }

  void moveWindow() {
    window_.move(first_, x_);
    const VectorXd& end = plan_.xs[first_ + options_.nodes];
    problem_.setTerminalReference(end.head(model_.nq()), end.tail(model_.nv()));
  }

  // A first guess for the window at the present stage.
  void startFromPlan() {
    first_ = getNode(std::max(stage_, 0));
    const int nodes = options_.nodes;
    trajectory_.xs.assign(plan_.xs.begin() + first_, plan_.xs.begin() + first_ + nodes + 1);
    trajectory_.us.assign(plan_.us.begin() + first_, plan_.us.begin() + first_ + nodes);
    x_ = trajectory_.xs[0];
    moveWindow();
  }

  // The first stages of the window's solution.
  void makePolicy(const Fddp& solver, int stage) {
    int node = 0;
    for (Policy::Stage& out : next_stages_) {
      while (isImpact(stage)) ++stage, ++node;
      const int k = getNode(stage);
      fillStage(problem_, k, getStart(stage), trajectory_.xs[node], trajectory_.us[node], trajectory_.xs[node + 1],
                out);
      out.phase = phases_[k];
      evaluator_.evaluate(k, trajectory_.xs[node], trajectory_.us[node]);
      calcGains(model_, evaluator_, solver.getSweep().getNodes()[node].K, out.K);
      next_u_hold_ = out.u;
      ++stage, ++node;
    }
  }

  const PredictiveOptions options_;
  Motion motion_;
  RobotProblem& problem_;
  const Model& model_;
  ShootingTrajectory plan_;     // of all stages of the problem
  std::vector<double> starts_;  // of each stage, s
  std::vector<int> phases_;     // likewise
  int last_ = 0;                // the first copy of the last stage; the window moves no farther
  Window window_;
  RobotEvaluator evaluator_;
  ImpactWorkspace impact_;
  Fddp solver_;
  ShootingTrajectory trajectory_;  // of the window
  double advance_ = 0;             // how far feet that landed early have brought the motion ahead of its plan, s
  int first_ = 0;                  // stage of the motion with which the window begins
  int stage_ = -1;                 // that was entered last
  int target_ = 0;                 // from which on the policy to be made is in force
  VectorXd x_, measured_, u_;
  std::unique_ptr<Policy> policy_;
  std::vector<Policy::Stage> next_stages_;
  VectorXd next_u_hold_;
  bool ready_ = false;
  PredictiveCounts counts_;
};

double PredictiveCounts::calcQuantile(double share) const {
  if (seconds.empty()) return 0;
  std::vector<double> sorted = seconds;
  std::sort(sorted.begin(), sorted.end());
  const double last = static_cast<double>(sorted.size() - 1);
  return sorted[static_cast<size_t>(std::ceil(share * last))];
}

PredictiveController::PredictiveController(Motion motion, const ShootingTrajectory& plan,
                                           const PredictiveOptions& options)
    : planner_(std::make_unique<Planner>(std::move(motion), plan, options)) {}
PredictiveController::~PredictiveController() = default;

void PredictiveController::update(const Measurement& measurement, VectorRef u) { planner_->update(measurement, u); }
double PredictiveController::getPlanTime(double time) const { return planner_->getPlanTime(time); }
const PredictiveCounts& PredictiveController::getCounts() const { return planner_->getCounts(); }

}  // namespace bielle
