#pragma once
// Many runs of one motion, many at once where they are alike.
#include <functional>

#include "cli/simulate/arguments.h"

namespace bielle::worlds {

// The runs of a file (--runs). A run that is refused does not keep others from being done.
// \param alone  carries one out and returns its exit status, where it cannot share a batch
// \returns an exit status: 0, or 1 if it was interrupted   \throws InputError naming the line that cannot be read
int simulateTogether(const std::string& file, const std::vector<std::string>& command,
                     const std::function<int(SimulateArguments, const std::vector<std::string>&)>& alone);

}  // namespace bielle::worlds
