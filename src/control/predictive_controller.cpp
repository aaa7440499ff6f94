#include "bielle/control/predictive_controller.h"

#include <limits>
#include <utility>

#include "control/clock.h"
#include "control/dead_point_stop.h"
#include "control/solving_thread.h"
#include "math/quantile.h"

namespace bielle {
namespace {

constexpr size_t kSolves = 100000;    // that are kept
constexpr double kPeriodShare = 0.9;  // after which the next instant of control may come

}  // namespace

// What happens at an instant of control.
class PredictiveController::Loop {
 public:
  Loop(std::unique_ptr<Horizon> horizon, const PredictiveOptions& options)
      : solve_time_(options.solve_time),
        lead_(WindowPlanner::getLead(options)),
        planner_(std::move(horizon), options),
        solution_(planner_.makeEmpty()),
        next_(planner_.makeEmpty()),
        preview_{planner_.makeEmpty(), {}},
        dead_point_stop_(planner_.model(), planner_.startPosture(), options.dead_point_stop) {
    listOptions(options, "option", "PredictiveOptions").check();
    const Model& model = planner_.model();
    WindowPlanner::Solution first = planner_.makeFirst();
    policy_ = std::make_unique<Policy>(model, std::move(first.stages), first.u_hold);
    footholds_ = std::move(first.footholds);
    request_.measurement.q = model.makeNeutral();
    request_.measurement.v.setZero(model.nv());
    request_.measurement.contacts.resize(model.contacts().size());
    request_.u.setZero(model.nu());
    counts_.last.reserve(kSolves);
    if (options.own_thread) thread_ = std::make_unique<SolvingThread>(planner_, request_, solution_, preview_);
  }

  void update(const Measurement& measurement, VectorRef u) {
    const double time = measurement.time + kClockTolerance;
    if (solves_ && isDone(time))
      receive(measurement);
    else if (solves_ && !drafted_ && isDrafted())
      adopt(preview_.draft, measurement);
    if (next_.solved && time + measurement.delay >= getStart(next_.target)) {
      policy_->exchange(next_.stages, next_.u_hold);
      next_.solved = false;
      PredictiveSolve& took = counts_.last[next_place_];
      if (took.latency < 0) took.latency = measurement.time - took.time;
    }
    policy_->update(measurement, u);
    dead_point_stop_.add(measurement, u);
    const int before = stage_;
    while (time >= getStart(stage_ + 1)) ++stage_;  // an impact takes no time
    if (stage_ != before) {
      counts_.missed += waits_;
      ++counts_.stages;
      waits_ = true;
    }
    if (!solves_ && (waits_ ? isDue(measurement) : leavesTime(measurement))) solve(measurement, u);
    last_time_ = measurement.time;
  }
  double getPlanTime(double time) const { return awaited_ >= 0 ? awaited_ : time + advance_; }
  const PredictiveCounts& counts() const { return counts_; }
  const Policy& policy() const { return *policy_; }
  const std::vector<PredictedFoothold>& footholds() const { return footholds_; }
  void waitForSolve() const {
    if (thread_) thread_->waitUntilDone();
  }

 private:
  double getStart(int stage) const { return planner_.getStart(stage) - advance_; }

  bool isDone(double time) const {
    return thread_ ? thread_->state() == SolvingThread::State::Done : time >= request_.measurement.time + solve_time_;
  }

  bool isDrafted() const { return thread_ && thread_->state() == SolvingThread::State::Drafted; }

  // Whether the next instant of control, about a period from now, would be too late for the solve of the present stage.
  bool isDue(const Measurement& measurement) const {
    const double period = measurement.time - last_time_;
    return solve_time_ > 0 || was_late_ ||
           measurement.actionTime() + kPeriodShare * period + lead_ >= getStart(stage_ + 1);
  }

  // Whether the present stage does, for another solve.
  bool leavesTime(const Measurement& measurement) const {
    return solve_time_ > 0 && measurement.actionTime() + solve_time_ <= getStart(stage_ + 1) + kClockTolerance;
  }

