#include "bielle/control/predictive_controller.h"

#include <chrono>
#include <utility>

#include "control/clock.h"
#include "control/dead_point_stop.h"
#include "control/solving_thread.h"
#include "math/quantile.h"

namespace bielle {
namespace {

using Clock = std::chrono::steady_clock;

constexpr size_t kSolves = 100000;  // that are kept

}  // namespace

// What happens at an instant of control.
class PredictiveController::Loop {
 public:
  Loop(std::unique_ptr<Horizon> horizon, const PredictiveOptions& options)
      : planner_(std::move(horizon), options),
        solution_(planner_.makeEmpty()),
        dead_point_stop_(planner_.model(), planner_.startPosture(), options.dead_point_stop) {
    const Model& model = planner_.model();
    WindowPlanner::Solution first = planner_.makeFirst();
    policy_ = std::make_unique<Policy>(model, std::move(first.stages), first.u_hold);
    footholds_ = std::move(first.footholds);
    request_.measurement.q = model.makeNeutral();
    request_.measurement.v.setZero(model.nv());
    request_.measurement.contacts.resize(model.contacts().size());
    request_.u.setZero(model.nu());
    counts_.last.reserve(kSolves);
    if (options.own_thread) thread_ = std::make_unique<SolvingThread>(planner_, request_, solution_);
  }

  void update(const Measurement& measurement, VectorRef u) {
    if (thread_ && thread_->state() == SolvingThread::State::Done) {
      receive();
      thread_->setIdle();
    }
    if (ready_ && measurement.actionTime() + kClockTolerance >= getStart(solution_.target)) {
      policy_->exchange(solution_.stages, solution_.u_hold);
      ready_ = false;
      counts_.last[newest_].latency = std::chrono::duration<double>(Clock::now() - measured_).count();
    }
    policy_->update(measurement, u);
    dead_point_stop_.add(measurement, u);
    const int before = stage_;
    while (measurement.time + kClockTolerance >= getStart(stage_ + 1)) ++stage_;  // an impact takes no time
    if (stage_ != before) {
      counts_.missed += waits_;
      ++counts_.stages;
      waits_ = true;
    }
    if (waits_ && !(thread_ && thread_->state() != SolvingThread::State::Idle)) solve(measurement, u);
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

  void solve(const Measurement& measurement, ConstVectorRef u) {
    const double begin = getStart(stage_), end = getStart(stage_ + 1);
    waits_ = false;
    request_.stage = stage_;
    const double passed = measurement.time - begin;
    request_.progress = passed > kClockTolerance ? std::min(passed / (end - begin), 1.0) : 0;
    request_.measurement = measurement;
    request_.u = u;
    requested_ = Clock::now();
    if (thread_) return thread_->begin();
    planner_.solve(request_, solution_);
    counts_.missed += solution_.took.seconds > end - begin - measurement.delay;
    receive();
  }

  void receive() {
    ready_ = solution_.solved;
    stage_ += solution_.skipped;
    advance_ = solution_.advance;
    awaited_ = solution_.awaited;
    if (solution_.solved) footholds_ = solution_.footholds;  // there is room for those of all contacts
    counts_.failed += !solution_.solved;
    counts_.early += solution_.early;
    counts_.late += solution_.late;
    measured_ = requested_;
    newest_ = static_cast<size_t>(counts_.solves) % kSolves;
    if (counts_.last.size() < kSolves)
      counts_.last.push_back(solution_.took);
    else
      counts_.last[newest_] = solution_.took;
    ++counts_.solves;
  }

  WindowPlanner planner_;
  WindowPlanner::Request request_;
  WindowPlanner::Solution solution_;  // that is not in force yet, or memory for the next one
  DeadPointStop dead_point_stop_;
  std::unique_ptr<Policy> policy_;
  std::vector<PredictedFoothold> footholds_;
  int stage_ = -1;       // the present one
  bool waits_ = false;   // it has no solve yet
  bool ready_ = false;   // the solution awaits the stage from which on it is in force
  double advance_ = 0;   // of the clock of the motion, s
  double awaited_ = -1;  // the landing of a late foot, s of the motion; negative: none is late
  PredictiveCounts counts_;
  size_t newest_ = 0;                       // the solution's place in the counts
  Clock::time_point requested_, measured_;  // when the measurements of request and solution were taken
  std::unique_ptr<SolvingThread> thread_;   // last: it ends first
};

double PredictiveCounts::calcQuantile(double share, double PredictiveSolve::*value) const {
  std::vector<double> values;
  for (const PredictiveSolve& solve : last)
    if (solve.*value >= 0) values.push_back(solve.*value);
  return bielle::calcQuantile(std::move(values), share);
}

PredictiveController::PredictiveController(Motion motion, const ShootingTrajectory& plan,
                                           const PredictiveOptions& options)
    : loop_(std::make_unique<Loop>(makeMotionHorizon(std::move(motion), plan, options), options)) {}
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
