#include "tasks/design_tasks.h"

#include <filesystem>
#include <stdexcept>

#include "bielle/results/result.h"
#include "design/spec_parts.h"
#include "formats/text_file.h"
#include "results/json_text.h"
#include "tasks/cases.h"
#include "tasks/shipping.h"

namespace fs = std::filesystem;

namespace bielle::tasks {
namespace {

constexpr std::size_t kLongestAnswer = 64'000'000;
constexpr const char *kRequest = "request.json", *kResult = "evaluation.json";

// What a worker returned, for this request. \throws std::exception saying what is wrong
LoggedEvaluation readResult(const tasks::Task& task, const DesignRequest& request, size_t terms, size_t constraints,
                            int status) {
  const std::string log = tasks::getOutput(task, task.log);
  if (status != 0) throw std::runtime_error("it ended with status " + std::to_string(status) + describeLog(log));
  const LoggedEvaluation e = readEvaluation(tasks::readOutput(tasks::getOutput(task, kResult), kLongestAnswer));
  const auto demand = [](bool holds, const std::string& what) {
    if (!holds) throw std::runtime_error("it returned an invalid result: " + what);
  };
  const std::string flaw = findFlaw(e, static_cast<size_t>(request.x.size()), terms, constraints);
  demand(flaw.empty(), flaw);
  demand(e.stage == getName(request.stage) && e.x == request.x, "it belongs to another design");
  demand(e.terms.empty() || needsGradient(request.stage), "its terms are not the requested ones");
  demand(!e.terms.empty() || !needsGradient(request.stage) || e.status != DesignStatus::Feasible, "it lacks gradients");
  return e;
}

}  // namespace

std::string formatRequest(const DesignRequest& request) {
  return Json{{"stage", getName(request.stage)},
              {"x", std::vector<double>(request.x.begin(), request.x.end())},
              {"robot", request.robot}}
             .dump() +
         "\n";
}

DesignRequest readRequest(const std::string& path) {
  DesignRequest request;
  readJsonFile(path, "give a stage and a design, e.g. {\"stage\": \"crs\", \"x\": [0.05]}",
               [&request](const Json& json) {
                 const std::vector<double> x = json.at("x");
                 request.x = VectorXd::Map(x.data(), static_cast<Eigen::Index>(x.size()));
                 request.robot = json.value("robot", "");
                 const std::string stage = json.at("stage");
                 for (const SearchAlgorithm known :
                      {SearchAlgorithm::Crs, SearchAlgorithm::Isres, SearchAlgorithm::Bobyqa, SearchAlgorithm::Sbplx,
                       SearchAlgorithm::Slsqp, SearchAlgorithm::Mma, SearchAlgorithm::Nsga2, SearchAlgorithm::Moead})
                   if (stage == getName(known)) {
                     request.stage = known;
                     return;
                   }
                 throw std::runtime_error("there is no stage '" + stage + "'");
               });
  return request;
}

DesignTasks::DesignTasks(const DesignSpec& spec, const DesignTaskOptions& options) : spec_(spec), options_(options) {
  if (spec.robot.generator.empty()) {
    const std::string robot = locateRobot(spec.robot, spec.path);
    robots_ = listRobotDirectories(robot);
    robot_ = getShippedRobot(robot);
  }
  thread_ = std::thread([this] { work(); });
}

DesignTasks::~DesignTasks() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    closed_ = true;
  }
  changed_.notify_all();
  thread_.join();
  std::error_code ignored;
  fs::remove_all(options_.directory, ignored);
}

void DesignTasks::enter(int threads) {
  const std::lock_guard<std::mutex> lock(mutex_);
  thinking_ += threads;
}

LoggedEvaluation DesignTasks::evaluate(SearchAlgorithm stage, const VectorXd& x) {
  Order order;
  order.request = {stage, x, robot_};
  std::unique_lock<std::mutex> lock(mutex_);
  waiting_.push_back(&order);
  --thinking_;
  changed_.notify_all();
  changed_.wait(lock, [&] { return order.result || error_; });
  if (!order.result) std::rethrow_exception(error_);
  return *order.result;
}

void DesignTasks::leave() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    --thinking_;
  }
  changed_.notify_all();
}

void DesignTasks::work() {
  try {
    while (true) {
      {
        std::unique_lock<std::mutex> lock(mutex_);
        changed_.wait(lock, [this] { return closed_ || (thinking_ == 0 && (!waiting_.empty() || !running_.empty())); });
        if (closed_) break;
        for (Order* order : waiting_) submit(*order);
        waiting_.clear();
      }
      const std::optional<tasks::TaskEnd> end = options_.engine->wait();
      if (!end) throw std::runtime_error("interrupted; run the same command again to continue");
      const std::lock_guard<std::mutex> lock(mutex_);
      if (const auto found = running_.find(end->id); found != running_.end()) {
        Order& order = *found->second;
        running_.erase(found);
        finish(order, end->status);
      }
      changed_.notify_all();
    }
  } catch (...) {
    const std::lock_guard<std::mutex> lock(mutex_);
    error_ = std::current_exception();
    changed_.notify_all();
  }
  if (!running_.empty()) options_.engine->stop();
}

void DesignTasks::submit(Order& order) {
  if (order.attempt++ == 0) order.slot = next_slot_++;
  tasks::Task& task = order.task;
  task.directory = options_.directory + "/" + std::to_string(order.slot);
  makeOutputDirectory(task.directory);
  for (const char* name : {kResult, kRequest}) fs::remove(tasks::getOutput(task, name));
  writeTextFile(tasks::getOutput(task, kRequest), formatRequest(order.request));
  task.programs = {options_.bielle};
  task.arguments = {
      "design", "@spec.yaml", "--evaluate", std::string("@") + kRequest, "-o", std::string("@") + kResult};
  task.inputs = {{"spec.yaml", spec_.path}, {kRequest, tasks::getOutput(task, kRequest)}};
  task.robots = robots_;
  task.outputs = {kResult};
  running_.emplace(options_.engine->submit(task), &order);
}

void DesignTasks::finish(Order& order, int status) {
  try {
    order.result = readResult(order.task, order.request, spec_.objective.size(), spec_.constraints.size(), status);
    ++thinking_;  // the thread that sleeps
    std::error_code ignored;
    fs::remove_all(order.task.directory, ignored);
  } catch (const std::exception& error) {
    const std::string text = "a task failed: " + describeJsonError(error);
    if (order.attempt >= options_.engine->attempts())
      throw std::runtime_error(text + "; run the same command again to continue");
    options_.progress(text + "; retrying");
    submit(order);
  }
}

}  // namespace bielle::tasks
