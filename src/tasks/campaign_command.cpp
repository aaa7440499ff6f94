#include "tasks/campaign_command.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>
#include <set>

#include "bielle/model/error.h"
#include "bielle/model/names.h"
#include "bielle/results/result.h"
#include "bielle/robots/robot_loader.h"
#include "model/listing.h"
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

void requirePhase(const CampaignAxis& axis, double index, int count, const std::string& plan) {
  if (index < 0 || index >= count)
    axis.entry.fail(plan + " has no phase " + formatExact(index), "its phases are 0 to " + std::to_string(count - 1));
}

// The time at which the share behind the point of a phase has passed, s.
double calcPhaseTime(const CampaignAxis& axis, const std::string& value, const std::string& directory) {
  const double phase = parseNumber(value).value(), index = std::floor(phase);
  const MotionSummary summary = readSummary(directory);
  requirePhase(axis, index, static_cast<int>(summary.phases.size()), "the plan in " + directory);
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

SplitCommand splitCommand(const std::vector<std::string>& arguments) {
  static const std::set<std::string> kOwn = {"--push",  "--seed",  "--friction", "--mass-error",
                                             "--delay", "--noise", "--terrain"};
  SplitCommand out;
  bool is_own = false;
  for (const std::string& word : arguments) {
    if (word.rfind("--", 0) == 0) is_own = kOwn.count(word) > 0;
    (is_own ? out.own : out.shared).push_back(word);
  }
  return out;
}

bool goesTogether(const std::vector<std::string>& shared) {
  std::string control, world = "bielle";
  for (size_t i = 0; i < shared.size(); ++i) {
    if (shared[i] == "--real-time" || shared[i] == "--live") return false;
    if (i + 1 < shared.size() && shared[i] == "--control") control = shared[i + 1];
    if (i + 1 < shared.size() && shared[i] == "--world") world = shared[i + 1];
  }
  return (control == "gains" || control == "open") && world == "bielle";
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

namespace {

PlannedMotion readSolved(const std::string& directory) {
  const MotionRecord record = readResultRecord(directory);
  PlannedMotion length{{}, static_cast<int>(readSummary(directory).phases.size())};
  if (record.cycle.size() == 0 && record.time.size() > 0) length.end = record.time[record.time.size() - 1];
  return length;
}

// As calcPhaseTime() will find.
void checkPushPhases(const CampaignSpec& spec, const std::vector<PlannedMotion>& lengths) {
  const CampaignAxis* phases = findAxis(spec, Kind::PushPhase);
  for (size_t m = 0; phases && m < lengths.size(); ++m)
    for (const std::string& value : phases->values)
      if (const double index = std::floor(parseNumber(value).value_or(0)); lengths[m].phases > 0)
        requirePhase(*phases, index, lengths[m].phases, "motion " + spec.motions[m].name);
}

// Pushes that are not over when the simulation ends, which `bielle simulate` refuses, before any motion is solved for them.
void checkPushTimes(const CampaignSpec& spec, const std::vector<PlannedMotion>& lengths,
                    std::set<std::string>& warnings) {
  constexpr double kHold = 1, kPush = 0.1, kSlack = 1e-6;  // s, unless they are given (worlds/execution.h)
  const CampaignAxis* times = findAxis(spec, Kind::PushTime);
  if (!times || std::any_of(lengths.begin(), lengths.end(), [](const auto& length) { return !length.end; })) return;
  const auto getMost = [&](const CampaignAxis* axis, double otherwise, bool least) {
    double found = otherwise;
    for (size_t i = 0; axis && i < axis->values.size(); ++i) {
      const double value = parseNumber(axis->values[i]).value_or(otherwise);
      found = i == 0 ? value : least ? std::min(found, value) : std::max(found, value);
    }
    return found;
  };
  const auto findOption = [&](const char* name) {
    const auto it = std::find_if(spec.axes.begin(), spec.axes.end(), [name](const CampaignAxis& axis) {
      return axis.kind == Kind::Option && axis.name == name;
    });
    return it == spec.axes.end() ? nullptr : &*it;
  };
  const double shortest = getMost(findAxis(spec, Kind::PushDuration), kPush, true);
  const CampaignAxis *duration = findOption("duration"), *hold = findOption("hold");
  for (const std::string& value : times->values) {
    const double time = parseNumber(value).value_or(0), over = time + shortest;
    double longest = 0;
    for (size_t m = 0; m < lengths.size(); ++m) {
      const double end = duration ? getMost(duration, 0, false) : *lengths[m].end + getMost(hold, kHold, false);
      longest = std::max(longest, end);
      if (over > end + kSlack)
        warnings.insert("warning: motion " + spec.motions[m].name + ": a push at " + value + " s is over at " +
                        formatNumber(over) + " s, but its simulation ends at " + formatExact(end) +
                        " s; these runs are refused");
    }
    if (over > longest + kSlack)
      times->entry.fail("a push at " + value + " s is over at " + formatNumber(over) +
                            " s, but the simulations end at " + formatExact(longest) + " s",
                        "give an earlier time, or `options: {" +
                            (duration ? "duration: " + formatExact(std::ceil(over + kHold))
                                      : "hold: " + formatExact(std::ceil(over - longest + 2 * kHold))) +
                            "}`");
  }
}

// What carries out a motion has the joints, motors and contacts of the robot that it is planned for.
void checkRobots(const CampaignSpec& spec) {
  const auto listParts = [](const Model& model) {
    return std::vector{makeVelocityNames(model), getNames(model.motors()), getNames(model.contacts())};
  };
  for (const CampaignAxis& axis : spec.axes) {
    if (axis.kind != Kind::Option || axis.name != "robot") continue;
    for (const CampaignMotion& motion : spec.motions) {
      const LoadedRobot planned = motion.solve.empty() ? loadRobotOf(motion.directory) : loadRobot(motion.robot);
      for (const std::string& value : axis.values)
        if (listParts(loadRobot(value).model) != listParts(planned.model))
          axis.entry.fail(
              "'" + value + "' has other joints, motors or contacts than the robot of motion '" + motion.name + "'",
              "give a robot of the same, as another file of it");
    }
  }
}

// By which a dry run knows what options may name; "" of results that do not have it.
std::string findRobot(const CampaignMotion& motion) {
  if (!motion.solve.empty()) return motion.robot;
  const std::string robot = motion.directory + "/mechanism.urdf";
  return std::filesystem::exists(robot) ? robot : "";
}

// The part of a push that a complaint is about.
const CampaignAxis& findPushed(const CampaignSpec& spec, const std::string& complaint, const CampaignAxis& otherwise) {
  for (const auto& [kind, name] : {std::pair(Kind::PushTime, "time"), std::pair(Kind::PushDirection, "direction"),
                                   std::pair(Kind::PushDuration, "duration"), std::pair(Kind::PushImpulse, "impulse")})
    if (complaint.find(": its " + std::string(name)) != std::string::npos)
      if (const CampaignAxis* axis = findAxis(spec, kind)) return *axis;
  return otherwise;
}

}  // namespace

bool checkCommands(const CampaignSpec& spec, const std::string& bielle, const std::string& simulate,
                   const std::string& log, std::set<std::string>& warnings) {
  std::vector<PlannedMotion> lengths;
  for (const CampaignMotion& motion : spec.motions) {
    if (motion.solve.empty()) {
      lengths.push_back(readSolved(motion.directory));
      continue;
    }
    std::vector<std::string> command = {bielle};
    command.insert(command.end(), motion.solve.begin(), motion.solve.end());
    command.insert(command.end(), {"-o", "none"});
    std::set<std::string> told;  // when it is solved
    const std::optional<std::string> complaint = findComplaint(command, log, told);
    if (!complaint) return false;
    if (!complaint->empty()) refuse("solve " + motion.solve[1], *complaint, motion.options, *motion.entry);
    lengths.push_back(readPlannedMotion(log));
  }
  const CampaignCommands commands(spec, {});
  const std::string impulse = spec.search ? formatImpulse(*spec.search, 1) : "";
  std::set<std::pair<std::string, std::vector<std::string>>>
      tried;  // cells may differ in nothing else, as in the motion
  const auto check = [&](const CampaignCell& cell, const CampaignAxis& varied) {
    const std::vector<std::string> arguments = commands.make(cell, impulse);
    if (!tried.emplace(findRobot(spec.motions[cell[0]]), arguments).second) return true;
    std::vector<std::string> command = {simulate, "motion", "-o", "none", "--summary-only"};
    command.insert(command.end(), arguments.begin(), arguments.end());
    const std::string robot = findRobot(spec.motions[cell[0]]);
    if (!contains(arguments, std::string("--robot")) && !robot.empty())
      command.insert(command.end(), {"--robot", robot});
    const std::optional<std::string> complaint = findComplaint(command, log, warnings);
    if (complaint && !complaint->empty())
      refuse("simulate", *complaint, listOptions(spec), findPushed(spec, *complaint, varied).entry);
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
  checkRobots(spec);
  checkPushPhases(spec, lengths);
  checkPushTimes(spec, lengths, warnings);
  return true;
}

}  // namespace bielle::tasks
