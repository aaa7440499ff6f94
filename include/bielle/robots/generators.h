#pragma once
/// \file Generators of robots by name, and their parameters.
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "bielle/model/model.h"

namespace bielle {

/// One number of a generator, pointing into its options.
struct Parameter {
  std::string name;
  double* value = nullptr;
  std::string unit;
  double lower = 0, upper = 0;  ///< range that the generator accepts, not a recommendation
  std::string help;
  std::vector<std::string> choices = {};  ///< names of its values 0, 1, ... where it chooses a part
};

/// The value of a choice by its name. \throws ModelError listing the choices of the parameter
double findChoice(const Parameter& parameter, const std::string& name);

/// Sets a parameter by name.
/// \throws ModelError listing the parameters
void setParameter(const std::vector<Parameter>& parameters, const std::string& name, double value);

/// \throws ModelError naming the first parameter that is outside its bounds, or between two choices
void checkParameters(const std::string& robot, const std::vector<Parameter>& parameters);

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
