#pragma once
/// \file The robots that can be generated, by name.
#include <functional>
#include <memory>

#include "bielle/model/model.h"
#include "bielle/robots/parameter.h"

namespace bielle {

/// One request: parameters at their defaults, to be set, and the model that comes of them.
struct GeneratorRequest {
  std::vector<Parameter> parameters;
  std::function<Model()> make;  ///< \throws ModelError when the parameters make no robot
};

struct Generator {
  std::string name, help;
  std::function<GeneratorRequest()> makeRequest;
};

const std::vector<Generator>& getGenerators();

/// \throws ModelError naming the generators there are
const Generator& findGenerator(const std::string& name);

}  // namespace bielle
