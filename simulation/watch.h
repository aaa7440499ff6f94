#pragma once
// What a person sees of a motion while it is carried out, and how he ends it.
#include <chrono>
#include <functional>

#include "simulation/execution.h"

namespace bielle::simulation {

// From its construction on the first SIGINT or SIGTERM ends the motion after the row under way, such that its files can be
// written; the second one has its usual effect. Long runs tell how far they are, on the standard error.
class Watch {
 public:
  // Writes the files of what has happened up to now.
  using Show = std::function<void(const Execution&)>;
  // \param show  called every other second, or less often where it takes longer than a tenth of the time; or empty
  explicit Watch(Show show);

  // An ExecutionObserver.
  bool update(double time, double duration, const ExecutionSoFar& so_far);

 private:
  using Clock = std::chrono::steady_clock;
  const Show show_;
  Clock::time_point next_page_, next_line_;
};

}  // namespace bielle::simulation
