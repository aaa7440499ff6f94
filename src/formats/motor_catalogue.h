#pragma once
// Motors in the YAML file of a robot, and the catalogues that they come from.
#include <map>
#include <string>
#include <vector>

#include "formats/robot_files.h"
#include "formats/yaml_entry.h"

namespace bielle {

// The entries of `motors` in a robot's YAML file at `path`. `catalogues`, or null, is the name of one of its own or a list of them,
// relative to it; the file motors.yaml of every directory of robots follows.
// \throws InputError naming the file, the key and the remedy
std::vector<MotorSpec> readMotorSpecs(const YamlEntry& motors, const std::string& path, const YamlEntry* catalogues);

// Motors of a catalogue by their names: what drives a joint, whose name they lack. `path` and `catalogues` as above.
// \throws InputError listing the names
std::vector<Motor> readMotorTypes(const std::vector<YamlEntry>& names, const std::string& path,
                                  const YamlEntry* catalogues);

}  // namespace bielle
