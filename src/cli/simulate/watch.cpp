#include "cli/simulate/watch.h"

#include <iostream>

#include "model/number_text.h"

namespace bielle::worlds {
namespace {

constexpr std::chrono::seconds kBetweenPages{2}, kBetweenLines{5};
constexpr int kShare = 10;     // of the time that is not spent on pages, over that which is
constexpr double kShown = 10;  // last part of the motion, s: a page costs the same however long the motion has lasted

}  // namespace

Watch::Watch(Show show) : show_(std::move(show)), next_page_(Clock::now()), next_line_(Clock::now() + kBetweenLines) {}

void Watch::show(const Execution& execution) {
  try {
    show_(execution);
  } catch (const std::exception& error) {
    if (!has_failed_)
      std::cerr << "bielle: warning: " << error.what() << "; the motion goes on, and its files are tried again"
                << std::endl;
    has_failed_ = true;
  }
}

void Watch::update(double time, double duration, const ExecutionSoFar& so_far) {
  const Clock::time_point now = Clock::now();
  if (now >= next_line_) {
    std::cerr << "bielle: " << formatNumber(time, "%.3g") << " of " << formatNumber(duration, "%.3g") << " s\n";
    next_line_ = now + kBetweenLines;
  }
  if (show_ && now >= next_page_) {
    show(so_far(time - kShown));
    const Clock::time_point end = Clock::now();
    next_page_ = end + std::max<Clock::duration>(kBetweenPages, kShare * (end - now));
  }
}

}  // namespace bielle::worlds
