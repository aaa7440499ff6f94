#pragma once
// What bielle-simulate prints and writes.
#include "cli/simulate/arguments.h"

namespace bielle::worlds {

void print(const SimulateArguments& arguments, const Plan& plan, const Execution& execution);

/// Writes the files of a motion that happened; returns their paths. \param ground  of the world
std::vector<std::string> write(const SimulateArguments& arguments, const Plan& plan, const Ground& ground,
                               const Execution& execution, const std::vector<std::string>& command);

}  // namespace bielle::worlds
