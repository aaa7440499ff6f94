#include "control/solving_thread.h"

#include <chrono>

namespace bielle {

SolvingThread::SolvingThread(WindowPlanner& planner, const WindowPlanner::Request& request,
                             WindowPlanner::Solution& solution, WindowPlanner::Preview& preview)
    : planner_(planner), request_(request), solution_(solution), preview_(preview) {
  preview_.publish = [this] { state_.store(State::Drafted, std::memory_order_release); };
  sem_init(&begins_, 0, 0);
  thread_ = std::thread([this] { run(); });
}

SolvingThread::~SolvingThread() {
  ends_.store(true, std::memory_order_relaxed);
  sem_post(&begins_);
  thread_.join();
  sem_destroy(&begins_);
}

void SolvingThread::begin() {
  state_.store(State::Busy, std::memory_order_release);
  sem_post(&begins_);
}

void SolvingThread::waitUntilDone() const {
  while (state() == State::Busy || state() == State::Drafted || prepares_.load(std::memory_order_acquire))
    std::this_thread::sleep_for(std::chrono::microseconds(100));
}

void SolvingThread::run() {
  for (;;) {
    while (sem_wait(&begins_) != 0) {  // a signal
    }
    if (ends_.load(std::memory_order_relaxed)) return;
    planner_.solve(request_, solution_, &preview_);
    prepares_.store(true, std::memory_order_relaxed);
    state_.store(State::Done, std::memory_order_release);
    planner_.prepare();
    prepares_.store(false, std::memory_order_release);
  }
}

}  // namespace bielle
