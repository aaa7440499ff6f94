#include "control/window_planner.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "control/clock.h"
#include "control/policy_stages.h"
#include "solve/team.h"

namespace bielle {
namespace {

constexpr int kAhead = 3;             // stages of a policy: what is left when solves fail
constexpr int kAheadIfLate = 8;       // or where they may come late
constexpr int kFirstIterations = 10;  // of the solve before the start

// In real time one core is left to control, which would otherwise interrupt a solve at every instant.
int chooseThreads(const PredictiveOptions& options) {
  return options.threads > 0 || !options.own_thread ? options.threads : std::max(1, getDefaultThreads() - 1);
}

RecedingOptions makeSolverOptions(const PredictiveOptions& options, const RobotSize& size, int iterations) {
  RecedingOptions out;
  out.threads = chooseThreads(options);
  out.iterations = iterations;
  out.initial_regularization = out.min_regularization = options.regularization / (size.torque * size.torque);
  out.state_regularization_ratio = 0;  // of angles, lengths and speeds, which no common number suits
  out.gradient_tolerance = 0;          // steps near the optimum are like others
  // One penalty for all solves: each takes a few iterations only, and multipliers are moved on from one to the next.
  out.constraints.initial_penalty = options.penalty;
  out.constraints.penalty_increase = 1;
  return out;
}

void recordSolve(const FddpSummary& summary, PredictiveSolve& took) {
  took.evaluate = summary.evaluate_seconds;
  took.linearize = summary.linearize_seconds;
  took.sweep = summary.sweep_seconds;
  took.rollout = summary.rollout_seconds;
  for (const FddpIteration& line : summary.log) {
    took.step = std::min(took.step, line.step);
    took.regularization = std::max(took.regularization, line.regularization);
  }
}

}  // namespace

WindowPlanner::WindowPlanner(std::unique_ptr<Horizon> horizon, const PredictiveOptions& options)
    : options_(options),
      horizon_(std::move(horizon)),
      problem_(horizon_->getProblem()),
      model_(problem_.model()),
      size_(calcRobotSize(model_, makeStandingRobot(model_, startPosture()))),
      grid_(*horizon_, options_),
      window_(problem_, options.nodes),
      evaluator_(problem_),
      scratch_(problem_.makeScratch()),
      impact_(model_),
      feet_(model_),
      solver_(makeSolver(options.iterations)),
      predicted_(problem_.makeEvaluation()) {
  u_.setZero(model_.nu());
  x_ = problem_.initialState();
  predicted_->x = VectorXd::Constant(x_.size(), std::numeric_limits<double>::quiet_NaN());  // at none so far
  for (KeptGains& kept : kept_) kept.K.setZero(model_.nu(), 2 * model_.nv());
}

WindowPlanner::Solution WindowPlanner::makeEmpty() const {
  Solution solution;
  solution.stages.resize(options_.own_thread || options_.solve_time > 0 ? kAheadIfLate : kAhead);
  for (Policy::Stage& stage : solution.stages) stage.K.setZero(model_.nu(), 2 * model_.nv());
  solution.u_hold.setZero(model_.nu());
  solution.footholds.reserve(model_.contacts().size());
  return solution;
}

WindowPlanner::Solution WindowPlanner::makeFirst() {
  if (horizon_->isSolved()) aimFootholds();
  startFromGuess(0);
  if (!horizon_->isSolved()) solveFromRest();
  Receding first = makeSolver(kFirstIterations);
  first.step(trajectory_);
  Solution solution = makeEmpty();
  makePolicy(first, trajectory_, 0, solution);
  predictFootholds(0, solution);
  target_ = 0;
  prepare();
  return solution;
}

void WindowPlanner::solve(const Request& request, Solution& solution, Preview* preview) {
  solution.skipped = 0;
  solution.early = solution.late = false;
  solution.took = {};
  solution.took.prepare = std::exchange(prepare_seconds_, 0);
  try {
    const Clock::time_point begin = Clock::now();
    const bool predicted = predict(request, solution);
    solution.took.predict = calcSecondsSince(begin);
    solution.solved = predicted && solveWindow(request, solution, preview);
  } catch (const std::exception&) {
    solution.solved = false;
  }
  if (!solution.solved) {
    solution.took.step = 0;
    restart(request.stage + solution.skipped);
  }
  prepared_ = false;
  tellTime(request, solution);
  if (solution.took.seconds == 0) solution.took.seconds = solution.seconds;  // there was no draft
  // When the next solve begins.
  const double next =
      std::max(horizon_->getStart(solution.target), horizon_->getStart(solution.target + 1) - getLead(options_)) -
      advance_;
  const bool late = options_.own_thread && request.measurement.actionTime() + solution.seconds >= next;
  target_ = solution.solved && !late ? solution.target : -1;
}

void WindowPlanner::tellTime(const Request& request, Draft& out) const {
  out.seconds = calcSecondsSince(request.made);
  out.advance = advance_;
  out.awaited = late_.foot >= 0 ? horizon_->getStart(late_.landing) : -1;
}

// The stage that follows is the next one, unless a foot lands early or late; a stage with several solves has the same again. A late
// solve leaves no time: the next one begins at once.
void WindowPlanner::prepare() {
  if (target_ < 0 || late_.foot >= 0 || options_.solve_time > 0) return;
  const Clock::time_point begin = Clock::now();
  int next = target_ + 1;
  while (isImpact(next)) ++next;
  const int first = horizon_->getFirst(next);
  try {
    solver_.exchangeEvaluation(0, predicted_);
    horizon_->prepare(first);
    prepared_ = move(first);
    window_.move(grid_.stages(), trajectory_.xs[0]);  // as foreseen: the window may yet move back, and keep it
    if (prepared_) solver_.prepare(trajectory_);
  } catch (const std::exception&) {
    prepared_ = false;
  }
  if (!prepared_) restart(next);
  prepare_seconds_ = calcSecondsSince(begin);
}

bool WindowPlanner::isPrepared(int first) const { return prepared_ && !lowered_ && grid_.begin() == first; }

Receding WindowPlanner::makeSolver(int iterations) const {
  return Receding(window_, makeSolverOptions(options_, size_, iterations));
}

// From a guess that stands still, step by step to the end.
void WindowPlanner::solveFromRest() {
  FddpOptions options;
  options.threads = chooseThreads(options_);
  options.initial_regularization = kGuessRegularization;
  trajectory_ = bielle::solve(window_, std::move(trajectory_), options).trajectory;
}

// Eq. (1), and through an impact if one follows: the stage from which the next policy is to be in force, and its state.
bool WindowPlanner::predict(const Request& request, Solution& solution) {
  const int node = horizon_->getNode(request.stage);
  for (int m = 0; m < model_.nu(); ++m) {
    const Motor& motor = model_.motors()[m];
    u_[m] = motor.clampEffort(request.u[m], request.measurement.v[motor.dof]);
  }
  measured_.resize(problem_.stateSize());
  measured_ << request.measurement.q, request.measurement.v;
  // About the state that was predicted: there the last window began.
  const NodeEvaluation* predicted = prepared_ ? predicted_.get() : solver_.getEvaluation(0);
  if (!predicted || predicted->x != x_) predicted = &evaluator_.evaluate(node, x_, u_);
  if (predicted->status != NumericalStatus::Ok) return false;
  interpolate(node, *predicted, measured_, 1, measured_);
  if (updateImpact(model_, impact_, problem_.spec(node).constraints, measured_.head(model_.nq()),
                   measured_.tail(model_.nv())) == NumericalStatus::Ok)
    measured_.tail(model_.nv()) = impact_.v_plus;
  const RobotEvaluation* step = &evaluator_.evaluate(node, measured_, u_);
  if (step->status != NumericalStatus::Ok) return false;
  x_ = step->x_next;
  if (request.progress > 0) x_ = findRest(request, *step);
  int target = chooseNext(request, solution);
  solution.skipped = target - (request.stage + 1);
  advance_ += horizon_->getStart(target) - horizon_->getStart(request.stage + 1);
  while (isImpact(target)) {
    step = &evaluator_.evaluate(horizon_->getNode(target), x_, u_.setZero());
    if (step->status != NumericalStatus::Ok) return false;
    x_ = step->x_next;
    ++target;
  }
  solution.target = target;
  return true;
}

// After the rest of the stage, of a step of the whole: with the same acceleration.
VectorXd WindowPlanner::findRest(const Request& request, const RobotEvaluation& step) {
  const double rest = 1 - request.progress;
  VectorXd dx = evaluator_.difference(step.x_next);
  const Eigen::Index n = dx.size() / 2;
  dx.head(n) -= 0.5 * request.progress * step.dt * dx.tail(n);
  dx *= rest;
  return evaluator_.integrate(dx);
}

// From the state of an evaluation a share of the way to another, with loops closed.
void WindowPlanner::interpolate(int node, const NodeEvaluation& at, const VectorXd& x, double share, VectorXd& out) {
  dx_.resize(problem_.tangentSize(node));
  out.resize(problem_.stateSize());
  const DifferenceTask difference{node, &at, &x, &dx_};
  problem_.difference(&difference, 1, scratch_.get());
  dx_ *= share;
  const IntegrateTask integrate{node, &at, &dx_, &out};
  problem_.integrate(&integrate, 1, scratch_.get());
}

bool WindowPlanner::solveWindow(const Request& request, Solution& solution, Preview* preview) {
  const int first = horizon_->getFirst(solution.target);
  if (isPrepared(first)) {
    window_.move(grid_.stages(), x_);
  } else {
    horizon_->prepare(first);
    if (!move(first)) return false;
  }
  if (preview) {
    Draft& draft = preview->draft;
    foresight_.stages = countNodes(solution.target, draft.stages.size());
    foresight_.use = [&] {
      makePolicy(solver_, foresight_.nodes, solution.target, draft);
      draft.solved = true;
      draft.target = solution.target;
      draft.skipped = solution.skipped;
      tellTime(request, draft);
      solution.took.seconds = draft.seconds;
      preview->publish();
    };
  }
  const FddpSummary& summary = solver_.step(trajectory_, {}, preview ? &foresight_ : nullptr);
  recordSolve(summary, solution.took);
  if (summary.termination == FddpTermination::Failed) return false;
  const Clock::time_point begin = Clock::now();
  makePolicy(solver_, trajectory_, solution.target, solution);
  predictFootholds(solution.target, solution);
  solution.took.policy = calcSecondsSince(begin);
  return true;
}

// The window begins with this stage, and with the state that was predicted for it; earlier than before if a foot is late.
bool WindowPlanner::move(int first) {
  const std::vector<WindowGrid::Node>& nodes = grid_.nodes();
  for (size_t k = 0; k < nodes.size() && nodes[k].begin < first; ++k) {
    if (past_us_.size() < static_cast<size_t>(kLowering + kLate + 2))
      past_us_.emplace_back();
    else
      std::rotate(past_us_.begin(), past_us_.begin() + 1, past_us_.end());
    past_us_.back() = trajectory_.us[k];
  }
  const int end = grid_.end();
  if (lowered_)
    grid_.move(first, late_.landing - kLowering, late_.landing + 1);
  else
    grid_.move(first);
  lowered_ = false;
  std::swap(before_, trajectory_);
  trajectory_.xs.resize(nodes.size() + 1);
  trajectory_.us.resize(nodes.size());
  for (size_t k = 0; k < nodes.size(); ++k) {
    if (!continueState(nodes[k], k)) return false;
    continueControl(nodes[k], k);
  }
  if (grid_.end() == end) trajectory_.xs.back() = before_.xs.back();
  if (grid_.next() && !continueState(*grid_.next(), nodes.size())) return false;
  solver_.move(grid_.sources());
  setWindow();
  return true;
}

// The state of node k, from the trajectory of the window before; that after an appended node is there already.
bool WindowPlanner::continueState(const WindowGrid::Node& node, size_t k) {
  std::vector<VectorXd>& xs = trajectory_.xs;
  using Origin = WindowGrid::Origin;
  if (node.origin == Origin::Kept) {
    xs[k] = before_.xs[node.source];
  } else if (node.origin == Origin::Earlier || (node.origin == Origin::Cut && k == 0)) {
    xs[k] = x_;
  } else if (node.origin == Origin::Cut) {
    const WindowGrid::Node& whole = grid_.before()[node.source];
    const int stage = grid_.stages()[k - 1];  // any: their tangent spaces are alike
    const NodeEvaluation* at = solver_.getEvaluation(node.source);
    if (!at) at = &evaluator_.evaluate(stage, before_.xs[node.source], before_.us[node.source]);
    const double share = static_cast<double>(node.begin - whole.begin) / whole.length;
    interpolate(stage, *at, before_.xs[node.source + 1], share, xs[k]);
    return xs[k].allFinite();
  } else if (k == 0 || grid_.nodes()[k - 1].origin != Origin::Appended) {
    xs[k] = before_.xs.back();
  }
  return true;
}

// The control of node k; and after one that is appended, the state.
void WindowPlanner::continueControl(const WindowGrid::Node& node, size_t k) {
  auto& [xs, us] = trajectory_;
  using Origin = WindowGrid::Origin;
  if (node.origin == Origin::Kept || node.origin == Origin::Cut) {
    us[k] = before_.us[node.source];
  } else if (node.origin == Origin::Earlier) {
    us[k] = past_us_.empty() ? before_.us.front() : past_us_.back();
    if (!past_us_.empty()) past_us_.pop_back();
  } else {
    us[k] = k == 0 ? before_.us.back() : us[k - 1];
    xs[k + 1] = xs[k];
    horizon_->extend(node.begin, node.end(), xs[k + 1], us[k]);
  }
}

void WindowPlanner::setWindow() {
  window_.move(grid_.stages(), x_);
  const VectorXd& end = horizon_->getState(grid_.end());
  problem_.setTerminalReference(end.head(model_.nq()), end.tail(model_.nv()));
}

// After a failure.
void WindowPlanner::restart(int stage) {
  solver_ = makeSolver(options_.iterations);
  startFromGuess(stage);
}

// A first guess for the window that begins with a stage.
void WindowPlanner::startFromGuess(int stage) {
  const int first = horizon_->getFirst(stage);
  horizon_->prepare(first);
  grid_.clear();
  grid_.move(first);
  trajectory_.xs.clear();
  trajectory_.us.clear();
  for (const WindowGrid::Node& node : grid_.nodes()) {
    trajectory_.xs.push_back(horizon_->makeGuess(node.begin));
    trajectory_.us.push_back(horizon_->getControl(node.begin));
  }
  trajectory_.xs.push_back(horizon_->makeGuess(grid_.end()));
  x_ = trajectory_.xs[0];
  setWindow();
}

// Less than the look-ahead is left of its phase.
bool WindowPlanner::isNearEnd(int stage) const {
  const double end = horizon_->getStart(stage) + options_.look_ahead - kClockTolerance;
  for (int k = stage + 1; horizon_->getStart(k) < end; ++k)
    if (horizon_->getPhase(k) != horizon_->getPhase(stage)) return true;
  return false;
}

// Gains of a stage that is near the end of its phase: of the stage before it in the policy, or of an earlier solution.
const RowMatrixXd* WindowPlanner::findEarlierGains(const Policy::Stage* before, int phase) const {
  if (before && before->phase == phase) return &before->K;
  for (const KeptGains& kept : kept_)
    if (kept.phase == phase) return &kept.K;
  return nullptr;
}

void WindowPlanner::keepGains(int phase, const RowMatrixXd& K) {
  if (kept_[0].phase != phase) std::swap(kept_[0], kept_[1]);
  kept_[0].phase = phase;
  kept_[0].K = K;
}

// Of the window that begins with a stage, until so many are over that take time.
int WindowPlanner::countNodes(int stage, size_t stages) const {
  int node = 0;
  for (size_t i = 0; i < stages; ++i, ++node)
    while (isImpact(stage + node)) ++node;
  return node;
}

// The first stages of a window with these nodes.
void WindowPlanner::makePolicy(const Receding& solver, const ShootingTrajectory& nodes, int stage, Draft& out) {
  int node = 0;
  const Policy::Stage* before = nullptr;
  for (Policy::Stage& next : out.stages) {
    while (isImpact(stage)) ++stage, ++node;
    fillStage(problem_, grid_.stages()[node], horizon_->getStart(stage) - advance_, nodes.xs[node], nodes.us[node],
              nodes.xs[node + 1], next);
    next.phase = horizon_->getPhase(stage);
    const RowMatrixXd* earlier = isNearEnd(stage) ? findEarlierGains(before, next.phase) : nullptr;
    if (earlier) {
      next.K = *earlier;
    } else {
      const auto& linearized = static_cast<const RobotEvaluation&>(solver.getLinearized(node));
      problem_.mapGains(linearized, solver.getGains(node).K, next.K);
      if (next.phase == out.stages.front().phase) keepGains(next.phase, next.K);
    }
    out.u_hold = next.u;
    before = &next;
    ++stage, ++node;
  }
}

}  // namespace bielle
