#pragma once
// What a motion minimizes, on the command line.
#include <CLI/CLI.hpp>

#include "bielle/motion/problem_options.h"
#include "bielle/results/result.h"

namespace bielle::cli {

// --objective, --regeneration and --regularization. \param options  must outlive the parser
void addObjectiveOptions(CLI::App& sub, ObjectiveOptions& options);

// E.g. "35.2 J, cost of transport 0.81 (assumed losses of 12 motors: 0.25 W/(N m)^2)".
std::string formatEnergy(const ElectricalEnergy& energy);

}  // namespace bielle::cli
