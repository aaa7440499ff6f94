#include <algorithm>
#include <cmath>

#include "bielle/model/error.h"
#include "bielle/motion/commanded_walk.h"
#include "formats/text_file.h"
#include "formats/yaml_entry.h"
#include "math/constants.h"
#include "motion/locomotion_stages.h"

namespace bielle {
namespace {

const YamlKeys kCommandsKeys("commands", "", {"commands"});
const YamlKeys kCommandKeys("commands", "commands[]", {"time", "forward", "sideways", "turning"});

TimedCommand readCommand(const YamlEntry& entry) {
  const YamlFields fields = entry.getFields(kCommandKeys);
  const auto get = [&](const std::string& key) {
    const YamlEntry* number = find(fields, key);
    return number ? number->getNumber() : 0;
  };
  const double time = require(fields, "time", entry).getNumber();
  if (time < 0) find(fields, "time")->fail("it is negative", "give seconds since the start");
  return {time, {get("forward"), get("sideways"), get("turning")}};
}

}  // namespace

std::vector<TimedCommand> readCommands(const std::string& path) {
  std::vector<TimedCommand> commands;
  readYamlDocument(
      path, readTextFile(path, "give a YAML file with a list of commands"), [&](const YamlEntry& document) {
        const YamlFields fields = document.getFields(kCommandsKeys);
        const YamlEntry& list = require(fields, "commands", document);
        for (const YamlEntry& entry : list.getList()) {
          commands.push_back(readCommand(entry));
          if (commands.size() > 1 && commands.back().time <= (commands.end() - 2)->time)
            entry.fail("its time is not later than that of the previous entry", "list commands in order of time");
        }
        if (commands.empty())
          list.fail("it has no commands", "give one entry per velocity, e.g. {time: 0.5, forward: 0.4}");
      });
  return commands;
}

VelocityCommand findCommand(const std::vector<TimedCommand>& commands, double time) {
  const auto next = std::upper_bound(commands.begin(), commands.end(), time,
                                     [](double t, const TimedCommand& command) { return t < command.time; });
  return next == commands.begin() ? VelocityCommand() : (next - 1)->velocity;
}

double calcMeanSpeed(const std::vector<TimedCommand>& commands, double duration) {
  double way = 0;
  for (size_t i = 0; i < commands.size(); ++i) {
    const double end = i + 1 < commands.size() ? std::min(duration, commands[i + 1].time) : duration;
    const VelocityCommand& velocity = commands[i].velocity;
    way += std::max(0.0, end - commands[i].time) * std::hypot(velocity.forward, velocity.sideways);
  }
  return duration > 0 ? way / duration : 0;
}

void checkCommand(const Model& model, const StandingRobot& standing, const LocomotionOptions& options,
                  const VelocityCommand& command, const std::string& element) {
  constexpr int kSteps = 6;
  if (command.isRest()) return;
  const double T = options.timing.stepDuration();
  const StepCommand step{T * command.forward, T * command.sideways, T * command.turning};
  // Placements of feet do not tell a full turn from none.
  if (!(std::abs(step.yaw) <= kPi))
    throw InputError(model.name(), element, "it turns by more than half a turn in a step",
                     "give a lower rate of turning, e.g. 0.4 rad/s");
  const Stance stance = makeStance(model, options, standing);
  requireLevel(model, listSoles(stance), "walk by commands");
  for (const Side first : {Side::Left, Side::Right}) {
    LocomotionTask task;
    task.name = element;
    task.plan = planFootsteps(stance.feet[0], stance.feet[1], step, kSteps, first);
    task.ground.height = stance.feet[0].p.z();
    planLocomotion(model, stance, task, options);
  }
}

}  // namespace bielle
