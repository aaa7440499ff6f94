#include "cli/objective.h"

#include <cmath>

#include "cli/table.h"
#include "results/number_option.h"

namespace bielle::cli {

void addObjectiveOptions(CLI::App& sub, ObjectiveOptions& options) {
  const std::vector<Objective> objectives = {Objective::Effort, Objective::Energy, Objective::PeakTorque};
  std::vector<std::string> names;
  for (Objective objective : objectives) names.push_back(getName(objective));
  sub.add_option_function<std::string>(
         "--objective",
         [&options, objectives](const std::string& name) {
           for (Objective objective : objectives)
             if (name == getName(objective)) options.objective = objective;
         },
         "effort: weighted squares; energy: electrical energy of the motors; peak-torque: largest ratio of a torque to "
         "its limit. The last two start from the motion of least effort")
      ->check(CLI::IsMember(names))
      ->default_str(getName(options.objective));
  sub.add_option("--regeneration", options.regeneration,
                 "share of the regenerated electrical energy that is reused [1]")
      ->check(isWithin(0, 1))
      ->capture_default_str();
  sub.add_option("--regularization", options.regularization, "share of the other costs that is kept; default: 0.2 [1]")
      ->check(isPositive());
}

std::string formatEnergy(const ElectricalEnergy& energy) {
  std::string text = formatNumber(energy.total, "%.2f") + " J";
  if (std::isfinite(energy.cost_of_transport))
    text += ", cost of transport " + formatNumber(energy.cost_of_transport, "%.3f");
  if (energy.num_assumed > 0)
    text += " (losses of " + std::to_string(energy.num_assumed) +
            " motors assumed: " + formatNumber(kDefaultTorqueLoss) + " W/(N m)^2)";
  return text;
}

}  // namespace bielle::cli
