#pragma once
// Phases of free duration on the command line.
#include <CLI/CLI.hpp>

#include "bielle/motion/timings.h"

namespace bielle::cli {

// --free-timings and --time-weight. \param timings  must outlive the parser
void addTimingOptions(CLI::App& sub, TimingOptions& timings);

// A table of the durations that came out, unless there are none.
void printTimings(const std::vector<PhaseTiming>& timings);

}  // namespace bielle::cli
