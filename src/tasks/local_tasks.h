#pragma once
// Tasks as processes of this machine.
#include <deque>

#include "tasks/child.h"
#include "tasks/engine.h"

namespace bielle::tasks {

class LocalTasks : public TaskEngine {
 public:
  // At most `jobs` processes at a time, which the destructor ends. During its lifetime signals are watched (child.h).
  explicit LocalTasks(int jobs) : jobs_(jobs) {}
  ~LocalTasks() override { LocalTasks::stop(); }
  LocalTasks(const LocalTasks&) = delete;
  LocalTasks& operator=(const LocalTasks&) = delete;

  int width() const override { return jobs_; }
  bool hasRoom() const override { return static_cast<int>(running_.size()) < jobs_; }
  int submit(const Task& task) override;
  std::optional<TaskEnd> wait() override;
  void stop() override;
  int attempts() const override { return 1; }
  bool isRemote() const override { return false; }

 private:
  struct Running {
    int id;
    pid_t pid;
    double start;  // s
  };

  const int jobs_;
  SignalWatch watch_;
  int next_ = 0;
  std::vector<Running> running_;
  std::deque<TaskEnd> ended_;
};

}  // namespace bielle::tasks
