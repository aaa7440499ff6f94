#include "tasks/dataset_spec.h"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <initializer_list>
#include <map>
#include <regex>
#include <set>

#include "bielle/formats/reader.h"
#include "design/spec_parts.h"
#include "formats/text_file.h"
#include "model/listing.h"
#include "model/number_text.h"
#include "tasks/campaign_spec.h"
#include "tasks/cells.h"

namespace fs = std::filesystem;

namespace bielle::tasks {
namespace {

const std::vector<std::string> kFormats = {"mjlab", "amp", "beyondmimic", "mcap", "problem"};
constexpr size_t kMostMotions = 100'000;
const YamlKeys kDatasetKeys("data set", "", {"licence", "formats", "fps", "isaac_lab", "motions"});
const YamlKeys kDatasetMotionKeys("data set", "motions[]", {"solve", "robot", "payload", "set", "options", "simulate"});

// What is varied in one entry of `motions`.
struct DatasetAxis {
  enum class Kind { Robot, Payload, Setting, Option, Simulation } kind;
  std::string name;
  std::vector<std::string> values;
  YamlEntry entry;
};
using AxisKind = DatasetAxis::Kind;

DatasetAxis readAxis(AxisKind kind, const std::string& name, const YamlEntry& entry) {
  DatasetAxis axis{kind, name, {}, entry};
  for (const YamlEntry& item : entry.isList() ? entry.getList() : std::vector<YamlEntry>{entry})
    axis.values.push_back(item.getText());
  if (axis.values.empty()) entry.fail("it is empty", "give at least one value");
  return axis;
}

void checkPayloads(const DatasetAxis& axis) {
  for (const std::string& value : axis.values) {
    const OptionValue mass = parseOption(value);
    const bool is_number = std::holds_alternative<int>(mass) || std::holds_alternative<double>(mass);
    if (!is_number || value[0] == '-') axis.entry.fail("'" + value + "' is no mass", "give kg, 0 or more");
  }
}

void addOptionAxes(AxisKind kind, const YamlEntry& options, std::initializer_list<const char*> own,
                   std::vector<DatasetAxis>& axes) {
  for (const auto& [name, value] : options.getMap()) {
    for (const char* other : own)
      if (name == other) value.fail("it cannot be set here", "remove it");
    axes.push_back(readAxis(kind, name, value));
  }
}

std::vector<DatasetAxis> readAxes(const YamlFields& fields, const YamlEntry& entry, OptionSet known) {
  std::vector<DatasetAxis> axes = {readAxis(AxisKind::Robot, "robot", require(fields, "robot", entry))};
  if (const YamlEntry* payload = find(fields, "payload")) {
    axes.push_back(readAxis(AxisKind::Payload, "payload", *payload));
    checkPayloads(axes.back());
  }
  if (const YamlEntry* set = find(fields, "set"))
    for (const auto& [name, value] : set->getMap()) {
      axes.push_back(readAxis(AxisKind::Setting, name, value));
      for (const std::string& text : axes.back().values) setOption(known, name, value, text);  // checks it
    }
  if (const YamlEntry* options = find(fields, "options"))
    addOptionAxes(AxisKind::Option, *options,
                  {"help", "output", "robot", "set", "threads", "no-check", "no-report", "quiet", "dry-run"}, axes);
  if (const YamlEntry* options = find(fields, "simulate"))
    addOptionAxes(
        AxisKind::Simulation, *options,
        {"help", "output", "robot", "set", "speed", "threads", "no-report", "summary-only", "live", "dry-run"}, axes);
  return axes;
}

// Letters, digits, dots and signs; anything else becomes a low line.
std::string makeFileName(std::string text) {
  for (char& c : text)
    if (!std::isalnum(static_cast<unsigned char>(c)) && c != '.' && c != '-' && c != '+') c = '_';
  return text;
}

std::string getRobotName(const std::string& robot) {
  const fs::path path = fs::path(robot).lexically_normal();
  return (path.has_filename() ? path : path.parent_path()).stem().string();
}

// Names of files must tell motions and robots apart.
class DatasetNames {
 public:
  void add(const DatasetMotion& motion, const YamlEntry& entry) {
    constexpr size_t kLongest = 200;  // with an extension, names of files may have 255 bytes
    if (motion.name.size() > kLongest)
      entry.fail("the name '" + motion.name + "' is too long for a file", "set fewer options at once");
    if (!motions_.insert(motion.name).second) entry.fail("it gives the motion '" + motion.name + "' again", "keep one");
    if (robots_.emplace(motion.body, motion.robot).first->second != motion.robot)
      entry.fail("another robot is called '" + motion.body + "'", "give their directories different names");
  }

