#pragma once
// The command `bielle` is several programs: a small core, and companions beside it (formats/companion.h) that hold the other
// commands. Whichever was started becomes the one that has the command. One that misses a part of the library
// (model/missing_part.h) becomes its complete program, which has the same command with everything.
#include <vector>

#include "cli/commands.h"

namespace bielle::cli {

// A command that this program has. `add` declares its arguments and sets the action.
struct OwnCommand {
  const char* name;
  void (*add)(CLI::App& command, Action& action);
};

// The main function of all programs. Returns the exit status.
int runProgram(int argc, char** argv, const std::vector<OwnCommand>& commands);

}  // namespace bielle::cli
