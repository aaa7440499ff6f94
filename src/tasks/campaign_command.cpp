#include "tasks/campaign_command.h"

#include <cmath>
#include <set>

#include "bielle/model/error.h"
#include "bielle/results/result.h"
#include "model/number_text.h"
#include "tasks/cells.h"
#include "tasks/dry_run.h"

namespace bielle::tasks {
namespace {

using Kind = CampaignAxis::Kind;

const CampaignAxis* findAxis(const CampaignSpec& spec, Kind kind) {
  for (const CampaignAxis& axis : spec.axes)
    if (axis.kind == kind) return &axis;
  return nullptr;
}

// The time at which the share behind the point of a phase has passed, s.
double calcPhaseTime(const CampaignAxis& axis, const std::string& value, const std::string& directory) {
  const double phase = parseNumber(value).value(), index = std::floor(phase);
  const MotionSummary summary = readSummary(directory);
  if (index < 0 || index >= static_cast<double>(summary.phases.size()))
    axis.entry.fail("the plan in " + directory + " has no phase " + formatExact(index),
                    "its phases are 0 to " + std::to_string(summary.phases.size() - 1));
  const MotionSummary::Phase& found = summary.phases[static_cast<size_t>(index)];
  const VectorXd time = readResultRecord(directory).time;
  const double start = time[found.start_node], end = time[found.start_node + found.nodes];
  return std::round(1e6 * (start + (phase - index) * (end - start))) / 1e6;
}

// Those of `bielle simulate`.
OptionEntries listOptions(const CampaignSpec& spec) {
  OptionEntries options;
  for (const CampaignAxis& axis : spec.axes)
    if (axis.kind == Kind::Option) options.emplace_back(axis.name, axis.entry);
  return options;
}

}  // namespace

std::string formatImpulse(const ImpulseSearch& search, int multiple) {
  return formatExact(std::round(1e9 * multiple * search.step) / 1e9);
}

CampaignCommands::CampaignCommands(const CampaignSpec& spec, const std::vector<std::string>& directories)
    : spec_(spec) {
  const CampaignAxis* phases = findAxis(spec, Kind::PushPhase);
  if (!phases) return;
  phase_times_.assign(spec.motions.size(), std::vector<std::string>(phases->values.size(), "0"));
  for (size_t motion = 0; motion < directories.size(); ++motion)
    for (size_t i = 0; i < phases->values.size(); ++i)
      phase_times_[motion][i] = formatExact(calcPhaseTime(*phases, phases->values[i], directories[motion]));
}

std::vector<std::string> CampaignCommands::make(const CampaignCell& cell, const std::string& impulse) const {
  std::vector<std::string> arguments;
  std::string push;
  const auto addToPush = [&push](const char* name, const std::string& value) {
    push += (push.empty() ? "" : ",") + std::string(name) + "=" + value;
  };
  for (size_t i = 0; i < spec_.axes.size(); ++i) {
    const CampaignAxis& axis = spec_.axes[i];
    const std::string& value = axis.values[cell[i]];
    switch (axis.kind) {
      case Kind::Motion:
        break;
      case Kind::Option:
        addOption(axis.name, value, arguments);
        break;
      case Kind::PushTime:
        addToPush("t", value);
        break;
      case Kind::PushPhase:
        addToPush("t", phase_times_[cell[0]][cell[i]]);
        break;
      case Kind::PushDirection:
        addToPush("direction", value);
        break;
      case Kind::PushDuration:
        addToPush("duration", value);
        break;
      case Kind::PushImpulse:
        addToPush("impulse", value);
        break;
    }
  }
  if (!impulse.empty()) addToPush("impulse", impulse);
  if (spec_.pushes) arguments.insert(arguments.end(), {"--push", push});
  return arguments;
}

bool checkCommands(const CampaignSpec& spec, const std::string& bielle, const std::string& simulate,
                   const std::string& log, std::set<std::string>& warnings) {
  for (const CampaignMotion& motion : spec.motions) {
    if (motion.solve.empty()) continue;
    std::vector<std::string> command = {bielle};
    command.insert(command.end(), motion.solve.begin(), motion.solve.end());
    command.insert(command.end(), {"-o", "none"});
    std::set<std::string> told;  // when it is solved
    const std::optional<std::string> complaint = findComplaint(command, log, told);
    if (!complaint) return false;
    if (!complaint->empty()) refuse("solve " + motion.solve[1], *complaint, motion.options, *motion.entry);
  }
  const CampaignCommands commands(spec, {});
  const std::string impulse = spec.search ? formatImpulse(*spec.search, 1) : "";
  std::set<std::vector<std::string>> tried;  // cells may differ in nothing that options are made of, as in the motion
  const auto check = [&](const CampaignCell& cell, const CampaignAxis& varied) {
    const std::vector<std::string> arguments = commands.make(cell, impulse);
    if (!tried.insert(arguments).second) return true;
    std::vector<std::string> command = {simulate, "motion", "-o", "none", "--summary-only"};
    command.insert(command.end(), arguments.begin(), arguments.end());
    const std::optional<std::string> complaint = findComplaint(command, log, warnings);
    if (complaint && !complaint->empty()) refuse("simulate", *complaint, listOptions(spec), varied.entry);
    return complaint.has_value();
  };
  const CampaignCell base(spec.axes.size(), 0);
  if (!check(base, spec.axes.back())) return false;
  for (size_t i = 0; i < spec.axes.size(); ++i)
    for (size_t value = 1; value < spec.axes[i].values.size(); ++value) {
      CampaignCell cell = base;
      cell[i] = value;
      if (!check(cell, spec.axes[i])) return false;
    }
  return true;
}

}  // namespace bielle::tasks
