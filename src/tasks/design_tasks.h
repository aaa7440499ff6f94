#pragma once
/// \file Evaluations of designs as tasks: each a run of `bielle design SPEC --evaluate FILE`.
///
/// A search asks for one design after the other, so that there are as many tasks at a time as searches; that for a front asks for
/// a whole generation, each of its designs by a thread of its own. Between tasks that end nothing is submitted until every
/// thread has said what it wants next: the engine then has all of it.
#include <condition_variable>
#include <exception>
#include <functional>
#include <map>
#include <mutex>
#include <thread>

#include "design/run.h"
#include "tasks/engine.h"

namespace bielle::tasks {

/// The request: the design, for a stage of a search, and the path of the robot where it is evaluated (empty: that of the
/// specification).
struct DesignRequest {
  SearchAlgorithm stage = SearchAlgorithm::Crs;
  VectorXd x;
  std::string robot;
};
std::string formatRequest(const DesignRequest& request);
/// \throws InputError naming the file
DesignRequest readRequest(const std::string& path);

struct DesignTaskOptions {
  std::string bielle;     ///< path of the command
  std::string directory;  ///< for files under way; removed in the end
  tasks::TaskEngine* engine = nullptr;
  std::function<void(const std::string&)> progress;  ///< told what is done once more
};

class DesignTasks : public DesignEvaluations {
 public:
  DesignTasks(const DesignSpec& spec, const DesignTaskOptions& options);
  ~DesignTasks() override;
  DesignTasks(const DesignTasks&) = delete;
  DesignTasks& operator=(const DesignTasks&) = delete;

  void enter(int threads) override;
  LoggedEvaluation evaluate(SearchAlgorithm stage, const VectorXd& x) override;
  void leave() override;

 private:
  struct Order {
    DesignRequest request;
    tasks::Task task;
    int slot = 0, attempt = 0;
    std::optional<LoggedEvaluation> result;
  };

  void work();
  void submit(Order& order);
  void finish(Order& order, int status);

  const DesignSpec& spec_;
  const DesignTaskOptions options_;
  std::vector<std::string> robots_;
  std::string robot_;

  std::mutex mutex_;
  std::condition_variable changed_;
  int thinking_ = 0;               // threads that have not said what they want next
  int next_slot_ = 0;              // of the directories of tasks
  std::vector<Order*> waiting_;    // of the threads, which sleep until they have results
  std::map<int, Order*> running_;  // by the number of the task
  std::exception_ptr error_;
  bool closed_ = false;
  std::thread thread_;
};

}  // namespace bielle::tasks
