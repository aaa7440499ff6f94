#include "design/front_run.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <exception>
#include <map>
#include <mutex>
#include <set>
#include <thread>

#include "bielle/results/result.h"
#include "design/evaluation_log.h"

namespace bielle {
namespace {

constexpr double kInfeasible = 1e6;   // beyond any objective: every feasible design dominates every infeasible one
constexpr double kSame = 1e-6;        // objectives that agree to this part of the start's are the same
constexpr size_t kMostAtATime = 256;  // designs under way, elsewhere

// Evaluations are known by stage and design, whatever their order in the log.
using Key = std::pair<std::string, std::vector<double>>;
Key makeKey(const std::string& stage, const VectorXd& x) { return {stage, {x.begin(), x.end()}}; }

class FrontRunner {
 public:
  FrontRunner(const DesignEvaluator& evaluator, const DesignSpec& spec, const DesignRunOptions& options)
      : evaluator_(evaluator), spec_(spec), options_(options) {
    makeOutputDirectory(options.directory);
    log_ = std::make_unique<EvaluationLog>(options.directory + "/front.jsonl", makeLogHeader(evaluator, spec, "front"),
                                           evaluator);
    for (LoggedEvaluation& e : log_->takeAll()) known_.emplace(makeKey(e.stage, e.x), std::move(e));
    run_.replayed = static_cast<int>(known_.size());
    run_.searches.resize(1);
  }

  DesignRun run() {
    const Parametrization& robot = evaluator_.robot();
    const FrontSpec& front = *spec_.front;
    std::vector<bool> whole;
    for (const DesignVariable& variable : robot.variables()) whole.push_back(variable.isChoice());
    std::vector<VectorXd> starts = listStarts(spec_, robot);
    starts.insert(starts.begin(), robot.start());
    searchFront({robot.lower(), robot.upper(), starts, static_cast<int>(evaluator_.objective().size()),
                 [this](const std::vector<VectorXd>& designs) { return evaluate(designs); }, whole},
                front.options, spec_.seed);
    selectDesigns();
    if (front.refine) {
      refine(*front.refine);
      selectDesigns();
    }
    addUpSearches(evaluator_, run_);
    return std::move(run_);
  }

 private:
  // Objectives relative to the start.
  std::vector<double> getObjectives(const LoggedEvaluation& e) const {
    const std::vector<double>& start = evaluator_.start().terms;
    if (e.status != DesignStatus::Feasible) return std::vector<double>(start.size(), kInfeasible + e.value);
    std::vector<double> out = e.measures;
    for (size_t i = 0; i < out.size(); ++i) out[i] /= start[i];
    return out;
  }

  // From the log, or made anew. Called by several threads.
  LoggedEvaluation get(SearchAlgorithm stage, const VectorXd& x) {
    const Key key = makeKey(getName(stage), x);
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (error_) throw std::runtime_error("another evaluation failed");
      if (const auto found = known_.find(key); found != known_.end()) return found->second;
    }
    const LoggedEvaluation e =
        options_.evaluations ? options_.evaluations->evaluate(stage, x) : evaluateDesign(evaluator_, stage, x);
    const std::lock_guard<std::mutex> lock(mutex_);
    if (known_.emplace(key, e).second) {
      log_->append(e);
      if (options_.progress && known_.size() % 20 == 0)
        options_.progress("front, " + e.stage + ", evaluation " + std::to_string(known_.size()));
    }
    return e;
  }

  // work(0) .. work(count - 1), several at a time.
  void doAll(size_t count, const std::function<void(size_t)>& work) {
    const size_t most = options_.evaluations ? kMostAtATime : static_cast<size_t>(std::max(1, options_.jobs));
    const size_t size = std::min(count, most);
    if (options_.evaluations) options_.evaluations->enter(static_cast<int>(size));
    std::atomic<size_t> next{0};
    std::vector<std::thread> threads;
    for (size_t t = 0; t < size; ++t)
      threads.emplace_back([&] {
        for (size_t i = next++; i < count; i = next++) {
          try {
            work(i);
          } catch (...) {
            const std::lock_guard<std::mutex> lock(mutex_);
            if (!error_) error_ = std::current_exception();
            next = count;
          }
        }
        if (options_.evaluations) options_.evaluations->leave();
      });
    for (std::thread& thread : threads) thread.join();
    if (error_) std::rethrow_exception(error_);
  }

