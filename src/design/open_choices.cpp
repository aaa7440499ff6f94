#include "design/open_choices.h"

namespace bielle {

OpenChoices listOpenChoices(const OptionValues& settings, const std::vector<DesignVariable>& variables) {
  OpenChoices open;
  for (const auto& [name, value] : settings)
    if (const std::string* choice = std::get_if<std::string>(&value)) open[name] = {*choice};
  for (const DesignVariable& variable : variables)
    if (!variable.parameter.empty() && variable.isChoice()) open[variable.parameter] = variable.choices;
  return open;
}

}  // namespace bielle