 private:
  std::set<std::string> motions_;
  std::map<std::string, std::string> robots_;  // by the names of bodies
};

// Of the combination i of `count`: the only axis whose value is not its first one, or the first axis if there is none. Null
// if there are several, and for settings, which are checked already.
const DatasetAxis* findTried(const std::vector<DatasetAxis>& axes, size_t count, size_t i) {
  const DatasetAxis* varied = nullptr;
  for (const DatasetAxis& axis : axes) {
    count /= axis.values.size();
    if (i / count == 0) continue;
    i %= count;
    if (varied || axis.kind == AxisKind::Setting || axis.kind == AxisKind::Payload) return nullptr;
    varied = &axis;
  }
  return varied ? varied : &axes.front();
}

DatasetTrial makeTrial(const DatasetMotion& motion, const std::vector<DatasetAxis>& axes, const DatasetAxis& varied) {
  DatasetTrial trial{motion, {}, {}, varied.entry};
  for (const DatasetAxis& axis : axes) {
    if (axis.kind == AxisKind::Option) trial.options.emplace_back(axis.name, axis.entry);
    if (axis.kind == AxisKind::Simulation) trial.simulate.emplace_back(axis.name, axis.entry);
  }
  return trial;
}

void addMotions(const YamlEntry& entry, DatasetNames& names, DatasetSpec& spec) {
  const YamlFields fields = entry.getFields(kDatasetMotionKeys);
  const std::string solve = require(fields, "solve", entry).getText();
  const std::vector<DatasetAxis> axes = readAxes(fields, entry, findMotionOf(fields.at("solve")).request.options);
  size_t count = 1;
  for (const DatasetAxis& axis : axes) {
    count *= axis.values.size();
    if (count > kMostMotions) entry.fail("it has more than a hundred thousand combinations", "give fewer values");
  }
  for (size_t i = 0; i < count; ++i) {
    DatasetMotion motion;
    motion.motion = solve;
    motion.carried_out = find(fields, "simulate") != nullptr;
    std::string varied, carried;
    size_t rest = i, block = count;
    for (const DatasetAxis& axis : axes) {
      block /= axis.values.size();
      const std::string& value = axis.values[rest / block];
      rest %= block;
      if (axis.kind == AxisKind::Robot) {
        motion.robot = value;
        if (value.find('/') != std::string::npos)
          motion.robot = (fs::absolute(spec.path).parent_path() / value).lexically_normal().string();
      } else if (axis.kind == AxisKind::Payload) {
        motion.payload = parseNumber(value).value();
        if (motion.payload > 0) carried = "_payload_" + value;
      } else {
        auto& values = axis.kind == AxisKind::Setting  ? motion.set
                       : axis.kind == AxisKind::Option ? motion.options
                                                       : motion.simulate;
        values.emplace_back(axis.name, value);
        varied += "_" + axis.name + "_" + value;
      }
    }
    motion.robot_name = getRobotName(motion.robot);
    motion.body = makeFileName(motion.robot_name + carried);
    motion.name = makeFileName(motion.body + "_" + solve + varied);
    names.add(motion, entry);
    if (const DatasetAxis* varied = findTried(axes, count, i)) spec.trials.push_back(makeTrial(motion, axes, *varied));
    spec.motions.push_back(std::move(motion));
  }
}

}  // namespace

DatasetSpec readDatasetSpec(const std::string& path) {
  DatasetSpec spec;
  spec.path = path;
  spec.text = readTextFile(path);
  spec.rate = 50;
  spec.formats = {"mjlab"};
  readYamlDocument(path, spec.text, [&spec](const YamlEntry& document) {
    const YamlFields fields = document.getFields(kDatasetKeys);
    if (const YamlEntry* licence = find(fields, "licence")) spec.licence = licence->getText();
    if (const YamlEntry* rate = find(fields, "fps")) {
      spec.rate = rate->getNumber();
      if (!(spec.rate >= 1e-3 && spec.rate <= 1e4)) rate->fail("it is no rate", "give frames per second, up to 10000");
    }
    if (const YamlEntry* version = find(fields, "isaac_lab")) {
      const double number = version->getNumber();
      if (number != 2 && number != 3) version->fail("it is no version of Isaac Lab that is known", "give 2 or 3");
      spec.isaac_lab = static_cast<int>(number);
    }
    if (const YamlEntry* formats = find(fields, "formats")) {
      spec.formats = formats->getTexts();
      for (const std::string& format : spec.formats)
        if (std::find(kFormats.begin(), kFormats.end(), format) == kFormats.end())
          formats->fail("there is no format '" + format + "'", "give some of " + listItems(kFormats));
    }
    const auto requireFormat = [&](const char* key, const std::vector<std::string>& formats) {
      const YamlEntry* entry = find(fields, key);
      if (entry && std::none_of(formats.begin(), formats.end(),
                                [&spec](const std::string& format) { return contains(spec.formats, format); }))
        entry->fail("none of the formats depends on it", "add one of " + listItems(formats) + ", or remove it");
    };
    requireFormat("fps", {"mjlab", "amp", "beyondmimic"});
    requireFormat("isaac_lab", {"amp", "beyondmimic"});
    const YamlEntry& motions = require(fields, "motions", document);
    DatasetNames names;
    for (const YamlEntry& entry : motions.isList() ? motions.getList() : std::vector<YamlEntry>{motions})
      addMotions(entry, names, spec);
    if (spec.motions.empty()) motions.fail("it is empty", "give at least one motion");
    const bool carries_out = std::any_of(spec.motions.begin(), spec.motions.end(),
                                         [](const DatasetMotion& motion) { return motion.carried_out; });
    if (carries_out && std::count(spec.formats.begin(), spec.formats.end(), "problem") > 0)
      require(fields, "formats", document)
          .fail("a motion that was carried out is no problem", "remove 'problem', or `simulate` from the motions");
  });
  return spec;
}

namespace {

// As `bielle simulate` does when the motion is solved.
void requirePushesToEnd(const DatasetTrial& trial, const PlannedMotion& planned) {
  constexpr double kSlack = 1e-6;  // s
  double duration = 0, hold = 1;   // s, unless they are given (worlds/execution.h)
  for (const auto& [name, value] : trial.motion.simulate) {
    if (name == "duration") duration = parseNumber(value).value_or(0);
    if (name == "hold") hold = parseNumber(value).value_or(hold);
  }
  if (duration == 0 && !planned.end) return;
  const double end = duration > 0 ? duration : *planned.end + hold;
  for (const auto& [name, value] : trial.motion.simulate) {
    std::smatch time, length;
    if (name != "push" || !std::regex_search(value, time, std::regex("(?:^|,)t=([^,]+)"))) continue;
    const bool is_given = std::regex_search(value, length, std::regex("(?:^|,)duration=([^,]+)"));
    const double over =
        parseNumber(time[1].str()).value_or(0) + (is_given ? parseNumber(length[1].str()).value_or(0) : 0.1);
    const auto entry = std::find_if(trial.simulate.begin(), trial.simulate.end(),
                                    [](const auto& option) { return option.first == "push"; });
    if (over > end + kSlack)
      (entry == trial.simulate.end() ? trial.varied : entry->second)
          .fail("'" + value + "' is over at " + formatNumber(over) + " s, but the simulation ends at " +
                    formatNumber(end) + " s",
                "give an earlier time, or a longer `duration` or `hold` beside it");
  }
}

}  // namespace

bool checkDataset(const DatasetSpec& spec, const std::string& bielle, const std::string& simulate,
                  const std::string& log) {
  std::set<std::vector<std::string>> tried;
  std::set<std::string> told;  // by each motion
  // False if the user asks for the end.
  const auto check = [&](const std::string& program, const std::vector<std::string>& arguments, const std::string& name,
                         const OptionEntries& options, const YamlEntry& varied) {
    if (!tried.insert(arguments).second) return true;
    std::vector<std::string> command = {program};
    command.insert(command.end(), arguments.begin(), arguments.end());
    const std::optional<std::string> complaint = findComplaint(command, log, told);
    if (complaint && !complaint->empty()) refuse(name, *complaint, options, varied);
    return complaint.has_value();
  };
  for (const DatasetTrial& trial : spec.trials) {
    const std::vector<std::vector<std::string>> steps = makeDatasetCase(trial.motion, trial.motion.robot).steps;
    if (!check(bielle, steps[0], "solve " + trial.motion.motion, trial.options, trial.varied)) return false;
    if (steps.size() < 2) continue;
    const PlannedMotion planned = readPlannedMotion(log);
    std::vector<std::string> arguments(steps[1].begin() + 1, steps[1].end());  // without the command
    arguments.insert(arguments.end(), {"--robot", trial.motion.robot});
    requirePushesToEnd(trial, planned);
    if (!check(simulate, arguments, "simulate", trial.simulate, trial.varied)) return false;
  }
  return true;
}

Case makeDatasetCase(const DatasetMotion& motion, const std::string& robot) {
  std::vector<std::string> solve = {"solve", motion.motion, "--robot", robot};
  for (const auto& [name, value] : motion.set) solve.insert(solve.end(), {"--set", name + "=" + value});
  for (const auto& [name, value] : motion.options) addOption(name, value, solve);
  solve.insert(solve.end(), {"-o", std::string("@") + kDatasetMotion, "--quiet", "--no-report", "--threads", "1"});
  if (!motion.carried_out) return {motion.name, {solve}, robot};
  std::vector<std::string> simulate = {"simulate", std::string("@") + kDatasetMotion};
  for (const auto& [name, value] : motion.simulate) addOption(name, value, simulate);
  simulate.insert(simulate.end(), {"-o", std::string("@") + kDatasetExecution, "--no-report", "--threads", "1"});
  return {motion.name, {solve, simulate}, robot};
}

}  // namespace bielle::tasks
