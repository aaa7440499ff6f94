#pragma once
/// \file Generators of robots by name, and their parameters.
#include <functional>
#include <string>
#include <vector>

#include "bielle/model/model.h"
#include "bielle/model/options.h"

namespace bielle {

struct Generator {
  std::string name, help;
  OptionSet parameters;  ///< at their defaults; bounds are what the generator accepts, not a recommendation
  /// \throws InputError when the parameters do not define a robot
  std::function<Model(const OptionSet& parameters)> make;
};

const std::vector<Generator>& getGenerators();

/// \throws InputError listing the generators
const Generator& findGenerator(const std::string& name);

}  // namespace bielle
