#pragma once
/// \file Robots from files: a URDF and a YAML file of closures, motors and Bielle's own keys.
#include <optional>
#include <string>
#include <vector>

#include "bielle/model/model.h"

namespace bielle {

enum class BaseKind { Free, Fixed };

struct LoadOptions {
  std::optional<BaseKind> base;  ///< overrides the file's `base` key; without both: free
};

struct LoadedRobot {
  Model model;
  std::vector<std::string> warnings;
  std::string directory;  ///< where the files were found
};

/// Loads a robot by name (`bipetto`: looked up in the directories of getRobotDirectories()), directory (holding one
/// .urdf and an optional .yaml of the same stem, robot.urdf first) or file (.urdf).
/// \throws ModelError naming the file, the element and the remedy
LoadedRobot loadRobot(const std::string& name_or_path, const LoadOptions& options = {});

/// Directories searched for robots by name: $BIELLE_ROBOTS, the source tree's robots/ for a build tree, the installed share/.
std::vector<std::string> getRobotDirectories();

/// Names of the robots found there, sorted.
std::vector<std::string> listRobots();

}  // namespace bielle
