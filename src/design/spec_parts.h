#pragma once
// Parts common to all files that name robots and motions.
#include <string>
#include <vector>

#include "bielle/model/model.h"
#include "design/spec.h"
#include "formats/yaml_entry.h"

namespace bielle {

OptionValues readSettings(const YamlEntry& entry);

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
