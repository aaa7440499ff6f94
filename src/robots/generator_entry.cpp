#include "robots/generator_entry.h"

#include <algorithm>
#include <filesystem>

#include "bielle/formats/reader.h"
#include "bielle/model/error.h"
#include "formats/robot_files.h"

namespace fs = std::filesystem;

namespace bielle {

namespace {

// Of a file in the directories of robots its name, of any other its path.
std::string findShortName(const std::string& file) {
  const std::string name = fs::path(file).stem().string();
  const std::vector<std::string> known = listRobots();
  std::error_code error;
  const bool is_known = std::find(known.begin(), known.end(), name) != known.end();
  return is_known && fs::equivalent(findRobotFile(name), file, error) ? name : fs::absolute(file).string();
}

}  // namespace

std::string locateBeside(const YamlEntry& entry) {
  const std::string text = entry.getText();
  const fs::path file = fs::path(entry.path()).parent_path() / text;
  std::error_code error;
  return file.extension() == ".yaml" && fs::is_regular_file(file, error) ? file.lexically_normal().string() : text;
}

GeneratorEntry readGeneratorEntry(const YamlEntry& name, const YamlEntry* settings) {
  YamlEntry entry = name;  // the one that an error is about
  try {
    std::vector<std::pair<YamlEntry, std::pair<std::string, OptionValue>>> given;
    OptionValues values;
    if (settings)
      for (const auto& [key, value] : settings->getMap()) {
        values.emplace_back(key, parseOption(locateBeside(value)));
        given.emplace_back(value, values.back());
      }
    Generator generator = findGenerator(locateBeside(name), values);
    OptionSet parameters = generator.parameters;
    for (const auto& [value, setting] : given) {
      entry = value;
      parameters.set(setting.first, setting.second);
    }
    return {locateBeside(name), std::move(generator), std::move(parameters)};
  } catch (const InputError& error) {
    if (!error.source().empty() && error.source() != name.getText()) throw;  // it names file and line
    entry.fail(error.problem(), error.remedy());
  }
}

void requireUsed(const std::string& generator, const YamlEntry& settings, const OpenChoices& open) {
  OptionValues values;
  for (const auto& [name, value] : settings.getMap()) values.emplace_back(name, parseOption(locateBeside(value)));
  const std::optional<UnusedParameters> unused = findUnused(generator, values, open);
  if (!unused) return;
  for (const auto& [name, value] : settings.getMap())
    if (name == unused->names.front()) value.fail(unused->problem, unused->remedy);
}

OptionValues GeneratorEntry::listChanges() const {
  OptionValues changes;
  for (const Option& option : parameters)
    if (option.value != generator.parameters.get(option.name).value) changes.emplace_back(option.name, option.value);
  return changes;
}

std::optional<GeneratorEntry> readGeneratorOf(const std::string& file) {
  if (fs::path(file).extension() != ".yaml") return {};
  const YamlFile yaml = readYaml(file);
  if (yaml.generator) return readGeneratorEntry(*yaml.generator, yaml.settings ? &*yaml.settings : nullptr);
  if (!yaml.composed) return {};
  Generator generator = findGenerator(file);
  OptionSet parameters = generator.parameters;
  return GeneratorEntry{findShortName(file), std::move(generator), std::move(parameters)};
}

}  // namespace bielle
