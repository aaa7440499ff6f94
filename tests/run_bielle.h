#pragma once
// The command of this build, run like a user does.
#include "run_command.h"

namespace bielle::testing {

inline CommandResult run(std::vector<std::string> arguments, const std::string& input = "") {
  arguments.insert(arguments.begin(), BIELLE_COMMAND);
  return runCommand(arguments, input);
}

}  // namespace bielle::testing
