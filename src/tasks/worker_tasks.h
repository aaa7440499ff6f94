#pragma once
/// \file Tasks for workers on any machine, by Work Queue (https://cctools.readthedocs.io), behind a program of its own.
///
/// Work Queue is under the GPL, so that it is linked by `bielle-workers` (workers/main.cpp) alone, which speaks with us
/// by lines of JSON over two pipes, one object each:
///     it says   {"port": 9123}                                                         once, when workers can join
///     we say    {"task": 1, "command": "...", "inputs": [["/here", "there"], ...], "outputs": [["there", "/here"], ...]}
///     we say    {"wait": true}                                         and nothing more until the answer has come:
///     it says   {"task": 1, "output": "0\n", "seconds": 1.5, "cores": 64}      it has ended; cores that have joined
/// Handing a task out costs milliseconds of both machines. Short tasks that read the same files therefore go in bundles, one
/// command line after the other, whose output is their exit statuses; as long as there are enough for all workers.
///
/// It opens the port that it is told and no other, and ends with us. Workers that are lost, it replaces by others by itself.
#include <deque>
#include <map>
#include <set>

#include "tasks/child.h"
#include "tasks/engine.h"

namespace bielle::tasks {

struct WorkerOptions {
  std::string program;   ///< path of `bielle-workers`
  int port = 0;          ///< 0: any that is free
  std::string password;  ///< file with the password that workers have to know; empty: none
};

class WorkerTasks : public TaskEngine {
 public:
  /// \throws InputError when there is no such program or port, or the password cannot be read
  explicit WorkerTasks(const WorkerOptions& options);
  ~WorkerTasks() override { WorkerTasks::stop(); }
  WorkerTasks(const WorkerTasks&) = delete;
  WorkerTasks& operator=(const WorkerTasks&) = delete;

  int port() const { return port_; }
  int width() const override { return cores_; }
  bool hasRoom() const override;
  int submit(const Task& task) override;
  std::optional<TaskEnd> wait() override;
  void stop() override;
  int attempts() const override { return 3; }
  bool isRemote() const override { return true; }

 private:
  struct Held {
    int id;
    Task task;
  };

  int bundleSize() const;
  void sendBundles();
  void send(const std::string& line);
  bool receive(std::string& line);  // false if the user asks for the end

  SignalWatch watch_;
  PipedChild companion_;
  std::string received_;  // not yet read
  int port_ = 0, next_ = 0;
  int cores_ = 256;         // as long as none has been counted
  double mean_ = 0;         // of the durations of tasks, the last ones above all, s; 0: not known
  std::set<int> running_;   // submitted and not returned by wait()
  std::vector<Held> held_;  // of them, those that have not been sent
  std::map<int, std::vector<int>> bundles_;
  std::deque<TaskEnd> ended_;
};

}  // namespace bielle::tasks
