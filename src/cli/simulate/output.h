#pragma once
// What bielle-simulate prints and writes.
#include "cli/simulate/arguments.h"
#include "results/result_files.h"

namespace bielle::worlds {

/// The summary of a result of what happened, without what tells how it was solved.
Json makeHappenedSummary(const MotionResult& result);
Json listBooks(const Execution& execution);
Json listPushes(const std::vector<Push>& pushes);

void print(const SimulateArguments& arguments, const Plan& plan, const Execution& execution);

/// Writes the files of a motion that happened; returns their paths. \param ground  of the world
std::vector<std::string> write(const SimulateArguments& arguments, const Plan& plan, const Ground& ground,
                               const Execution& execution, const std::vector<std::string>& command);

}  // namespace bielle::worlds
