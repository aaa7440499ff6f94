#pragma once
// Exceptions cannot leave a parallel region by themselves.
#include <exception>
#include <mutex>

namespace bielle {

/// Keeps what the tasks of a parallel region throw, of several the exception of the task with the smallest index, so
/// that the same one comes out whatever the number of threads.
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
  /// Behind the region.
  void rethrow() const {
    if (error_) std::rethrow_exception(error_);
  }

 private:
  std::mutex mutex_;
  std::exception_ptr error_;
  int index_ = 0;
};

}  // namespace bielle
