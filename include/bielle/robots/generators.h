#pragma once
/// \file The robots that can be generated, by name.
#include <functional>
#include <memory>

#include "bielle/model/model.h"
#include "bielle/robots/parameter.h"

namespace bielle {

/// One request: parameters, initially at their defaults, and the function that makes the model.
struct GeneratorRequest {
  std::vector<Parameter> parameters;
  std::function<Model()> make;  ///< \throws ModelError when the parameters do not define a robot
};

struct Generator {
  std::string name, help;
  std::function<GeneratorRequest()> makeRequest;
};

const std::vector<Generator>& getGenerators();

/// \throws ModelError listing the generators
const Generator& findGenerator(const std::string& name);

}  // namespace bielle
