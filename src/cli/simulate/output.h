#pragma once
// What bielle-simulate prints and writes.
#include "cli/simulate/arguments.h"
#include "results/happened_summary.h"
#include "results/result_files.h"

namespace bielle::worlds {

Json listBooks(const Execution& execution);
Json listPushes(const std::vector<Push>& pushes);
/// Integrator, steps [s] and tolerances of a world.
Json listIntegration(const Integration& integration);
/// To the user, on standard error.
void tell(const std::vector<std::string>& warnings);
/// Warns, on standard error and in `warnings`, if closures of a world opened by more than 1 mm.
void noteOpenLoops(const std::string& world, const Execution& execution, std::vector<std::string>& warnings);

/// What is told besides what happened: who asked for what.
struct CarriedOut {
  const SimulateArguments& arguments;
  const Plan& plan;
  const LoadedRobot& robot;                 // of the world, without random errors
  const std::vector<GoalOutcome>& planned;  // goals, measured on the plan
  const PlanController& controller;
  const Ground& ground;  // of the world
  const std::vector<std::string>& command;
  const std::vector<std::string>& warnings;
};

/// \param reason  of a choice of control other than the usual one, or empty
void print(const CarriedOut& carried, const std::string& reason, const Execution& execution);

/// Writes the files of a motion that happened; returns their paths.
std::vector<std::string> write(const CarriedOut& carried, const Execution& execution);

}  // namespace bielle::worlds
