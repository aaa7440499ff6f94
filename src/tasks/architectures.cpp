#include "tasks/architectures.h"

#include <algorithm>
#include <cmath>

#include "bielle/formats/robot_writer.h"
#include "bielle/model/error.h"
#include "bielle/robots/robot_loader.h"
#include "design/draft.h"
#include "design/spec_parts.h"
#include "formats/text_file.h"
#include "model/listing.h"
#include "model/number_text.h"
#include "results/output_place.h"
#include "robots/generator_entry.h"

namespace bielle::tasks {
namespace {

using Entry = YamlEntry;
using Fields = YamlFields;

const YamlKeys kComparisonKeys("comparison", "", {"robots", "mass", "motions", "speeds", "groups", "drives"});
const YamlKeys kContenderKeys("comparison", "robots.NAME", {"robot", "generator", "set"});
const YamlKeys kSpeedKeys("comparison", "speeds", {"motion", "option", "from", "to", "step", "set"});
const YamlKeys kComparedDriveKeys("comparison", "drives", {"motor_constant", "regeneration"});

std::string formatValue(double value) { return formatNumber(value, "%.12g"); }

std::vector<Architecture> readRobots(const Entry& entry) {
  std::vector<Architecture> robots;
  for (const auto& [name, item] : entry.getMap()) {
    const Fields fields = item.getFields(kContenderKeys);
    if (name.empty() || name[0] == '.' || name.find('/') != std::string::npos)
      item.fail("'" + name + "' cannot be the name of a directory", "use a plain word");
    robots.push_back({name, readRobotSpec(fields, item)});
    if (const Entry* set = find(fields, "set")) requireUsed(robots.back().robot.generator, *set);
  }
  if (robots.empty()) entry.fail("there are none", "name at least one");
  return robots;
}

void readSpeeds(const Entry& entry, ArchitectureSpec& spec) {
  const Fields fields = entry.getFields(kSpeedKeys);
  const auto getNumber = [&](const char* key) { return require(fields, key, entry).getNumber(); };
  const double from = getNumber("from"), to = getNumber("to"), step = getNumber("step");
  if (!(from <= to && step > 0 && (to - from) / step < 1000))
    entry.fail("its steps do not lead from the first to the last value",
               "give from <= to, step > 0 and less than 1000 steps");
  const Entry *motion = find(fields, "motion"), *option = find(fields, "option"), *set = find(fields, "set");
  const MotionEntry& known = motion ? findMotionOf(*motion) : findMotion(spec.path, "walk");
  OptionSet options = known.request.options;
  const std::string varied = option ? option->getText() : "speed";
  setOption(options, varied, option ? *option : entry, formatExact(from));
  setOption(options, varied, require(fields, "to", entry), formatExact(to));
  const OptionValues settings = set ? readSettings(*set, options) : OptionValues();
  for (int i = 0; from + i * step <= to + 1e-9 * step; ++i) {
    // The decimal number, not the sum of steps.
    const double value = std::round((from + i * step) * 1e9) / 1e9;
    MotionSpec one{known.name, {{varied, value}}};
    one.settings.insert(one.settings.end(), settings.begin(), settings.end());
    spec.speeds.push_back(one);
    spec.speed_values.push_back(value);
  }
}

void readRoot(const Entry& root, ArchitectureSpec& spec) {
  const Fields fields = root.getFields(kComparisonKeys);
  spec.robots = readRobots(require(fields, "robots", root));
  if (const Entry* mass = find(fields, "mass")) {
    spec.mass = mass->getNumber();
    if (!(spec.mass > 0)) mass->fail("it is not positive", "give kilograms");
  }
  const Entry& motions = require(fields, "motions", root);
  spec.motions = readMotionSpecs(motions);
  if (spec.motions.empty()) motions.fail("there are none", "name at least one");
  if (const Entry* speeds = find(fields, "speeds")) readSpeeds(*speeds, spec);
  if (const Entry* groups = find(fields, "groups"))
    for (const auto& [name, words] : groups->getMap()) spec.groups.push_back({name, words.getTexts(), words});
  spec.groups.push_back({"all", {}});
  if (const Entry* drives = find(fields, "drives")) {
    const Fields drive = drives->getFields(kComparedDriveKeys);
    if (const Entry* constant = find(drive, "motor_constant")) {
      spec.drives.motor_constant = constant->getNumber();
      if (!(*spec.drives.motor_constant > 0)) constant->fail("it is not positive", "give N m/sqrt(W)");
    }
    if (const Entry* share = find(drive, "regeneration")) {
      spec.drives.regeneration = share->getNumber();
      if (!(spec.drives.regeneration >= 0 && spec.drives.regeneration <= 1))
        share->fail("it is outside 0 .. 1", "give the share that is regenerated");
    }
  }
}

// Words that are in the name of no motor.
void checkGroups(const ArchitectureSpec& spec, const std::vector<Contender>& contenders) {
  std::vector<std::string> motors;
  for (const Contender& contender : contenders)
    for (const Motor& motor : contender.robot.model.motors())
      if (!contains(motors, motor.name)) motors.push_back(motor.name);
  for (const MotorGroup& group : spec.groups)
    for (const std::string& word : group.words)
      if (std::none_of(motors.begin(), motors.end(),
                       [&word](const std::string& motor) { return motor.find(word) != std::string::npos; }))
        group.entry->fail("no motor has '" + word + "' in its name", "the motors are " + listItems(motors));
}

// The factor of the trunk's mass that gives the required total mass.
double calcTrunkFactor(const ArchitectureSpec& spec, const std::string& name, const Model& model) {
  if (spec.mass == 0) return 1;
  if (!model.hasFreeFlyer())
    throw InputError(spec.path, "robot '" + name + "'", "it has no free trunk", "leave out `mass` or the robot");
  const double trunk = model.bodies()[1].inertia.mass, factor = 1 + (spec.mass - model.mass()) / trunk;
  if (!(factor > 0))
    throw InputError(spec.path, "robot '" + name + "'",
                     "its mass without the trunk is already " + formatValue(model.mass() - trunk) + " kg",
                     "give a larger `mass`");
  return factor;
}

}  // namespace

std::string makeName(const MotionSpec& motion) {
  std::string text = motion.motion;
  for (const auto& [option, value] : motion.settings) text += "-" + option + "-" + formatOption(value);
  return text;
}

ArchitectureSpec readArchitectureSpec(const std::string& path) {
  ArchitectureSpec spec;
  spec.path = path;
  spec.text = readTextFile(path, "give the path of a comparison");
  readYamlDocument(path, spec.text, [&](const Entry& root) { readRoot(root, spec); });
  return spec;
}

std::vector<Contender> makeContenders(const ArchitectureSpec& spec, const std::string& directory) {
  std::vector<Contender> contenders;
  for (const Architecture& architecture : spec.robots) {
    const Model model = makeRobot(architecture.robot, spec.path);
    Contender contender;
    contender.name = architecture.name;
    contender.directory = directory + "/" + architecture.name;
    contender.trunk_factor = calcTrunkFactor(spec, architecture.name, model);
    RobotDraft draft(model);
    if (contender.trunk_factor != 1) draft.scaleMass(model.bodies()[1].name, contender.trunk_factor);
    requireApart(contender.directory, {findRobotDirectory(architecture.robot, spec.path)});
    writeRobot(draft.build(), contender.directory, "Written by `bielle compare`.");
    contender.robot = loadRobot(contender.directory);
    contenders.push_back(std::move(contender));
  }
  checkGroups(spec, contenders);
  return contenders;
}

Case makeArchitectureCase(const Contender& contender, const MotionSpec& motion) {
  std::vector<std::string> solve = {"solve",     motion.motion, "--robot", contender.directory,
                                    "--threads", "1",           "--quiet", "--no-report"};
  for (const auto& [option, value] : motion.settings) {
    solve.push_back("--set");
    solve.push_back(option + "=" + formatOption(value));
  }
  solve.insert(solve.end(), {"-o", std::string("@") + kMotion});
  return {contender.name + "-" + makeName(motion), {solve}, contender.directory};
}

}  // namespace bielle::tasks
