#pragma once
// A thread that solves while control goes on.
#include <semaphore.h>

#include <atomic>
#include <thread>

#include "control/window_planner.h"

namespace bielle {

// Request and solution change hands without a lock: an atomic says whose they are. No call waits but waitUntilDone() and
// the destructor, and none allocates.
class SolvingThread {
 public:
  // All of them must outlive it.
  SolvingThread(WindowPlanner& planner, const WindowPlanner::Request& request, WindowPlanner::Solution& solution,
                WindowPlanner::Preview& preview);
  // Waits for the solve under way.
  ~SolvingThread();
  SolvingThread(const SolvingThread&) = delete;
  SolvingThread& operator=(const SolvingThread&) = delete;

  // Idle: request, draft and solution are the caller's, who may begin() a solve. Busy: they are the thread's. Drafted: the draft is the
  // caller's, and all may read the request. Done: all are the caller's again, who takes the solution and calls setIdle(); the thread
  // prepares the next solve, which may begin meanwhile.
  enum class State { Idle, Busy, Drafted, Done };
  State state() const { return state_.load(std::memory_order_acquire); }
  void begin();
  void setIdle() { state_.store(State::Idle, std::memory_order_relaxed); }
  void waitUntilDone() const;  // with all that it prepares

 private:
  void run();

  WindowPlanner& planner_;
  const WindowPlanner::Request& request_;
  WindowPlanner::Solution& solution_;
  WindowPlanner::Preview& preview_;
  std::atomic<State> state_{State::Idle};
  std::atomic<bool> ends_{false}, prepares_{false};
  sem_t begins_;
  std::thread thread_;  // last, when all it uses is there
};

}  // namespace bielle
