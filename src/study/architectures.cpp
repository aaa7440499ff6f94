#include "study/architectures.h"

#include <cmath>
#include <cstdio>
#include <filesystem>

#include "bielle/design/draft.h"
#include "bielle/io/robot_writer.h"
#include "bielle/io/text_file.h"
#include "bielle/model/error.h"
#include "bielle/robots/generators.h"
#include "model/yaml_entry.h"

namespace fs = std::filesystem;

namespace bielle::study {
namespace {

using Entry = YamlEntry;
using Fields = YamlFields;

std::string formatValue(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.12g", value);
  return text;
}

Settings readSettings(const Entry& entry) {
  Settings settings;
  for (const auto& [name, value] : entry.getMap()) settings.emplace_back(name, value.getNumber());
  return settings;
}

std::vector<Architecture> readRobots(const Entry& entry) {
  std::vector<Architecture> robots;
  for (const auto& [name, item] : entry.getMap()) {
    const Fields fields = item.getFields({"robot", "generator", "set"});
    Architecture one;
    one.name = name;
    if (name.empty() || name[0] == '.' || name.find('/') != std::string::npos)
      item.fail("'" + name + "' cannot be the name of a directory", "use a plain word");
    if (const Entry* robot = find(fields, "robot")) one.robot = robot->getText();
    if (const Entry* generator = find(fields, "generator")) one.generator = generator->getText();
    if (one.robot.empty() == one.generator.empty())
      item.fail("it names neither a robot nor a generator, or both", "give one of `robot` and `generator`");
    if (const Entry* set = find(fields, "set")) {
      if (one.generator.empty()) set->fail("a given robot has no parameters", "remove it, or give a generator");
      one.settings = readSettings(*set);
    }
    robots.push_back(one);
  }
  if (robots.empty()) entry.fail("there are none", "name at least one");
  return robots;
}

std::vector<ArchitectureMotion> readMotions(const Entry& entry) {
  std::vector<ArchitectureMotion> motions;
  for (const Entry& item : entry.getList()) {
    const Fields fields = item.getFields({"motion", "set"});
    ArchitectureMotion motion;
    motion.motion = require(fields, "motion", item).getText();
    if (const Entry* set = find(fields, "set")) motion.settings = readSettings(*set);
    motions.push_back(motion);
  }
  if (motions.empty()) entry.fail("there are none", "name at least one");
  return motions;
}

void readSpeeds(const Entry& entry, ArchitectureSpec& spec) {
  const Fields fields = entry.getFields({"motion", "option", "from", "to", "step", "set"});
  const auto getNumber = [&](const char* key) { return require(fields, key, entry).getNumber(); };
  const double from = getNumber("from"), to = getNumber("to"), step = getNumber("step");
  if (!(from <= to && step > 0 && (to - from) / step < 1000))
    entry.fail("its steps do not lead from one to the other", "give from <= to, step > 0 and less than 1000 steps");
  const Entry *motion = find(fields, "motion"), *option = find(fields, "option"), *set = find(fields, "set");
  for (int i = 0; from + i * step <= to + 1e-9 * step; ++i) {
    // The number that is written, not the sum of steps.
    const double value = std::round((from + i * step) * 1e9) / 1e9;
    ArchitectureMotion one{motion ? motion->getText() : "walk", {{option ? option->getText() : "speed", value}}};
    if (set)
      for (const auto& setting : readSettings(*set)) one.settings.push_back(setting);
    spec.speeds.push_back(one);
    spec.speed_values.push_back(value);
  }
}

void readRoot(const Entry& root, ArchitectureSpec& spec) {
  const Fields fields = root.getFields({"robots", "mass", "motions", "speeds", "groups", "drives"});
  spec.robots = readRobots(require(fields, "robots", root));
  if (const Entry* mass = find(fields, "mass")) {
    spec.mass = mass->getNumber();
    if (!(spec.mass > 0)) mass->fail("it is not positive", "give kilograms");
  }
  spec.motions = readMotions(require(fields, "motions", root));
  if (const Entry* speeds = find(fields, "speeds")) readSpeeds(*speeds, spec);
  if (const Entry* groups = find(fields, "groups"))
    for (const auto& [name, words] : groups->getMap()) spec.groups.push_back({name, words.getTexts()});
  spec.groups.push_back({"all", {}});
  if (const Entry* drives = find(fields, "drives")) {
    const Fields drive = drives->getFields({"motor_constant", "regeneration"});
    if (const Entry* constant = find(drive, "motor_constant")) {
      spec.drive.motor_constant = constant->getNumber();
      if (!(spec.drive.motor_constant > 0)) constant->fail("it is not positive", "give N m/sqrt(W)");
    }
    if (const Entry* share = find(drive, "regeneration")) {
      spec.drive.regeneration = share->getNumber();
      if (!(spec.drive.regeneration >= 0 && spec.drive.regeneration <= 1))
        share->fail("it is outside 0 .. 1", "give the share that is given back");
    }
  }
}

Model makeModel(const ArchitectureSpec& spec, const Architecture& architecture) {
  if (architecture.generator.empty()) {
    // A path is meant from where the file is; a name stays one.
    const fs::path beside = fs::path(spec.path).parent_path() / architecture.robot;
    std::error_code error;
    const bool is_path = architecture.robot.find('/') != std::string::npos && fs::exists(beside, error);
    return loadRobot(is_path ? beside.string() : architecture.robot).model;
  }
  const GeneratorRequest request = findGenerator(architecture.generator).makeRequest();
  for (const auto& [name, value] : architecture.settings) setParameter(request.parameters, name, value);
  return request.make();
}

// The factor of the trunk's mass that makes the whole weigh so much.
double calcTrunkFactor(const ArchitectureSpec& spec, const std::string& name, const Model& model) {
  if (spec.mass == 0) return 1;
  if (!model.hasFreeFlyer())
    throw ModelError(spec.path, "robot '" + name + "'", "it has no trunk that is free to move",
                     "leave `mass` out, or the robot");
  const double trunk = model.bodies()[1].inertia.mass, factor = 1 + (spec.mass - model.mass()) / trunk;
  if (!(factor > 0))
    throw ModelError(spec.path, "robot '" + name + "'",
                     "without its trunk it weighs " + formatValue(model.mass() - trunk) + " kg already",
                     "ask for a larger `mass`");
  return factor;
}

}  // namespace

std::string ArchitectureMotion::name() const {
  std::string text = motion;
  for (const auto& [option, value] : settings) text += "-" + option + "-" + formatValue(value);
  return text;
}

ArchitectureSpec readArchitectureSpec(const std::string& path) {
  ArchitectureSpec spec;
  spec.path = path;
  spec.text = readTextFile(path, "give the path of a comparison");
  try {
    readRoot(Entry(path, "", YAML::Load(spec.text)), spec);
  } catch (const YAML::Exception& error) {
    throw ModelError(path, "line " + std::to_string(error.mark.line + 1), "it is not YAML: " + error.msg,
                     "correct the syntax");
  }
  return spec;
}

std::vector<Contender> makeContenders(const ArchitectureSpec& spec, const std::string& directory) {
  std::vector<Contender> contenders;
  for (const Architecture& architecture : spec.robots) {
    const Model model = makeModel(spec, architecture);
    Contender contender;
    contender.name = architecture.name;
    contender.directory = directory + "/" + architecture.name;
    contender.trunk_factor = calcTrunkFactor(spec, architecture.name, model);
    RobotDraft draft(model);
    if (contender.trunk_factor != 1) draft.scaleMass(model.bodies()[1].name, contender.trunk_factor);
    writeRobot(draft.build(), contender.directory, "Written by `bielle compare`.");
    contender.robot = loadRobot(contender.directory);
    contenders.push_back(std::move(contender));
  }
  return contenders;
}

Case makeArchitectureCase(const Contender& contender, const ArchitectureMotion& motion) {
  std::vector<std::string> solve = {"solve",     motion.motion, "--robot", contender.directory,
                                    "--threads", "1",           "--quiet", "--no-report"};
  for (const auto& [option, value] : motion.settings) {
    solve.push_back("--set");
    solve.push_back(option + "=" + formatValue(value));
  }
  solve.insert(solve.end(), {"-o", std::string("@") + kMotion});
  return {contender.name + "-" + motion.name(), {solve}};
}

}  // namespace bielle::study
