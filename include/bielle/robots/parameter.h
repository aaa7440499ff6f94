#pragma once
/// \file Named numbers that a robot is generated from.
#include <string>
#include <vector>

namespace bielle {

/// One number of a generator, pointing into its options.
struct Parameter {
  std::string name;
  double* value = nullptr;
  std::string unit;
  double lower = 0, upper = 0;  ///< range that the generator accepts, not a recommendation
  std::string help;
};

/// Sets a parameter by name.
/// \throws ModelError listing the parameters
void setParameter(const std::vector<Parameter>& parameters, const std::string& name, double value);

/// \throws ModelError naming the first parameter that is outside its bounds
void checkParameters(const std::string& robot, const std::vector<Parameter>& parameters);

}  // namespace bielle