  void solve(const Measurement& measurement, ConstVectorRef u) {
    const double begin = getStart(stage_), end = getStart(stage_ + 1);
    request_.stage = stage_;
    request_.again = !waits_;
    const double passed = measurement.time - begin;
    request_.progress = passed > kClockTolerance ? std::min(passed / (end - begin), 1.0) : 0;
    request_.measurement = measurement;
    request_.u = u;
    request_.made = Clock::now();
    waits_ = false;
    solves_ = true;
    drafted_ = false;
    if (thread_) return thread_->begin();
    planner_.solve(request_, solution_);
    planner_.prepare();
    if (solve_time_ > 0) return;
    const PredictiveSolve& took = solution_.took;
    const double left = std::min(end - measurement.actionTime(), lead_);
    counts_.missed += took.seconds > left || took.prepare + took.seconds > end - begin - measurement.delay;
    receive(measurement);
  }

  // Of a draft, then of the solution: the policy awaits its stage, that of the solution instead of the draft's.
  void adopt(WindowPlanner::Draft& draft, const Measurement& measurement) {
    const size_t place = getPlace();
    if (!drafted_) {
      stage_ += draft.skipped;
      advance_ = draft.advance;
      awaited_ = draft.awaited;
      was_late_ = thread_ && measurement.actionTime() > getStart(draft.target) + kClockTolerance;
      if (counts_.last.size() < kSolves) counts_.last.emplace_back();
      counts_.last[place] = {};
      counts_.last[place].time = request_.measurement.time;
      counts_.last[place].seconds = draft.seconds;
    }
    drafted_ = true;
    if (!draft.solved) return;
    std::swap(draft, next_);
    next_place_ = place;
  }

  void receive(const Measurement& measurement) {
    if (thread_) thread_->setIdle();
    solves_ = false;
    const bool solved = solution_.solved;
    adopt(solution_, measurement);
    PredictiveSolve& took = counts_.last[getPlace()];
    solution_.took.time = took.time;
    solution_.took.latency = took.latency;
    took = solution_.took;
    counts_.failed += !solved;
    counts_.early += solution_.early;
    counts_.late += solution_.late;
    ++counts_.solves;
    if (solved) footholds_ = solution_.footholds;  // there is room for those of all contacts
  }

  // Of the solve under way, in the counts.
  size_t getPlace() const { return static_cast<size_t>(counts_.solves) % kSolves; }

  const double solve_time_, lead_;
  WindowPlanner planner_;
  WindowPlanner::Request request_;
  WindowPlanner::Solution solution_;  // of the solve under way, or memory for the next one
  WindowPlanner::Draft next_;         // if solved, it awaits the stage from which on it is in force
  WindowPlanner::Preview preview_;    // of the solve under way
  DeadPointStop dead_point_stop_;
  std::unique_ptr<Policy> policy_;
  std::vector<PredictedFoothold> footholds_;
  int stage_ = -1;                                               // the present one
  double last_time_ = -std::numeric_limits<double>::infinity();  // of the measurement before, s
  bool waits_ = false;                                           // it has no solve yet
  bool solves_ = false;                                          // a solve is under way
  bool drafted_ = false;                                         // its draft has been taken
  bool was_late_ = false;                                        // the last one, so that the next one begins at once
  double advance_ = 0;                                           // of the clock of the motion, s
  double awaited_ = -1;  // the landing of a late foot, s of the motion; negative: none is late
  PredictiveCounts counts_;
  size_t next_place_ = 0;                  // its place in the counts
  std::unique_ptr<SolvingThread> thread_;  // last: it ends first
};

double PredictiveCounts::calcQuantile(double share, double PredictiveSolve::*value) const {
  std::vector<double> values;
  for (const PredictiveSolve& solve : last)
    if (solve.*value >= 0) values.push_back(solve.*value);
  return bielle::calcQuantile(std::move(values), share);
}

PredictiveController::PredictiveController(const Motion& motion, const ShootingTrajectory& plan,
                                           const PredictiveOptions& options)
    : loop_(std::make_unique<Loop>(makeMotionHorizon(motion, plan, options), options)) {}
PredictiveController::PredictiveController(CommandedWalk walk, const PredictiveOptions& options)
    : loop_(std::make_unique<Loop>(makeWalkHorizon(std::move(walk), options), options)) {}
PredictiveController::~PredictiveController() = default;

void PredictiveController::update(const Measurement& measurement, VectorRef u) { loop_->update(measurement, u); }
double PredictiveController::getPlanTime(double time) const { return loop_->getPlanTime(time); }
const std::vector<PredictedFoothold>& PredictiveController::footholds() const { return loop_->footholds(); }
const PredictiveCounts& PredictiveController::counts() const { return loop_->counts(); }
const Policy& PredictiveController::policy() const { return loop_->policy(); }
void PredictiveController::waitForSolve() const { loop_->waitForSolve(); }

}  // namespace bielle
