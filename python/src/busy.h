#pragma once
/// \file Objects that one thread uses at a time. Not by a lock: a thread that waits for it with the interpreter's lock
/// in hand would stop the one that it waits for.
#include <atomic>
#include <stdexcept>
#include <string>

namespace bielle::python {

class BusyGuard {
 public:
  /// \throws RuntimeError if another thread uses the object
  BusyGuard(std::atomic<bool>& is_busy, const char* what) : is_busy_(is_busy) {
    if (is_busy.exchange(true)) throw std::runtime_error(std::string("another thread is using this ") + what);
  }
  ~BusyGuard() { is_busy_ = false; }
  BusyGuard(const BusyGuard&) = delete;

 private:
  std::atomic<bool>& is_busy_;
};

}  // namespace bielle::python
