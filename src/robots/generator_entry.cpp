#include "robots/generator_entry.h"

#include <filesystem>

#include "bielle/model/error.h"
#include "formats/robot_files.h"

namespace fs = std::filesystem;

namespace bielle {

GeneratorEntry readGeneratorEntry(const YamlEntry& name, const YamlEntry* settings) {
  YamlEntry entry = name;  // the one that an error is about
  try {
    const fs::path directory = fs::path(name.path()).parent_path();
    const auto locate = [&directory](const std::string& text) {
      const fs::path file = directory / text;
      return file.extension() == ".yaml" && fs::exists(file) ? file.lexically_normal().string() : text;
    };
    std::vector<std::pair<YamlEntry, std::pair<std::string, OptionValue>>> given;
    OptionValues values;
    if (settings)
      for (const auto& [key, value] : settings->getMap()) {
        values.emplace_back(key, parseOption(locate(value.getText())));
        given.emplace_back(value, values.back());
      }
    Generator generator = findGenerator(locate(name.getText()), values);
    OptionSet parameters = generator.parameters;
    for (const auto& [value, setting] : given) {
      entry = value;
      parameters.set(setting.first, setting.second);
    }
    return {std::move(generator), std::move(parameters)};
  } catch (const InputError& error) {
    if (!error.source().empty() && error.source() != name.getText()) throw;  // it names file and line
    entry.fail(error.problem(), error.remedy());
  }
}

std::optional<GeneratorEntry> readGeneratorOf(const std::string& file) {
  if (fs::path(file).extension() != ".yaml") return {};
  const YamlFile yaml = readYaml(file);
  if (yaml.generator) return readGeneratorEntry(*yaml.generator, yaml.settings ? &*yaml.settings : nullptr);
  if (!yaml.composed) return {};
  Generator generator = findGenerator(file);
  OptionSet parameters = generator.parameters;
  return GeneratorEntry{std::move(generator), std::move(parameters)};
}

}  // namespace bielle
