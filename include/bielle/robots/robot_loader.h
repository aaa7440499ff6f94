#pragma once
/// \file Robots by name or from files, given or generated; generators and their parameters. formats/reader.h describes the files.
#include <functional>
#include <string>
#include <vector>

#include "bielle/formats/reader.h"
#include "bielle/model/model.h"
#include "bielle/model/options.h"

namespace bielle {

/// Loads a robot by name (`bipetto`: DIR/bipetto/bipetto.urdf, robot.urdf, bipetto.yaml or .xml in the directories of
/// getRobotDirectories()), by directory (its robot.urdf, else the .urdf named as the directory, else its only .urdf,
/// else the .yaml or .xml named as the directory), by .urdf file, by .xml file of MuJoCo or by .yaml file with the key
/// `generator` or `model`.
/// \throws InputError naming the file, the element and the remedy, and no other exception, whatever the files contain
LoadedRobot loadRobot(const std::string& name_or_path, const LoadOptions& options = {});

struct Generator {
  std::string name, help;
  OptionSet parameters;  ///< at their defaults; bounds are what the generator accepts, not a recommendation
  /// \throws InputError when the parameters do not define a robot
  std::function<Model(const OptionSet& parameters)> make;
};

/// Those that are compiled, and files of robots that are composed of parts (docs/parts.md) in the directories of robots.
std::vector<Generator> listGenerators();

/// \param name      of one of them, or the path of a file that composes a robot of parts
/// \param settings  those whose value is the path of a .yaml file add it to the parts among which that parameter chooses
/// \throws InputError listing the generators
Generator findGenerator(const std::string& name, const OptionValues& settings = {});

}  // namespace bielle
