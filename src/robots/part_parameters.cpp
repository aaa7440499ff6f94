#include "robots/part_parameters.h"

#include <algorithm>

#include "bielle/model/error.h"
#include "model/listing.h"

namespace bielle {
namespace {

constexpr int kDeepest = 20;  // parts in parts
const YamlKeys kMountingKeys("part", "tree.PART", {"part", "prefix", "set", "mounts", "role", "sides", "when"});

bool areSame(const Option& a, const Option& b) {
  return a.value == b.value && a.unit == b.unit && a.bounds.lower == b.bounds.lower &&
         a.bounds.upper == b.bounds.upper && a.choices == b.choices;
}

std::vector<std::string> listChoices(const PartLibrary& library, const PartParameter& parameter) {
  std::vector<std::string> choices = parameter.option.choices;
  const auto own = library.own_parts.find(parameter.option.name);
  if (!choices.empty() && own != library.own_parts.end() && !contains(choices, own->second))
    choices.push_back(own->second);
  return choices;
}

void addParameter(PartParameter parameter, const YamlEntry& entry, std::vector<PartParameter>& out) {
  const auto same = std::find_if(out.begin(), out.end(), [&parameter](const PartParameter& other) {
    return other.option.name == parameter.option.name;
  });
  if (same == out.end()) return out.push_back(std::move(parameter));
  if (parameter.required) return;
  if (same->required) {
    *same = std::move(parameter);
    return;
  }
  if (!areSame(same->option, parameter.option))
    entry.fail("parameter '" + parameter.option.name + "' of " + parameter.file + " differs from that of " + same->file,
               "rename one of them, or give both the same value, unit and bounds");
}

// What a mounting gives has to be wanted by one of the parts that may be mounted there.
void checkMounting(PartLibrary& library, const PartFile& owner, const PartMounting& mounting, const PartChoices& bound,
                   int depth) {
  std::vector<std::string> known, mounts;
  const std::vector<const PartFile*> parts = listAlternatives(library, owner, mounting, {});
  const auto addKnown = [&](const PartFile& part, const PartChoices& choices) {
    for (const PartParameter& p : listParameters(library, part, choices, depth + 1))
      if (!contains(known, p.option.name)) known.push_back(p.option.name);
  };
  for (const PartFile* part : parts) {
    for (const PartParameter& p : part->parameters) known.push_back(p.option.name);
    known.insert(known.end(), part->points.begin(), part->points.end());
    for (const auto& [name, kind] : part->mounts) mounts.push_back(name);
    addKnown(*part, bound);
  }
  for (const auto& [name, value] : mounting.set) {
    if (!contains(known, name) && value.isText())  // a choice within the part
      for (const PartFile* part : parts) addKnown(*part, {});
    if (!contains(known, name)) value.failUnknown("parameter or point", name, known);
  }
  if (const YamlEntry* given = find(mounting.fields, "mounts"))
    for (const auto& [name, value] : given->getMap())
      if (!contains(mounts, name)) value.failUnknown("mount", name, mounts);
}

}  // namespace

PartMounting::PartMounting(const YamlEntry& mounted) : entry(mounted), fields(mounted.getFields(kMountingKeys)) {
  if (const YamlEntry* given = find(fields, "prefix")) prefix = given->getText();
  if (const YamlEntry* given = find(fields, "set")) set = given->getMap();
}

const YamlEntry* PartMounting::findSet(const std::string& parameter) const {
  for (const auto& [name, value] : set)
    if (name == parameter) return &value;
  return nullptr;
}

bool mountsPart(const YamlEntry& entry) {
  const auto map = entry.getMap();
  return std::any_of(map.begin(), map.end(), [](const auto& pair) { return pair.first == "part"; });
}

std::vector<const PartFile*> listAlternatives(PartLibrary& library, const PartFile& owner, const PartMounting& mounting,
                                              const PartChoices& chosen) {
  const YamlEntry& part = require(mounting.fields, "part", mounting.entry);
  std::vector<std::string> names = {part.getText()};
  for (const PartParameter& p : owner.parameters) {
    if (p.option.choices.empty()) continue;
    const std::string placeholder = "{" + p.option.name + "}";
    std::vector<std::string> filled;
    for (const std::string& name : names) {
      if (name.find(placeholder) == std::string::npos) {
        filled.push_back(name);
        continue;
      }
      const auto one = chosen.find(p.option.name);
      const std::vector<std::string> choices =
          one == chosen.end() ? listChoices(library, p) : std::vector<std::string>{one->second};
      for (const std::string& choice : choices)
        filled.push_back(choice.size() > 5 && choice.substr(choice.size() - 5) == ".yaml"
                             ? choice
                             : fillIn(name, {{p.option.name, choice}}, part));
    }
    names = std::move(filled);
  }
  std::vector<const PartFile*> files;
  for (const std::string& name : names) files.push_back(&library.find(name, part));
  return files;
}

PartChoices listBoundChoices(const PartFile& owner, const PartMounting& mounting, const PartChoices& chosen) {
  PartChoices bound;
  const std::string& prefix = mounting.prefix;
  for (const auto& [name, choice] : chosen)
    if (owner.findParameter(name))
      bound[name] = choice;
    else if (name.compare(0, prefix.size(), prefix) == 0)
      bound[name.substr(prefix.size())] = choice;
  for (const auto& [name, value] : mounting.set)
    if (value.isText()) bound[name] = value.getText();
  return bound;
}

const std::vector<PartParameter>& listParameters(PartLibrary& library, const PartFile& file, const PartChoices& chosen,
                                                 int depth) {
  if (depth > kDeepest)
    throw InputError(file.path, "key 'tree'", "its parts mount each other without end",
                     "remove the part that is its own");
  const std::pair<const PartFile*, PartChoices> key = {&file, chosen};
  if (const auto known = library.parameters.find(key); known != library.parameters.end()) return known->second;
  std::vector<PartParameter> out;
  for (const PartParameter& p : file.parameters)
    if (p.option.choices.empty() || !chosen.count(p.option.name)) {
      out.push_back(p);
      out.back().option.choices = listChoices(library, p);
    }
  for (const auto& [name, entry] : file.tree) {
    if (!mountsPart(entry)) continue;
    const PartMounting mounting(entry);
    const PartChoices bound = listBoundChoices(file, mounting, chosen);
    checkMounting(library, file, mounting, bound, depth);
    for (const PartFile* part : listAlternatives(library, file, mounting, chosen))
      for (PartParameter p : listParameters(library, *part, bound, depth + 1)) {
        if (mounting.findSet(p.option.name) || file.defines(p.option.name)) continue;
        p.option.name = mounting.prefix + p.option.name;
        addParameter(std::move(p), entry, out);
      }
  }
  return library.parameters.emplace(key, std::move(out)).first->second;
}

}  // namespace bielle
