#pragma once
// The commands of `bielle-paper`, one per file. Each adds itself to the parser and, if it is called, sets the action.
#include <CLI/CLI.hpp>
#include <functional>
#include <string>
#include <vector>

namespace bielle::paper {

using CommandLine = std::vector<std::string>;
// Returns the exit status: 0 done, 1 not converged or failed, 2 bad input.
using Action = std::function<int(const CommandLine&)>;

void addMotions(CLI::App& app, Action& action);
void addLift(CLI::App& app, Action& action);
void addStudy(CLI::App& app, Action& action);

}  // namespace bielle::paper
