#pragma once
/// \file Puts a part, and the parts in it, into the files of a robot.
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "formats/robot_files.h"
#include "robots/part_file.h"

namespace bielle {

/// A part where it is mounted.
struct MountedPart {
  std::string name;                           ///< of its place in the tree of the mounting file
  std::string suffix;                         ///< of all its names
  std::string role;                           ///< of its motors
  double side = 1;                            ///< -1: the mirror image
  std::map<std::string, std::string> mounts;  ///< what it calls what
  PartChoices chosen;
  std::map<std::string, OptionValue> values;  ///< of all its parameters
  std::map<std::string, Vector3d> points;
};

/// A mount as it was given, to be compared with what is there in the end.
struct MountCheck {
  YamlEntry entry;
  std::string name;
  MountKind kind;
};

struct Composition {
  PartLibrary& library;
  RobotFiles files;
  std::vector<MountCheck> mounts;
  std::vector<std::function<void()>> later;  ///< what is fixed to links that may come after the part
};

/// Adds links and joints in the order of the tree, and all else by the names of the robot. \throws InputError
void composePart(const PartFile& file, const MountedPart& part, Composition& out);

}  // namespace bielle
