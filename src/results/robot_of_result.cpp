#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <sstream>

#include "bielle/formats/robot_writer.h"
#include "bielle/model/error.h"
#include "bielle/results/result.h"
#include "formats/robot_files.h"
#include "formats/text_file.h"
#include "model/hash.h"
#include "model/number_text.h"
#include "results/json_text.h"
#include "results/other_robot.h"
#include "results/result_files.h"

namespace fs = std::filesystem;

namespace bielle {
namespace {

constexpr const char* kRemedy = "give a directory that `bielle solve` wrote";

// What a summary says of its robot.
struct RobotEntry {
  std::string file, name, path, fingerprint;  // the first is the summary itself
  std::vector<std::string> command;
};

RobotEntry readEntry(const std::string& directory) {
  RobotEntry entry;
  entry.file = (fs::path(directory) / "summary.json").string();
  readJsonFile(entry.file, kRemedy, [&entry](const Json& json) {
    const auto getText = [&json](const char* key) {
      const auto it = json.find(key);
      return it != json.end() && it->is_string() ? it->get<std::string>() : std::string();
    };
    entry.name = getText("robot");
    entry.path = getText("robot_file");
    entry.fingerprint = getText("robot_fingerprint");
    if (const auto it = json.find("command"); it != json.end() && it->is_array())
      for (const Json& word : *it)
        if (word.is_string()) entry.command.push_back(word.get<std::string>());
  });
  return entry;
}

bool isFile(const std::string& path) {
  std::error_code error;
  return fs::is_regular_file(path, error);
}

// The text of a robot; empty if files cannot express it.
RobotText formatIfPossible(const LoadedRobot& robot) {
  try {
    return formatRobot(robot.model, "", robot.wear);
  } catch (const InputError&) {
    return {};
  }
}

LoadedRobot readText(const RobotText& text, const std::string& path) {
  LoadedRobot robot;
  robot.model = combineFiles(parseRobotText(text, path), {}, &robot);
  robot.warnings.clear();  // were told when it was written
  return robot;
}

// As written and read again, which may round: in the same way for two texts of one robot, whatever version wrote them.
RobotText readAndFormat(const RobotText& text, const std::string& path) {
  return text.urdf.empty() ? text : formatIfPossible(readText(text, path));
}

// Whether two lines are the same but for the rounding of their numbers. Linkages that were mended (rounded_linkages.h) differ by
// some 1e-11 from program to program, as what the compiler made of each.
bool isSame(const std::string& x, const std::string& y) {
  constexpr double kRounding = 1e-9;
  const char *a = x.data(), *b = y.data(), *a_end = a + x.size(), *b_end = b + y.size();
  while (a < a_end && b < b_end) {
    double first = 0, second = 0;
    const auto [a_next, a_error] = std::from_chars(a, a_end, first);
    const auto [b_next, b_error] = std::from_chars(b, b_end, second);
    const bool are_numbers = a_error == std::errc() && b_error == std::errc();
    if (are_numbers ? std::abs(first - second) > kRounding * std::max(1.0, std::abs(first)) : *a != *b) return false;
    a = are_numbers ? a_next : a + 1;
    b = are_numbers ? b_next : b + 1;
  }
  return a == a_end && b == b_end;
}

// The first place where two texts differ: a line of each, or what is left of it around that place.
std::string describeDifference(const std::string& now, const std::string& then) {
  constexpr size_t kBefore = 30, kShown = 80;
  std::istringstream a(now), b(then);
  while (a || b) {
    std::string x, y;  // empty beyond the end of the shorter one
    std::getline(a, x);
    std::getline(b, y);
    if (isSame(x, y)) continue;
    const auto at = static_cast<size_t>(std::mismatch(x.begin(), x.end(), y.begin(), y.end()).first - x.begin());
    const size_t blank = std::min(x.find_first_not_of(' '), at), begin = at > blank + kBefore ? at - kBefore : blank;
    const auto cut = [begin](const std::string& line) { return line.substr(std::min(begin, line.size()), kShown); };
    return " (`" + cut(x) + "` now, `" + cut(y) + "` then)";
  }
  return "";
}

std::string describeCommand(const std::vector<std::string>& command) {
  std::string text;
  for (const std::string& word : command) {
    const bool is_plain = !word.empty() && word.find_first_of(" '\"\\$`;&|<>()[]{}*?#~\n") == std::string::npos;
    text += (text.empty() ? "" : " ") + (is_plain ? word : "'" + word + "'");
  }
  return text;
}

// The robot in a result, with the pictures of its file, if that is still there.
LoadedRobot loadOwn(const std::string& mechanism, const RobotText& text, const std::string& path) {
  const std::string file = isFile(path) ? path : fs::absolute(mechanism).lexically_normal().string();
  LoadedRobot robot = readText(text, file);
  robot.file = file;
  robot.directory = fs::path(file).parent_path().string();
  return robot;
}

// The robot that its file has now; none if there is no such file, or nothing can be read from it any more.
std::optional<LoadedRobot> loadCurrent(const std::string& path, std::optional<BaseKind> base = {}) {
  if (!isFile(path)) return {};
  try {
    LoadedRobot robot = loadRobot(path, {base});
    robot.warnings.clear();  // were told when the motion was solved
    return robot;
  } catch (const InputError&) {
    return {};
  }
}

// As it was before results had a robot of their own.
LoadedRobot loadByName(const RobotEntry& entry) {
  const std::string name = isFile(entry.path) ? entry.path : entry.name;
  if (name.empty()) throw InputError(entry.file, "key 'robot'", "it is missing", kRemedy);
  LoadedRobot robot = loadRobot(name);
  robot.warnings.clear();
  return robot;
}

// The robot in a result. \throws InputError if it is not the one that the motion was solved for
RobotText readOwn(const std::string& directory, const RobotEntry& entry) {
  const std::string mechanism = (fs::path(directory) / kMechanismUrdf).string(),
                    yaml = (fs::path(directory) / kMechanismYaml).string();
  RobotText own = {readTextFile(mechanism, "restore it and " + yaml + ", or solve the motion again"),
                   readTextFile(yaml, "restore it, or solve the motion again")};
  if (calcFingerprint(own) != entry.fingerprint)
    throw InputError(mechanism, "file", "it is not, or " + yaml + " is not, the robot that the motion was solved for",
                     "restore both, or solve the motion again");
  return own;
}

// Of two robots as they are read; empty if they are the same.
std::string describeChange(const RobotText& now, const RobotText& then) {
  const std::string tree = describeDifference(now.urdf, then.urdf);
  return tree.empty() ? describeDifference(now.yaml, then.yaml) : tree;
}

}  // namespace

std::string calcFingerprint(const RobotText& text) {
  if (text.urdf.empty()) return "";
  return formatText("%016llx", static_cast<unsigned long long>(hashText(text.yaml, hashText(text.urdf))));
}

RunInfo makeRunInfo(const std::string& name, const LoadedRobot& robot, const std::vector<std::string>& command,
                    Belief model, const std::string& serial_armature) {
  return {name, robot.file, command, model, serial_armature, formatIfPossible(robot)};
}

LoadedRobot loadRobotOf(const std::string& directory) {
  const RobotEntry entry = readEntry(directory);
  if (entry.fingerprint.empty()) return loadByName(entry);
  const std::optional<LoadedRobot> current = loadCurrent(entry.path);
  const RobotText now = current ? formatIfPossible(*current) : RobotText();
  if (calcFingerprint(now) == entry.fingerprint) return *current;
  for (const BaseKind base : {BaseKind::Free, BaseKind::Fixed})  // it may have been loaded with another one
    if (const auto based = loadCurrent(entry.path, base))
      if (calcFingerprint(formatIfPossible(*based)) == entry.fingerprint) return *based;
  const std::string mechanism = (fs::path(directory) / kMechanismUrdf).string();
  LoadedRobot robot = loadOwn(mechanism, readOwn(directory, entry), entry.path);
  if (!isFile(entry.path)) return robot;
  const RobotText then = formatIfPossible(robot), read = readAndFormat(now, robot.file);
  const std::string difference = !current ? ", and cannot be read" : describeChange(read, then);
  if (difference.empty()) return *current;
  const std::string again = entry.command.empty() ? "" : ": `" + describeCommand(entry.command) + "`";
  robot.warnings.push_back(entry.path + ": the robot has changed since the motion in " + directory +
                           " was solved for it" + difference + "; what follows is of the robot of that time, " +
                           mechanism + "; for the robot of now solve the motion again" + again);
  return robot;
}

std::string describeOtherRobot(const std::string& directory, const LoadedRobot& now) {
  const RobotEntry entry = readEntry(directory);
  const RobotText text = formatIfPossible(now);
  if (entry.fingerprint.empty() || calcFingerprint(text) == entry.fingerprint) return "";
  const LoadedRobot robot = loadOwn((fs::path(directory) / kMechanismUrdf).string(), readOwn(directory, entry), "");
  return describeChange(readAndFormat(text, robot.file), formatIfPossible(robot));
}

}  // namespace bielle
