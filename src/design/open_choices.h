#pragma once
// The parts among which a design chooses.
#include "bielle/design/parametrization.h"
#include "robots/generator_entry.h"

namespace bielle {

/// Choices of the variables, and those that the settings make for all designs.
OpenChoices listOpenChoices(const OptionValues& settings, const std::vector<DesignVariable>& variables);

}  // namespace bielle
