#pragma once
/// \file Robots by name or from files, given or generated. formats/reader.h describes the files.
#include <string>

#include "bielle/formats/reader.h"

namespace bielle {

/// Loads a robot by name (`bipetto`: DIR/bipetto/bipetto.urdf, robot.urdf, bipetto.yaml or .xml in the directories of
/// getRobotDirectories()), by directory (its robot.urdf, else the .urdf named as the directory, else its only .urdf,
/// else the .yaml or .xml named as the directory), by .urdf file, by .xml file of MuJoCo or by .yaml file with the key
/// `generator` or `model`.
/// \throws InputError naming the file, the element and the remedy, and no other exception, whatever the files contain
LoadedRobot loadRobot(const std::string& name_or_path, const LoadOptions& options = {});

}  // namespace bielle
