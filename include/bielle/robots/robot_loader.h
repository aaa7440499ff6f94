#pragma once
/// \file Generators of robots and their parameters.
#include <functional>
#include <string>
#include <vector>

#include "bielle/formats/reader.h"
#include "bielle/model/model.h"
#include "bielle/model/options.h"

namespace bielle {

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
