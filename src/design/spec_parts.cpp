#include "design/spec_parts.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "bielle/model/error.h"
#include "bielle/robots/robot_loader.h"
#include "robots/generator_entry.h"

namespace fs = std::filesystem;

namespace bielle {
namespace {

const YamlKeys kMotionKeys("comparison", "motions[]", {"motion", "set"});
const YamlKeys kWeighedMotionKeys("design", "motions[]", {"motion", "set", "weight", "payload", "payload_at"});

}  // namespace

const MotionEntry& findMotionOf(const YamlEntry& entry) {
  try {
    return findMotion(entry.path(), entry.getText());
  } catch (const InputError& error) {
    entry.fail(error.problem() + " as '" + entry.getText() + "'", error.remedy());
  }
}

void setOption(OptionSet& options, const std::string& name, const YamlEntry& entry, const std::string& value) {
  try {
    options.set(name, parseOption(value));
  } catch (const InputError& error) {
    entry.fail(error.problem(), error.remedy());
  }
}

OptionValues readSettings(const YamlEntry& entry, OptionSet known) {
  OptionValues settings;
  for (const auto& [name, value] : entry.getMap()) {
    setOption(known, name, value, value.getText());
    settings.emplace_back(name, parseOption(value.getText()));
  }
  return settings;
}

RobotSpec readRobotSpec(const YamlFields& fields, const YamlEntry& map) {
  RobotSpec spec;
  if (const YamlEntry* robot = find(fields, "robot")) spec.name = robot->getText();
  if (const YamlEntry* generator = find(fields, "generator")) spec.generator = locateBeside(*generator);
  if (spec.name.empty() == spec.generator.empty())
    map.fail("it does not name exactly one robot or generator", "give one of `robot` and `generator`");
  if (const YamlEntry* set = find(fields, "set")) {
    if (spec.generator.empty()) set->fail("a given robot has no parameters", "remove it, or give a generator");
    for (const auto& [name, value] : set->getMap()) spec.settings.emplace_back(name, parseOption(locateBeside(value)));
    readGeneratorEntry(fields.at("generator"), set);  // checks them
  }
  return spec;
}

namespace {

void readShare(const YamlFields& fields, MotionSpec& motion) {
  const YamlEntry *weight = find(fields, "weight"), *payload = find(fields, "payload"),
                  *place = find(fields, "payload_at");
  if (weight) motion.weight = weight->getNumber();
  if (!(motion.weight >= 0)) weight->fail("it is negative", "give its share of the objectives, 0 or more");
  if (payload) motion.payload.mass = payload->getNumber();
  if (!(motion.payload.mass >= 0)) payload->fail("it is negative", "give the mass that the trunk carries in kg");
  if (place && !payload) place->fail("there is no payload", "give `payload` in kg, or remove it");
  if (place) motion.payload.at = place->getVector3();
}

}  // namespace

std::vector<MotionSpec> readMotionSpecs(const YamlEntry& entry, bool weighed) {
  std::vector<MotionSpec> motions;
  for (const YamlEntry& item : entry.getList()) {
    const YamlFields fields = item.getFields(weighed ? kWeighedMotionKeys : kMotionKeys);
    MotionSpec motion;
    const MotionEntry& known = findMotionOf(require(fields, "motion", item));
    motion.motion = known.name;
    if (const YamlEntry* set = find(fields, "set")) motion.settings = readSettings(*set, known.request.options);
    if (weighed) readShare(fields, motion);
    motions.push_back(motion);
  }
  const auto counts = [](const MotionSpec& motion) { return motion.weight > 0; };
  if (!motions.empty() && std::none_of(motions.begin(), motions.end(), counts))
    entry.fail("no motion has a weight", "give one a positive `weight`");
  return motions;
}

std::string locateRobot(const RobotSpec& spec, const std::string& file) {
  const fs::path beside = fs::path(file).parent_path() / spec.name;
  std::error_code error;
  const bool is_path = spec.name.find('/') != std::string::npos && fs::exists(beside, error);
  return is_path ? beside.string() : spec.name;
}

std::string findRobotDirectory(const RobotSpec& spec, const std::string& file) {
  return spec.generator.empty() ? fs::path(findRobotFile(locateRobot(spec, file))).parent_path().string() : "";
}

Model makeRobot(const RobotSpec& spec, const std::string& file) {
  if (spec.generator.empty()) return loadRobot(locateRobot(spec, file)).model;
  const Generator generator = findGenerator(spec.generator, spec.settings);
  OptionSet parameters = generator.parameters;
  for (const auto& [name, value] : spec.settings) parameters.set(name, value);
  return generator.make(parameters);
}

int readCount(const YamlEntry& entry, int most, int least) {
  const double value = entry.getNumber();
  if (value != std::floor(value) || value < least || value > most)
    entry.fail("it is not a whole number in " + std::to_string(least) + " .. " + std::to_string(most), "give one");
  return static_cast<int>(value);
}

double readChoiceNumber(const YamlEntry& entry, const std::vector<std::string>& choices) {
  const auto found = std::find(choices.begin(), choices.end(), entry.getText());
  if (found == choices.end()) entry.fail("'" + entry.getText() + "' is not one of the choices", "give one of them");
  return static_cast<double>(found - choices.begin());
}

}  // namespace bielle
