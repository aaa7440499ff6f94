#include "robots/part_file.h"

#include <algorithm>
#include <filesystem>
#include <set>

#include "bielle/formats/reader.h"
#include "formats/robot_files.h"
#include "model/listing.h"

namespace fs = std::filesystem;

namespace bielle {
namespace {

std::vector<std::string> listPartKeys() {
  std::vector<std::string> keys = {"help", "parameters", "points", "mounts",  "let",  "requires",
                                   "tree", "solids",     "frames", "linkage", "roles"};
  keys.insert(keys.end(), listSharedKeys().begin(), listSharedKeys().end());
  return keys;
}

const YamlKeys kPartKeys("part", "", listPartKeys());
const YamlKeys kParameterKeys("part", "parameters.NAME", {"value", "unit", "bounds", "help", "choices", "parts"});

// Where parts are looked for, besides beside the file that names them.
std::vector<fs::path> listPartDirectories(const std::string& file) {
  std::vector<fs::path> out = {fs::path(file).parent_path()};
  for (const std::string& directory : getRobotDirectories()) out.push_back(fs::path(directory) / "parts");
  return out;
}

// Of a folder of parts, by name.
std::vector<std::string> listParts(const std::string& folder, const std::string& file) {
  std::set<std::string> names;
  for (const fs::path& directory : listPartDirectories(file)) {
    std::error_code error;
    for (fs::directory_iterator it(directory / folder, error), end; !error && it != end; it.increment(error))
      if (it->path().extension() == ".yaml") names.insert(it->path().stem().string());
  }
  return {names.begin(), names.end()};
}

OptionValue readValue(const YamlEntry& entry, bool is_choice) {
  if (is_choice) return entry.getText();
  if (entry.isWord("true") || entry.isWord("false")) return entry.isWord("true");
  return entry.getNumber();
}

PartParameter readParameter(const std::string& name, const YamlEntry& entry, const std::string& path) {
  const YamlFields fields = entry.getFields(kParameterKeys);
  PartParameter out;
  out.file = path;
  Option& option = out.option;
  option.name = name;
  const YamlEntry *choices = find(fields, "choices"), *parts = find(fields, "parts"), *value = find(fields, "value");
  if (choices) option.choices = choices->getTexts();
  if (parts) option.choices = listParts(parts->getText(), path);
  if (const YamlEntry* help = find(fields, "help")) option.help = help->getText();
  out.required = !value;
  const bool is_choice = choices || parts;
  option.value = value ? readValue(*value, is_choice) : is_choice ? OptionValue(std::string()) : OptionValue(0.0);
  if (is_choice && value && !contains(option.choices, std::get<std::string>(option.value)))
    value->fail("it is not among the choices", "use one of " + listItems(option.choices));
  if (std::holds_alternative<double>(option.value)) option.unit = "1";
  if (const YamlEntry* unit = find(fields, "unit")) option.unit = unit->getText();
  if (const YamlEntry* bounds = find(fields, "bounds")) {
    const std::vector<double> range = bounds->getNumbers(2);
    option.bounds = {range[0], range[1]};
    const double* number = std::get_if<double>(&option.value);
    if (value && number && !(*number >= range[0] && *number <= range[1]))
      value->fail("it is outside the bounds", "widen them, or correct it");
  }
  return out;
}

MountKind readMountKind(const YamlEntry& entry) {
  if (entry.isWord("link")) return MountKind::Link;
  if (entry.isWord("joint")) return MountKind::Joint;
  entry.fail("a mount is a link or a joint", "write link or joint");
}

void readDocument(const YamlEntry& root, PartFile& part) {
  for (const auto& [name, entry] : root.getMap())
    if (name == "play" || name == "rod_friction" || name == "rounding")
      entry.fail("it belongs to a whole robot, not to parts, whose joints and closures others name",
                 "move it to a file of its own, beside `model: " + fs::path(part.path).filename().string() +
                     "`, which is this robot with it");
  part.fields = root.getFields(kPartKeys);
  const YamlFields& fields = part.fields;
  if (const YamlEntry* help = find(fields, "help")) part.help = help->getText();
  if (const YamlEntry* parameters = find(fields, "parameters"))
    for (const auto& [name, entry] : parameters->getMap())
      part.parameters.push_back(readParameter(name, entry, part.path));
  if (const YamlEntry* points = find(fields, "points")) part.points = points->getTexts();
  if (const YamlEntry* mounts = find(fields, "mounts"))
    for (const auto& [name, entry] : mounts->getMap()) part.mounts.emplace_back(name, readMountKind(entry));
  if (const YamlEntry* tree = find(fields, "tree")) part.tree = tree->getMap();
}

}  // namespace

const PartParameter* PartFile::findParameter(const std::string& name) const {
  const auto it = std::find_if(parameters.begin(), parameters.end(),
                               [&name](const PartParameter& p) { return p.option.name == name; });
  return it == parameters.end() ? nullptr : &*it;
}

bool PartFile::defines(const std::string& name) const {
  if (findParameter(name) || contains(points, name)) return true;
  const YamlEntry* let = bielle::find(fields, "let");
  if (!let) return false;
  const auto values = let->getMap();
  return std::any_of(values.begin(), values.end(), [&name](const auto& value) { return value.first == name; });
}

std::string fillIn(const std::string& text, const std::map<std::string, std::string>& values, const YamlEntry& entry) {
  std::string out;
  for (size_t begin = 0; begin < text.size();) {
    const size_t open = text.find('{', begin), close = text.find('}', begin);
    if (open == std::string::npos || close == std::string::npos || close < open) return out + text.substr(begin);
    const std::string name = text.substr(open + 1, close - open - 1);
    const auto it = values.find(name);
    if (it == values.end()) entry.fail("'{" + name + "}' is unknown", "known are " + listKeys(values));
    out += text.substr(begin, open - begin) + it->second;
    begin = close + 1;
  }
  return out;
}

const PartFile& PartLibrary::read(const std::string& path) {
  std::error_code error;
  const std::string key = fs::weakly_canonical(path, error).string();
  std::unique_ptr<PartFile>& file = files_[key];
  if (file) return *file;
  auto part = std::make_unique<PartFile>();
  part->path = path;
  readYamlDocument(path, readRobotText(path), [&](const YamlEntry& root) { readDocument(root, *part); });
  file = std::move(part);
  return *file;
}

const PartFile& PartLibrary::find(const std::string& name, const YamlEntry& entry) {
  std::error_code error;
  const bool has_extension = fs::path(name).extension() == ".yaml";
  const std::string file = has_extension ? name : name + ".yaml", stem = fs::path(name).filename().string();
  std::vector<std::string> searched;
  for (const fs::path& directory : listPartDirectories(entry.path()))
    for (const fs::path& candidate : {directory / file, directory.parent_path() / name / (stem + ".yaml")}) {
      if (has_extension && candidate != directory / file) continue;
      if (fs::is_regular_file(candidate, error)) return read(candidate.lexically_normal().string());
      searched.push_back(candidate.lexically_normal().string());
    }
  if (has_extension && fs::is_regular_file(name, error)) return read(name);  // chosen by its path
  entry.fail("there is no part '" + name + "'", "searched were " + listItems(searched));
}

}  // namespace bielle
