#include "robots/generator_entry.h"

#include "bielle/model/error.h"

namespace bielle {

GeneratorEntry readGeneratorEntry(const YamlEntry& name, const YamlEntry* settings) {
  YamlEntry entry = name;  // the one that an error is about
  try {
    const Generator& generator = findGenerator(name.getText());
    OptionSet parameters = generator.parameters;
    if (settings)
      for (const auto& [key, value] : settings->getMap()) {
        entry = value;
        parameters.set(key, parseOption(value.getText()));
      }
    return {&generator, std::move(parameters)};
  } catch (const InputError& error) {
    if (!error.source().empty() && error.source() != name.getText()) throw;  // it names file and line
    entry.fail(error.problem(), error.remedy());
  }
}

}  // namespace bielle
