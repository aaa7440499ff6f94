#pragma once
#include <ctime>

namespace bielle::loops {

// Processor time of this program so far, s.
inline double readProcessorClock() {
  timespec time;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

}  // namespace bielle::loops
