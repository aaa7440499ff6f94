#include "loops/trial.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "loops/process_world.h"
#include "loops/processor_clock.h"

namespace bielle::loops {
namespace {

constexpr int kLooks = 20;         // at the state, besides the times of the problem
constexpr double kRefining = 2.5;  // about what the next finer setting costs

// In increasing order, with the end.
std::set<double> listLooks(const Problem& problem, double duration) {
  std::set<double> times;
  for (int i = 1; i <= kLooks; ++i) times.insert(duration * i / kLooks);
  for (const double time : problem.times)
    if (time <= duration) times.insert(time);
  // Equal but for rounding.
  for (auto next = times.begin(); next != times.end();) {
    const double time = *next++;
    if (next != times.end() && *next - time < 1e-9 * duration) times.erase(time);
  }
  return times;
}

}  // namespace

double calcError(const Problem& problem, const VectorXd& q, const VectorXd& v, const Motion& truth) {
  const VectorXd error = problem.calcOutputs(q, v) - problem.calcOutputs(truth.q, truth.v);
  return error.head(problem.judged).cwiseAbs().maxCoeff();
}

namespace {

void run(const Problem& problem, const Engine& engine, const TrialOptions& options, Trial& trial) {
  const double duration = options.duration > 0 ? std::min(options.duration, problem.duration) : problem.duration;
  const auto world = engine.make(problem.model, trial.setting);
  world->reset(problem.start.q, problem.start.v);
  if (problem.torques.size() > 0) world->setTorques(problem.torques);
  const auto* apart = dynamic_cast<const ProcessWorld*>(world.get());
  const double at_start = problem.calcInvariant(problem.start.q, problem.start.v);
  for (const double time : listLooks(problem, duration)) {
    const double before = readProcessorClock();
    const bool is_good = world->advance(time - world->time());
    trial.cpu = apart ? apart->cpu() : trial.cpu + readProcessorClock() - before;
    trial.until = world->time();
    if (!is_good) {
      trial.end = world->message();
      break;
    }
    const VectorXd &q = world->configuration(), &v = world->velocity();
    trial.gap = std::max(trial.gap, world->gap());
    trial.drift = std::max(trial.drift, std::abs(problem.calcInvariant(q, v) - at_start) / problem.invariant_scale);
    if (std::any_of(problem.times.begin(), problem.times.end(),
                    [&](double t) { return std::abs(t - time) < 1e-9 * duration; }))
      trial.errors.push_back(calcError(problem, q, v, problem.calcMotion(time)));
    if (trial.cpu > options.limit && time < duration) {
      trial.end = "the time was up";
      break;
    }
  }
}

}  // namespace

Trial runTrial(const Problem& problem, const Engine& engine, double setting, const TrialOptions& options) {
  Trial trial;
  trial.setting = engine.has_steps ? setting * problem.pace : setting;
  try {
    run(problem, engine, options, trial);
  } catch (const std::exception& error) {  // it refuses the mechanism
    trial.end = error.what();
  }
  return trial;
}

std::vector<Trial> runTrials(const Problem& problem, const Engine& engine, const TrialOptions& options) {
  std::vector<Trial> trials;
  for (const double setting : engine.settings) {
    trials.push_back(runTrial(problem, engine, setting, options));
    if (trials.back().cpu * kRefining > options.limit) break;
  }
  return trials;
}

}  // namespace bielle::loops
