#pragma once
// Phases of free duration on the command line.
#include <CLI/CLI.hpp>

#include "bielle/motion/problem_options.h"

namespace bielle::cli {

struct TimingArguments {
  bool given = false;
  std::vector<std::string> phases;  // PHASE=LOWER:UPPER; none: all phases
  double time_weight = 0;
};

// --free-timings and --time-weight. \param arguments  must outlive the parser
void addTimingOptions(CLI::App& sub, TimingArguments& arguments);

// \throws InputError when the text of a phase makes no sense
TimingOptions makeTimings(const TimingArguments& arguments);

// A table of the chosen durations, unless there are none.
void printTimings(const std::vector<PhaseTiming>& timings);

}  // namespace bielle::cli
