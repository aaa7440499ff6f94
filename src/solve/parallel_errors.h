#pragma once
// Carries exceptions out of a parallel region, which they cannot leave by themselves.
#include <exception>
#include <mutex>

namespace bielle {

/// Keeps an exception thrown by a task of a parallel region: if several throw, that of the task with the smallest
/// index, so that it does not depend on the number of threads.
class ParallelErrors {
 public:
  template <class Task>
  void run(int index, const Task& task) {
    try {
      task();
    } catch (...) {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (error_ && index_ < index) return;
      error_ = std::current_exception();
      index_ = index;
    }
  }
  /// To be called after the region.
  void rethrow() const {
    if (error_) std::rethrow_exception(error_);
  }

 private:
  std::mutex mutex_;
  std::exception_ptr error_;
  int index_ = 0;
};

}  // namespace bielle
