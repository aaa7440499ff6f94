#include "design/run.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <ctime>
#include <exception>
#include <memory>
#include <mutex>
#include <thread>

#include "bielle/results/result.h"
#include "design/evaluation_log.h"
#include "design/front_run.h"
#include "design/marks.h"
#include "model/number_text.h"
#include "results/json_text.h"

namespace bielle {
namespace {

double getThreadSeconds() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

class DesignRunner {
 public:
  DesignRunner(const DesignEvaluator& evaluator, const DesignSpec& spec, const DesignRunOptions& options)
      : evaluator_(evaluator), spec_(spec), options_(options) {
    makeOutputDirectory(options.directory);
    starts_ = listStarts(spec, evaluator.robot());
    if (starts_.empty())
      for (const VectorXd& combination : evaluator.robot().listCombinations())
        starts_.insert(starts_.end(), static_cast<size_t>(spec.searches), combination);
    for (size_t i = 0; i < starts_.size(); ++i)
      logs_.push_back(std::make_unique<EvaluationLog>(options.directory + "/search" + std::to_string(i + 1) + ".jsonl",
                                                      makeLogHeader(evaluator, spec, std::to_string(i + 1)),
                                                      evaluator));
    run_.searches.resize(logs_.size());
    const Evaluation& start = evaluator.start();
    best_shown_ = start.status == DesignStatus::Feasible ? start.value : HUGE_VAL;
  }

  DesignRun run() {
    std::vector<std::thread> threads;
    const int searches = static_cast<int>(starts_.size());
    const int jobs = options_.evaluations ? searches : std::min(options_.jobs, searches);
    if (options_.evaluations) options_.evaluations->enter(jobs);
    for (int i = 0; i < jobs; ++i) threads.emplace_back([this] { work(); });
    for (std::thread& thread : threads) thread.join();
    if (error_) std::rethrow_exception(error_);
    addUpSearches(evaluator_, run_);
    return std::move(run_);
  }

 private:
  void work() {
    for (size_t i = next_++; i < logs_.size(); i = next_++) {
      try {
        search(i);
      } catch (...) {
        const std::lock_guard<std::mutex> lock(mutex_);
        if (!error_) error_ = std::current_exception();
        next_ = logs_.size();
        stop_ = true;
      }
      if (options_.evaluations) options_.evaluations->leave();
    }
  }

  void search(size_t i) {
    const Parametrization& robot = evaluator_.robot();
    const Continuous continuous(robot, starts_[i]);
    if (continuous.start().size() == 0) {
      evaluate(i, starts_[i], spec_.stages.front());
      return;
    }
    const auto objective = [&](const VectorXd& x, const SearchStage& stage) {
      return evaluate(i, continuous.expand(x), stage).value;
    };
    const auto sloped = [&](const VectorXd& x, const SearchStage& stage) {
      return continuous.pick(evaluate(i, continuous.expand(x), stage));
    };
    const SearchResult result = minimizeByStages(
        {continuous.pick(robot.lower()), continuous.pick(robot.upper()), continuous.start(), objective, sloped},
        spec_.stages, spec_.seed + static_cast<unsigned>(i));
    if (!options_.progress) return;
    const std::lock_guard<std::mutex> lock(mutex_);
    for (const StageEnd& end : result.ends)
      options_.progress("search " + std::to_string(i + 1) + ": " + getName(end.algorithm) + " ended after " +
                        std::to_string(end.evaluations) + " evaluation(s): " + end.reason);
  }

  LoggedEvaluation evaluate(size_t i, const VectorXd& x, const SearchStage& stage) {
    if (stop_) throw std::runtime_error("another search failed");
    std::optional<LoggedEvaluation> found = logs_[i]->replay(getName(stage.algorithm), x);
    const bool replayed = found.has_value();
    if (!replayed) {
      found = options_.evaluations ? options_.evaluations->evaluate(stage.algorithm, x)
                                   : evaluateDesign(evaluator_, stage.algorithm, x);
      logs_[i]->append(*found);
    }
    const std::lock_guard<std::mutex> lock(mutex_);
    run_.searches[i].push_back(*found);
    run_.replayed += replayed;
    report(i, *found, replayed);
    return *found;
  }

  // A line for every new best design, and from time to time.
  void report(size_t i, const LoggedEvaluation& e, bool replayed) {
    const bool better = e.status == DesignStatus::Feasible && e.value < best_shown_;
    if (better) best_shown_ = e.value;
    const size_t count = run_.searches[i].size();
    if (!options_.progress || replayed || !(better || count % 20 == 0)) return;
    options_.progress("search " + std::to_string(i + 1) + ", " + e.stage + ", evaluation " + std::to_string(count) +
                      ": " + formatNumber(e.value, "%.4f") + " (" + getName(e.status) + "), best of all " +
                      formatNumber(best_shown_, "%.4f") + formatMarks(e.margin, e.marks));
  }

