#pragma once
/// \file The generated robot that a YAML file names, with the parameters that it sets.
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "bielle/robots/robot_loader.h"
#include "formats/yaml_entry.h"

namespace bielle {

struct GeneratorEntry {
  std::string name;  ///< by which findGenerator() finds it, from anywhere
  Generator generator;
  OptionSet parameters;

  OptionValues listChanges() const;  ///< values that differ from the defaults
};

/// The text of an entry or, if it is the path of a .yaml file relative to that of the entry, that path.
std::string locateBeside(const YamlEntry& entry);

/// \param name      of the generator
/// \param settings  a map from parameters to numbers, or to names of choices, of which files (.yaml) are relative to that of the
///                  entry; null for none
/// \throws InputError naming file, line, parameter and remedy
GeneratorEntry readGeneratorEntry(const YamlEntry& name, const YamlEntry* settings);

/// Choices that are left open, by the names of their parameters.
using OpenChoices = std::map<std::string, std::vector<std::string>>;

/// Parameters that would change nothing, since no part has them that is chosen or may be.
struct UnusedParameters {
  std::vector<std::string> names;
  std::string problem, remedy;
};

/// All among `names`, where `settings` are made; none if there are none.
std::optional<UnusedParameters> findUnused(const std::string& generator, const std::vector<std::string>& names,
                                           const OptionValues& settings, const OpenChoices& open = {});
/// All among `settings`.
std::optional<UnusedParameters> findUnused(const std::string& generator, const OptionValues& settings,
                                           const OpenChoices& open = {});
/// \param settings  as of readGeneratorEntry()   \throws InputError naming file and line of the first one that is not
/// used
void requireUsed(const std::string& generator, const YamlEntry& settings, const OpenChoices& open = {});

/// That of a robot's file: one that names a generator, or composes a robot of parts; none for any other.
std::optional<GeneratorEntry> readGeneratorOf(const std::string& file);

}  // namespace bielle
