#include "tasks/campaign_spec.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "design/spec_parts.h"
#include "formats/text_file.h"
#include "model/number_text.h"
#include "tasks/cells.h"

namespace fs = std::filesystem;

namespace bielle::tasks {
namespace {

using Kind = CampaignAxis::Kind;

const YamlKeys kCampaignKeys("campaign", "", {"motions", "options", "push"});
const YamlKeys kRequestKeys("campaign", "motions[]", {"name", "solve", "robot", "set", "options"});
const YamlKeys kPushKeys("campaign", "push", {"time", "phase", "direction", "duration", "impulse", "largest_impulse"});
const YamlKeys kImpulseKeys("campaign", "push.largest_impulse", {"up_to", "step"});

constexpr double kMostImpulses = 1e4;

std::vector<YamlEntry> listEntries(const YamlEntry& entry) {
  if (!entry.isList()) return {entry};
  const std::vector<YamlEntry> entries = entry.getList();
  if (entries.empty()) entry.fail("it is empty", "give at least one value");
  return entries;
}

CampaignAxis makeAxis(Kind kind, const std::string& name, const YamlEntry& entry) {
  CampaignAxis axis{kind, name, {}, entry};
  for (const YamlEntry& item : listEntries(entry)) {
    if (kind != Kind::Option) item.getNumber();
    axis.values.push_back(item.getText());
    if (std::count(axis.values.begin(), axis.values.end(), axis.values.back()) > 1)
      item.fail("it is given twice", "keep one");
  }
  return axis;
}

// A path is relative to the file.
fs::path locate(const std::string& path, const std::string& file) {
  return (fs::absolute(file).parent_path() / path).lexically_normal();
}

CampaignMotion readSolvedMotion(const YamlEntry& entry, const std::string& file) {
  fs::path directory = locate(entry.getText(), file);
  if (!directory.has_filename()) directory = directory.parent_path();
  if (!fs::is_regular_file(directory / "summary.json"))
    entry.fail("'" + entry.getText() + "' is not a directory of a solved motion",
               "give one that `bielle solve` wrote, as a path from this file, or a map with `solve`");
  return {directory.filename().string(), directory.string(), "", {}};
}

// With one of these a program does nothing else.
void refuseEndings(const std::string& name, const YamlEntry& entry) {
  for (const char* ending : {"help", "version", "dry-run"})
    if (name == ending) entry.fail("with it the program would not execute anything", "remove it");
}

CampaignMotion readRequest(const YamlEntry& entry, const std::string& file) {
  const YamlFields fields = entry.getFields(kRequestKeys);
  CampaignMotion motion;
  motion.entry = entry;
  motion.name = require(fields, "name", entry).getText();
  if (motion.name.find('/') != std::string::npos || motion.name[0] == '.')
    fields.at("name").fail("it cannot be the name of a directory", "give a plain word");
  motion.robot = require(fields, "robot", entry).getText();
  if (motion.robot.find('/') != std::string::npos) motion.robot = locate(motion.robot, file).string();
  const std::string solve = require(fields, "solve", entry).getText();
  OptionSet known = findMotionOf(fields.at("solve")).request.options;
  motion.solve = {"solve", solve, "--robot", motion.robot};
  if (const YamlEntry* set = find(fields, "set"))
    for (const auto& [name, value] : set->getMap()) {
      setOption(known, name, value, value.getText());
      motion.solve.push_back("--set");
      motion.solve.push_back(name + "=" + formatOption(known.get(name).value));
    }
  if (const YamlEntry* options = find(fields, "options"))
    for (const auto& [name, value] : options->getMap()) {
      refuseEndings(name, value);
      if (name == "output" || name == "set" || name == "robot")
        value.fail("it cannot be set here", name == "output" ? "remove it" : "use the key next to `options`");
      addOption(name, value.getText(), motion.solve);
      motion.options.emplace_back(name, value);
    }
  return motion;
}

void readMotions(const YamlEntry& entry, CampaignSpec& spec) {
  CampaignAxis axis{Kind::Motion, "motion", {}, entry};
  for (const YamlEntry& item : listEntries(entry)) {
    spec.motions.push_back(item.isMap() ? readRequest(item, spec.path) : readSolvedMotion(item, spec.path));
    axis.values.push_back(spec.motions.back().name);
    if (std::count(axis.values.begin(), axis.values.end(), axis.values.back()) > 1)
      item.fail("another motion is called '" + axis.values.back() + "'", "give them different names");
  }
  spec.axes.push_back(std::move(axis));
}

ImpulseSearch readSearch(const YamlEntry& entry) {
  const YamlFields fields = entry.getFields(kImpulseKeys);
  ImpulseSearch search;
  search.up_to = require(fields, "up_to", entry).getNumber();
  search.step = require(fields, "step", entry).getNumber();
  const double count = search.step > 0 ? std::floor(search.up_to / search.step + 1e-9) : 0;
  if (!(count >= 1 && count <= kMostImpulses))
    entry.fail("up_to is not between 1 and " + formatExact(kMostImpulses) + " steps",
               "e.g. {up_to: 8, step: 0.25}, in N s");
  search.count = static_cast<int>(count);
  return search;
}

void readPush(const YamlEntry& entry, CampaignSpec& spec) {
  const YamlFields fields = entry.getFields(kPushKeys);
  if (fields.count("time") + fields.count("phase") != 1)
    entry.fail("it does not have exactly one of `time` and `phase`", "give one of them");
  if (fields.count("impulse") + fields.count("largest_impulse") != 1)
    entry.fail("it does not have exactly one of `impulse` and `largest_impulse`", "give one of them");
  const std::pair<const char*, Kind> kinds[] = {{"time", Kind::PushTime},
                                                {"phase", Kind::PushPhase},
                                                {"direction", Kind::PushDirection},
                                                {"duration", Kind::PushDuration},
                                                {"impulse", Kind::PushImpulse}};
  for (const auto& [name, kind] : kinds)
    if (const YamlEntry* values = find(fields, name))
      spec.axes.push_back(makeAxis(kind, std::string("push ") + name, *values));
  if (const YamlEntry* search = find(fields, "largest_impulse")) spec.search = readSearch(*search);
  spec.pushes = true;
}

}  // namespace

void addOption(const std::string& name, const std::string& value, std::vector<std::string>& arguments) {
  if (value == "false") return;
  arguments.push_back("--" + name);
  if (value != "true") arguments.push_back(value);
}

CampaignSpec readCampaignSpec(const std::string& path) {
  CampaignSpec spec;
  spec.path = path;
  readYamlDocument(path, readTextFile(path), [&spec](const YamlEntry& document) {
    const YamlFields fields = document.getFields(kCampaignKeys);
    readMotions(require(fields, "motions", document), spec);
    if (const YamlEntry* options = find(fields, "options"))
      for (const auto& [name, entry] : options->getMap()) {
        refuseEndings(name, entry);
        if (name == "output" || name == "push")
          entry.fail("it cannot be set here", name == "push" ? "use the key `push` next to `options`" : "remove it");
        spec.axes.push_back(makeAxis(Kind::Option, name, entry));
      }
    if (const YamlEntry* push = find(fields, "push")) readPush(*push, spec);
  });
  return spec;
}

}  // namespace bielle::tasks
