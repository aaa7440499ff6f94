#pragma once
// The biped that is composed of parts.
#include "bielle/robots/robot_loader.h"

namespace bielle::testing {

inline Model makeLegBiped(const OptionValues& values) {
  const Generator generator = findGenerator("leg_biped", values);
  OptionSet parameters = generator.parameters;
  for (const auto& [name, value] : values) parameters.set(name, value);
  return generator.make(parameters);
}

}  // namespace bielle::testing
