#include "bielle/control/predictive_controller.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "bielle/dynamics/impact.h"
#include "control/horizon.h"
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

FddpOptions makeSolverOptions(bool bounded, const PredictiveOptions& options, int iterations) {
  FddpOptions out;
  out.threads = options.threads;
  out.max_iterations = iterations;
  out.initial_regularization = out.min_regularization = options.regularization;
  out.last_rollout = LastRollout::Segments;
  // One penalty for all solves: each takes a few iterations only, and multipliers are moved on from one to the next.
  out.constraints.initial_penalty = options.penalty;
  out.constraints.penalty_increase = 1;
  if (bounded) out.bounds = ControlBounds::Enforce;
  return out;
}

}  // namespace

class PredictiveController::Planner {
 public:
  Planner(std::unique_ptr<Horizon> horizon, const PredictiveOptions& options)
      : options_(options),
        horizon_(std::move(horizon)),
        problem_(horizon_->getProblem()),
        model_(problem_.model()),
        window_(problem_, options.nodes),
        evaluator_(problem_),
        impact_(model_),
        solver_(makeSolver(options.iterations)) {
    const VectorXd u0 = VectorXd::Zero(model_.nu());
    next_u_hold_ = u_ = u0;
    x_ = problem_.initialState();
    next_stages_.resize(kAhead);
    for (Policy::Stage& stage : next_stages_) stage.K.setZero(model_.nu(), 2 * model_.nv());
    startFromGuess();
    if (!horizon_->isSolved()) solveFromRest();
    Fddp first = makeSolver(kFirstIterations);
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
  Fddp makeSolver(int iterations) const { return Fddp(makeSolverOptions(horizon_->isBounded(), options_, iterations)); }
  // From a guess that stands still, step by step to the end.
  void solveFromRest() {
    FddpOptions options;
    options.threads = options_.threads;
    options.initial_regularization = kGuessRegularization;
    if (horizon_->isBounded()) options.bounds = ControlBounds::Enforce;
    Fddp(options).solve(window_, trajectory_);
  }
  double getStart(int stage) const { return horizon_->getStart(stage) - advance_; }
  const StageSpec& getSpec(int stage) const { return problem_.spec(horizon_->getNode(stage)); }
  bool isImpact(int stage) const { return getSpec(stage).kind == StageKind::Impact; }

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
      solver_ = makeSolver(options_.iterations);
      startFromGuess();
    }
    ++counts_.solves;
    counts_.seconds.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
    counts_.missed += counts_.seconds.back() > getSpec(stage_).dt - measurement.delay;
  }

  // The stage with which a foot stands that swings in this one but is on the ground early, or this stage.
  int findLanding(int stage, const std::vector<char>& contacts) const {
    if (contacts.empty()) return stage;
    const auto stands = [this](int k, int contact) {
      const std::vector<int>& standing = getSpec(k).constraints.contacts;
      return std::find(standing.begin(), standing.end(), contact) != standing.end();
    };
    const int contacts_of_model = static_cast<int>(contacts.size());
    for (int contact = 0; contact < contacts_of_model; ++contact) {
      if (!contacts[contact] || stands(stage, contact)) continue;
      int begin = stage, end = stage;  // of the swing
      while (begin > horizon_->getBegin() && !stands(begin - 1, contact)) --begin;
      while (end < horizon_->getEnd() && !stands(end, contact)) ++end;
      if (end < horizon_->getEnd() && stage - begin > (end - begin) / 2 && end - stage >= kEarly) return end;
    }
    return stage;
  }

  // Eq. (1), and through an impact if one follows: the stage from which the next policy is to be in force, and its state.
  bool predict(const Measurement& measurement) {
    policy_->update(measurement, u_);
    const int node = horizon_->getNode(stage_);
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
      advance_ += horizon_->getStart(landing) - horizon_->getStart(target_);
      target_ = landing;
      stage_ = landing - 1;
      ++counts_.early;
    }
    while (isImpact(target_)) {
      step = &evaluator_.evaluate(horizon_->getNode(target_), VectorXd(x_), VectorXd::Zero(model_.nu()));
      if (step->status != StepStatus::Ok) return false;
      x_ = step->x_next;
      ++target_;
    }
    return true;
  }

  bool solve() {
    const int first = horizon_->getFirst(target_), nodes = options_.nodes;
    horizon_->prepare(first);
    for (; first_ < first; ++first_) {
      solver_.advance(trajectory_);
      horizon_->extend(first_ + nodes, trajectory_);
    }
    moveWindow();
    if (solver_.solve(window_, trajectory_).termination == FddpTermination::Failed) return false;
    makePolicy(solver_, target_);
    return true;
  }

  void moveWindow() {
    window_.move(horizon_->getNode(first_), x_);
    const VectorXd& end = horizon_->getState(first_ + options_.nodes);
    problem_.setTerminalReference(end.head(model_.nq()), end.tail(model_.nv()));
  }

  // A first guess for the window at the present stage.
  void startFromGuess() {
    first_ = horizon_->getFirst(std::max(stage_, 0));
    horizon_->prepare(first_);
    const int nodes = options_.nodes;
    trajectory_.xs.resize(nodes + 1);
    trajectory_.us.resize(nodes);
    for (int k = 0; k <= nodes; ++k) trajectory_.xs[k] = horizon_->makeGuess(first_ + k);
    for (int k = 0; k < nodes; ++k) trajectory_.us[k] = horizon_->getControl(first_ + k);
    x_ = trajectory_.xs[0];
    moveWindow();
  }

  // The first stages of the window's solution.
  void makePolicy(const Fddp& solver, int stage) {
    int node = 0;
    for (Policy::Stage& out : next_stages_) {
      while (isImpact(stage)) ++stage, ++node;
      const int k = horizon_->getNode(stage);
      fillStage(problem_, k, getStart(stage), trajectory_.xs[node], trajectory_.us[node], trajectory_.xs[node + 1],
                out);
      out.phase = horizon_->getPhase(stage);
      evaluator_.evaluate(k, trajectory_.xs[node], trajectory_.us[node]);
      calcGains(model_, evaluator_, solver.getSweep().getNodes()[node].K, out.K);
      next_u_hold_ = out.u;
      ++stage, ++node;
    }
  }

  const PredictiveOptions options_;
  const std::unique_ptr<Horizon> horizon_;
  RobotProblem& problem_;
  const Model& model_;
  Window window_;
  RobotEvaluator evaluator_;
  ImpactWorkspace impact_;
  Fddp solver_;
  ShootingTrajectory trajectory_;  // of the window
  double advance_ = 0;             // how far feet that landed early have brought the motion ahead of its plan, s
  int first_ = 0;                  // stage with which the window begins
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
    : planner_(std::make_unique<Planner>(makeMotionHorizon(std::move(motion), plan, options), options)) {}
PredictiveController::PredictiveController(CommandedWalk walk, const PredictiveOptions& options)
    : planner_(std::make_unique<Planner>(makeWalkHorizon(std::move(walk), options), options)) {}
PredictiveController::~PredictiveController() = default;

void PredictiveController::update(const Measurement& measurement, VectorRef u) { planner_->update(measurement, u); }
double PredictiveController::getPlanTime(double time) const { return planner_->getPlanTime(time); }
const PredictiveCounts& PredictiveController::getCounts() const { return planner_->getCounts(); }

}  // namespace bielle
