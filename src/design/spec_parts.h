#pragma once
// Parts common to all files that name robots and motions.
#include <string>
#include <vector>

#include "bielle/model/model.h"
#include "bielle/motion/registry.h"
#include "design/spec.h"
#include "formats/yaml_entry.h"

namespace bielle {

// The motion that an entry names. \throws InputError with its line
const MotionEntry& findMotionOf(const YamlEntry& entry);
// Sets an option to what an entry says. \throws InputError with its line
void setOption(OptionSet& options, const std::string& name, const YamlEntry& entry, const std::string& value);
// The key `set` of a motion. \param known  its options
OptionValues readSettings(const YamlEntry& entry, OptionSet known);

// One of the values by its name.
template <typename Enum>
Enum readChoice(const YamlEntry& entry, const std::vector<Enum>& choices) {
  std::string names;
  for (const Enum choice : choices) {
    if (entry.getText() == getName(choice)) return choice;
    names += std::string(names.empty() ? "" : ", ") + getName(choice);
  }
  entry.fail("'" + entry.getText() + "' is unknown", "use one of " + names);
}

// A whole number.
int readCount(const YamlEntry& entry, int most, int least = 1);

// Number of a choice by its name.
double readChoiceNumber(const YamlEntry& entry, const std::vector<std::string>& choices);

// The key `search` of a design, whose other keys have been read.
void readSearch(const YamlEntry& entry, DesignSpec& spec);

// The keys `robot` or `generator` and `set` of a map.
RobotSpec readRobotSpec(const YamlFields& fields, const YamlEntry& map);

// A list of {motion: NAME, set: {...}}. \param weighed  also with `weight`, `payload` and `payload_at`
std::vector<MotionSpec> readMotionSpecs(const YamlEntry& entry, bool weighed = false);

// \param file  the file that names the robot: paths are relative to it
// \throws InputError when there is no such robot, generator or parameter
std::string locateRobot(const RobotSpec& spec, const std::string& file);
Model makeRobot(const RobotSpec& spec, const std::string& file);
// The directory of its files; empty for one of a generator.
std::string findRobotDirectory(const RobotSpec& spec, const std::string& file);

}  // namespace bielle
