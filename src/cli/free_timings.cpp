#include "cli/free_timings.h"

#include <iostream>

#include "bielle/motion/motion.h"
#include "cli/commands.h"
#include "cli/table.h"
#include "results/setting.h"

namespace bielle::cli {
namespace {

// PHASE=LOWER:UPPER
std::pair<std::string, TimingBounds> parseBounds(const std::string& text) {
  const size_t colon = text.rfind(':');
  const char* example = "left foot=0.8:1.2";
  requireOption(colon != std::string::npos, "free-timings", "'" + text + "' does not have two bounds",
                std::string("give PHASE=LOWER:UPPER, e.g. '") + example + "'");
  const auto [name, lower] = parseSetting("--free-timings", text.substr(0, colon), example);
  const double upper = parseSetting("--free-timings", name + "=" + text.substr(colon + 1), example).second;
  return {name, {lower, upper}};
}

}  // namespace

void addTimingOptions(CLI::App& sub, TimingArguments& arguments) {
  sub.add_option_function<std::vector<std::string>>(
         "--free-timings",
         [&arguments](const std::vector<std::string>& phases) {
           arguments.given = true;
           for (const std::string& phase : phases)
             if (!phase.empty()) arguments.phases.push_back(phase);
         },
         "let the solver choose the durations of phases; footholds and paths stay. PHASE=LOWER:UPPER bounds one phase "
         "[share of the nominal duration], `all` every phase with contacts; default: all=0.6:1.6")
      ->type_name("PHASE=LOWER:UPPER")
      ->expected(0, -1);
  sub.add_option("--time-weight", arguments.time_weight,
                 "cost per second of the phases whose duration is free; a larger one gives a faster rhythm [1/s]")
      ->capture_default_str();
}

TimingOptions makeTimings(const TimingArguments& arguments) {
  TimingOptions timings;
  timings.time_weight = arguments.time_weight;
  for (const std::string& phase : arguments.phases) timings.phases.push_back(parseBounds(phase));
  requireOnce("--free-timings", arguments.phases, "left foot=0.8:1.2");
  if (arguments.given && arguments.phases.empty()) timings.phases.push_back({kAllPhases, {}});
  return timings;
}

void printTimings(const std::vector<PhaseTiming>& timings) {
  if (timings.empty()) return;
  std::cout << "chosen durations:\n";
  std::vector<Row> rows;
  const auto format = [](double seconds) { return formatNumber(seconds, "%.3f"); };
  for (const PhaseTiming& timing : timings)
    rows.push_back(
        {timing.phase, format(timing.chosen) + " s",
         "nominal " + format(timing.nominal) + ", within " + format(timing.lower) + " .. " + format(timing.upper)});
  printTable(std::cout, rows);
}

}  // namespace bielle::cli