  // Adds an evaluation to the run, once; in an order that does not depend on which was ready first.
  void add(const LoggedEvaluation& e) {
    if (added_.insert(makeKey(e.stage, e.x)).second) run_.searches[0].push_back(e);
  }

  std::vector<std::vector<double>> evaluate(const std::vector<VectorXd>& designs) {
    const SearchAlgorithm stage = spec_.front->options.algorithm;
    std::map<Key, size_t> different;  // children may equal their parents, and each other
    for (size_t i = 0; i < designs.size(); ++i) different.emplace(makeKey("", designs[i]), i);
    std::vector<size_t> first;
    for (const auto& [key, i] : different) first.push_back(i);
    std::sort(first.begin(), first.end());
    doAll(first.size(), [&](size_t i) { get(stage, designs[first[i]]); });
    std::vector<std::vector<double>> out;
    for (const VectorXd& x : designs) {
      const LoggedEvaluation e = get(stage, x);
      add(e);
      out.push_back(getObjectives(e));
    }
    return out;
  }

  void selectDesigns() {
    std::vector<const LoggedEvaluation*> designs;
    std::vector<std::vector<double>> objectives;
    std::set<std::vector<double>> different;  // refinements begin with known designs, and may end at the same one
    for (const LoggedEvaluation& e : run_.searches[0]) {
      if (e.status != DesignStatus::Feasible) continue;
      std::vector<double> rounded = getObjectives(e);
      for (double& objective : rounded) objective = std::round(objective / kSame) * kSame;
      if (!different.insert(rounded).second) continue;
      designs.push_back(&e);
      objectives.push_back(rounded);
    }
    run_.front.clear();
    for (size_t i : selectFront(objectives, static_cast<size_t>(spec_.front->options.population)))
      run_.front.push_back(
          {designs[i]->x, designs[i]->measures, designs[i]->goals, designs[i]->constraints, designs[i]->margin});
  }

  // From every point of the front: the least sum of all objectives of which none may become larger.
  void refine(const SearchStage& stage) {
    const std::vector<FrontDesign> front = run_.front;
    std::vector<std::vector<LoggedEvaluation>> found(front.size());
    doAll(front.size(), [&](size_t i) { found[i] = descend(front[i].x, stage); });
    for (const auto& search : found)
      for (const LoggedEvaluation& e : search) add(e);
  }

  std::vector<LoggedEvaluation> descend(const VectorXd& start, const SearchStage& stage) {
    std::vector<LoggedEvaluation> found;
    std::vector<double> bounds;
    const Parametrization& robot = evaluator_.robot();
    const Continuous continuous(robot, start);
    if (continuous.start().size() == 0) return found;
    SearchProblem problem{continuous.pick(robot.lower()), continuous.pick(robot.upper()), continuous.start(), {}, {}};
    problem.sloped = [&](const VectorXd& x, const SearchStage&) {
      found.push_back(get(stage.algorithm, continuous.expand(x)));
      const LoggedEvaluation& e = found.back();
      if (bounds.empty())
        for (const MeasurePieces& term : e.terms) bounds.push_back(term.values.maxCoeff());
      SlopedValue out = continuous.pick(e);
      for (size_t k = 0; k < out.terms.size() && k < bounds.size(); ++k)
        append({out.terms[k].values.array() - bounds[k], out.terms[k].gradients}, out.limits);
      return out;
    };
    minimizeByStages(problem, {stage}, spec_.seed);
    return found;
  }

  const DesignEvaluator& evaluator_;
  const DesignSpec& spec_;
  const DesignRunOptions& options_;
  std::unique_ptr<EvaluationLog> log_;
  std::map<Key, LoggedEvaluation> known_;
  std::set<Key> added_;
  DesignRun run_;
  std::mutex mutex_;
  std::exception_ptr error_;
};

}  // namespace

DesignRun runFront(const DesignEvaluator& evaluator, const DesignSpec& spec, const DesignRunOptions& options) {
  return FrontRunner(evaluator, spec, options).run();
}

}  // namespace bielle