  const DesignEvaluator& evaluator_;
  const DesignSpec& spec_;
  const DesignRunOptions& options_;
  std::vector<VectorXd> starts_;  // of the searches
  std::vector<std::unique_ptr<EvaluationLog>> logs_;
  DesignRun run_;
  double best_shown_ = 0;
  std::atomic<size_t> next_{0};
  std::atomic<bool> stop_{false};
  std::mutex mutex_;
  std::exception_ptr error_;
};

}  // namespace

Continuous::Continuous(const Parametrization& robot, const VectorXd& x) : x_(x), indices_(robot.listContinuous()) {}

VectorXd Continuous::expand(const VectorXd& of_search) const {
  VectorXd x = x_;
  x(indices_) = of_search;
  return x;
}

SlopedValue Continuous::pick(const LoggedEvaluation& e) const {
  const auto pick_pieces = [&](const MeasurePieces& pieces) {
    return MeasurePieces{pieces.values, pieces.gradients(Eigen::all, indices_)};
  };
  SlopedValue out{e.value, {}, {}};
  for (const MeasurePieces& term : e.terms) out.terms.push_back(pick_pieces(term));
  if (e.limits.values.size() > 0) out.limits = pick_pieces(e.limits);
  return out;
}

std::string makeLogHeader(const DesignEvaluator& evaluator, const DesignSpec& spec, const std::string& search) {
  const VectorXd& start = evaluator.robot().start();
  const Json json = {{"bielle", getBuildInfo().bielle},
                     {"search", search},
                     {"spec", spec.text},
                     {"start", std::vector<double>(start.begin(), start.end())},
                     {"measures", evaluator.start().terms}};
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

void addUpSearches(const DesignEvaluator& evaluator, DesignRun& run) {
  run.best = evaluator.robot().start();
  const Evaluation& start = evaluator.start();
  run.value = start.status == DesignStatus::Feasible ? start.value : HUGE_VAL;
  for (const auto& search : run.searches)
    for (const LoggedEvaluation& e : search) {
      ++run.counts[static_cast<size_t>(e.status)];
      run.seconds += e.seconds;
      if (e.status == DesignStatus::Feasible && e.value < run.value) run.value = e.value, run.best = e.x;
    }
  if (run.value == HUGE_VAL) run.value = start.value;
  run.evaluation = evaluator.evaluate(run.best);
}

namespace {

// Logs have no infinity: that of a distance without shapes.
std::vector<double> listFinite(std::vector<double> values) {
  for (double& value : values) value = std::clamp(value, -1e300, 1e300);
  return values;
}

}  // namespace

LoggedEvaluation evaluateDesign(const DesignEvaluator& evaluator, SearchAlgorithm stage, const VectorXd& x) {
  const double begin = getThreadSeconds();
  const SlopedEvaluation sloped =
      needsGradient(stage) ? evaluator.differentiate(x) : SlopedEvaluation{evaluator.evaluate(x), {}, {}};
  const Evaluation& evaluation = sloped.evaluation;
  return {getName(stage),
          x,
          evaluation.status,
          evaluation.value,
          getThreadSeconds() - begin,
          sloped.terms,
          sloped.limits,
          evaluation.terms,
          listFinite(evaluation.constraints),
          isMeasured(evaluation.status) ? evaluation.goals : std::vector<DesignGoal>(),
          evaluation.message,
          evaluation.margin,
          listMarks(evaluator, x, evaluation.constraints)};
}

std::string findFlaw(const LoggedEvaluation& e, size_t variables, size_t objectives, size_t constraints) {
  const bool measured = isMeasured(e.status), feasible = e.status == DesignStatus::Feasible;
  const auto count = static_cast<Eigen::Index>(variables);
  const auto fits = [count](const MeasurePieces& pieces) {
    return pieces.values.size() > 0 && pieces.gradients.cols() == count;
  };
  const auto is_met = [](const DesignGoal& goal) { return goal.outcome.met(); };
  if (e.x.size() != count) return "it belongs to another design";
  if (e.seconds < 0) return "its time is negative";
  if (e.measures.size() != (measured ? objectives : 0) || e.constraints.size() != (measured ? constraints : 0))
    return "its measures are not the requested ones";
  if (feasible && !std::all_of(e.goals.begin(), e.goals.end(), is_met)) return "it is feasible and misses a goal";
  if (!e.terms.empty() && e.terms.size() != objectives) return "its terms are not the requested ones";
  if (!std::all_of(e.terms.begin(), e.terms.end(), fits) || (e.limits.values.size() > 0 && !fits(e.limits)))
    return "its gradients have the wrong size";
  return "";
}

DesignRun runDesign(const DesignEvaluator& evaluator, const DesignSpec& spec, const DesignRunOptions& options) {
  return spec.front ? runFront(evaluator, spec, options) : DesignRunner(evaluator, spec, options).run();
}

}  // namespace bielle
