#pragma once
// What a person sees of a motion while it is carried out.
#include <chrono>
#include <functional>

#include "worlds/execution.h"

namespace bielle::worlds {

// Long runs tell how far they are, on the standard error.
class Watch {
 public:
  // Writes the files of what has happened up to now.
  using Show = std::function<void(const Execution&)>;
  // \param show  called every other second, or less often where it takes longer than a tenth of the time; or empty. The motion
  //   goes on if it throws an exception, which is told once.
  explicit Watch(Show show);

  // An ExecutionObserver.
  void update(double time, double duration, const ExecutionSoFar& so_far);

 private:
  using Clock = std::chrono::steady_clock;
  void show(const Execution& execution);

  const Show show_;
  Clock::time_point next_page_, next_line_;
  bool has_failed_ = false;
};

}  // namespace bielle::worlds
