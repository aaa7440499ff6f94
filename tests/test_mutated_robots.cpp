// Thousands of robot files with errors: each gives a usable model, or one clear error. The mutations are those that
// people and programs make (values out of range, names exchanged, lines lost or doubled, files truncated) and some that
// nobody makes. tests/fuzz continues from there, guided by coverage.
#include <catch2/catch.hpp>
#include <iostream>
#include <map>
#include <random>
#include <regex>

#include "bielle/dynamics/assembly.h"
#include "bielle/robots/robot_loader.h"
#include "formats/mjcf.h"
#include "formats/sdf.h"
#include "formats/usd.h"
#include "robot_directory.h"
#include "robot_trial.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

struct RobotFiles {
  std::string name, urdf, yaml;
};

// The toy, and the smaller ones of the robots of the source tree.
std::vector<RobotFiles> collectRobots() {
  std::vector<RobotFiles> robots = {{"toy", kToyUrdf, kToyYaml}};
  for (const auto& entry : std::filesystem::directory_iterator(BIELLE_SOURCE_DIR "/robots")) {
    const std::string name = entry.path().filename().string();
    const RobotFiles files = {name, readFile(entry.path() / (name + ".urdf")),
                              readFile(entry.path() / (name + ".yaml"))};
    if (!files.urdf.empty() && files.urdf.size() < 60000) robots.push_back(files);
  }
  std::sort(robots.begin(), robots.end(), [](const auto& a, const auto& b) { return a.name < b.name; });
  return robots;
}

using Random = std::mt19937;
int choose(Random& rng, int count) { return std::uniform_int_distribution<int>(0, count - 1)(rng); }

std::vector<std::string> split(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

std::string join(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += line + "\n";
  return text;
}

// The first place that matches a pattern after one chosen at random: two iterators, or the end twice.
std::pair<std::string::const_iterator, std::string::const_iterator> findOneOf(const std::string& text,
                                                                              const std::regex& pattern, Random& rng) {
  std::smatch match;
  const auto begin = text.begin() + choose(rng, static_cast<int>(text.size()) + 1);
  if (!std::regex_search(begin, text.end(), match, pattern) && !std::regex_search(text, match, pattern))
    return {text.end(), text.end()};
  return {match[0].first, match[0].second};
}

std::string replaceOneOf(const std::string& text, const std::regex& pattern, const std::string& by, Random& rng) {
  const auto [begin, end] = findOneOf(text, pattern, rng);
  return begin == end ? text : std::string(text.begin(), begin) + by + std::string(end, text.end());
}

std::string changeNumber(const std::string& text, Random& rng) {
  static const std::regex number(R"([-+]?\d+(\.\d+)?([eE][-+]?\d+)?)");
  static const char* const values[] = {
      "0",     "-1",   "1e300", "-1e300", "1e-300", "1e308", "1e999", "nan", ".nan", "inf",
      "-.inf", "1e10", "-0",    "",       "x",      "1,5",   "0x10",  "1e",  "1 2",  "99999999999999999999",
      "1e-9",  "3.14", "--1",   "1e150"};
  return replaceOneOf(text, number, values[choose(rng, std::size(values))], rng);
}

std::string exchangeName(const std::string& text, Random& rng) {
  static const std::regex name(R"([A-Za-z_]\w{2,})");
  const auto [begin, end] = findOneOf(text, name, rng);
  const std::string other = choose(rng, 8) ? std::string(begin, end) : "world";
  return replaceOneOf(text, name, other, rng);
}

std::string changeLines(const std::string& text, Random& rng) {
  std::vector<std::string> lines = split(text);
  if (lines.empty()) return text;
  const int count = static_cast<int>(lines.size()), i = choose(rng, count), j = choose(rng, count);
  switch (choose(rng, 4)) {
    case 0:
      lines.erase(lines.begin() + i);
      break;
    case 1:
      lines.insert(lines.begin() + j, std::string(lines[i]));
      break;
    case 2:
      std::swap(lines[i], lines[j]);
      break;
    default:
      lines.erase(lines.begin() + std::min(i, j), lines.begin() + std::max(i, j));
  }
  return join(lines);
}

std::string changeBytes(std::string text, Random& rng) {
  if (text.empty()) return text;
  const int at = choose(rng, static_cast<int>(text.size()));
  switch (choose(rng, 4)) {
    case 0:
      return text.substr(0, at);
    case 1:
      text[at] = static_cast<char>(choose(rng, 256));
      return text;
    case 2:
      return text.erase(at, 1 + choose(rng, 40));
    default:
      return text.insert(at, std::string(1 + choose(rng, 40), static_cast<char>(choose(rng, 256))));
  }
}

// Depth and numbers that no robot has.
std::string blowUp(const std::string& text, Random& rng) {
  const int n = 1 << choose(rng, 14);
  std::string more;
  switch (choose(rng, 6)) {
    case 0:
      for (int i = 0; i < n; ++i) more += "<link name=\"n" + std::to_string(i) + "\">";
      break;
    case 1:
      more = std::string(n, '[');
      break;
    case 2:
      more = "closed_loop: " + std::string(n, '[') + std::string(n, ']') + "\n";
      break;
    case 3:
      for (int i = 0; i < n / 64; ++i) {
        const std::string a = std::to_string(i), b = std::to_string(i + 1);
        more += "<link name=\"n" + a + "\"/><joint name=\"m" + a + "\" type=\"continuous\"><parent link=\"n" + a +
                "\"/><child link=\"n" + b + "\"/></joint>";
      }
      break;
    case 4:
      more = "a: &a [x]\n";
      for (char c = 'b'; c < 'b' + n % 20; ++c)
        more += std::string(1, c) + ": &" + c + " [*" + std::string(1, c - 1) + ", *" + std::string(1, c - 1) + "]\n";
      break;
    default:
      more = std::string(n, 'a');
  }
  const size_t end = text.rfind("</robot>");
  const size_t at = choose(rng, 2) && end != std::string::npos ? end : choose(rng, static_cast<int>(text.size()) + 1);
  return text.substr(0, at) + more + text.substr(at);
}

std::string mutate(std::string text, Random& rng) {
  const int times = 1 + choose(rng, 3);
  for (int i = 0; i < times; ++i) {
    const int kind = choose(rng, 20);
    if (kind < 8)
      text = changeNumber(text, rng);
    else if (kind < 12)
      text = exchangeName(text, rng);
    else if (kind < 16)
      text = changeLines(text, rng);
    else if (kind < 19)
      text = changeBytes(text, rng);
    else
      text = blowUp(text, rng);
  }
  return text;
}

}  // namespace

TEST_CASE("Mutated robot files are models or clear errors") {
  constexpr int kTrials = 3000;
  const std::vector<RobotFiles> robots = collectRobots();
  REQUIRE(robots.size() >= 4);
  const RobotDirectory directory;
  std::map<Trial, int> count;
  std::map<std::string, int> said;
  for (int i = 0; i < kTrials; ++i) {
    Random rng(i);  // so that one of them can be tried again by itself
    // Small robots more often: a mutation of a large one is like its neighbour.
    const RobotFiles& files = robots[choose(rng, 4) ? choose(rng, static_cast<int>(robots.size())) : robots.size() - 1];
    const bool in_yaml = choose(rng, 2);
    directory.writeRobot(in_yaml ? files.urdf : mutate(files.urdf, rng),
                         in_yaml ? mutate(files.yaml, rng) : files.yaml);
    const TrialResult result = tryRobot(directory.path());
    ++count[result.trial];
    if (result.trial == Trial::Refused) ++said[result.message.substr(result.message.rfind("; "))];
    CAPTURE(i, files.name, in_yaml, result.message);
    CHECK(result.trial != Trial::Wrong);
  }
  std::cout << kTrials << " mutated robots: " << count[Trial::Valid] << " models, " << count[Trial::Refused]
            << " refused with " << said.size() << " different remedies\n";
  // The mutations reach the readers: neither all harmless nor all at the surface.
  CHECK(count[Trial::Valid] > kTrials / 20);
  CHECK(count[Trial::Refused] > kTrials / 4);
  CHECK(said.size() > 30);
}

namespace {

// Mutations of some robots in another format.
template <typename Format>
void tryMutatedFiles(int trials, const std::string& file, const Format& format) {
  std::vector<std::string> files;
  for (const char* name : {"fourbar", "fivebar_leg", "spring_leg", "belt_biped"}) {
    const Model model = loadRobot(BIELLE_SOURCE_DIR "/robots/" + std::string(name)).model;
    files.push_back(format(model, findClosedConfiguration(model).q));
  }
  const RobotDirectory directory;
  std::map<Trial, int> count;
  std::map<std::string, int> said;
  for (int i = 0; i < trials; ++i) {
    Random rng(i);
    const std::string path = directory.write(file, mutate(files[choose(rng, static_cast<int>(files.size()))], rng));
    const TrialResult result = tryRobot(path);
    ++count[result.trial];
    if (result.trial == Trial::Refused) ++said[result.message.substr(result.message.rfind("; "))];
    CAPTURE(i, result.message);
    CHECK(result.trial != Trial::Wrong);
  }
  std::cout << trials << " mutations of " << file << ": " << count[Trial::Valid] << " models, " << count[Trial::Refused]
            << " refused with " << said.size() << " different remedies\n";
  CHECK(count[Trial::Valid] > trials / 20);
  CHECK(count[Trial::Refused] > trials / 4);
  CHECK(said.size() > 20);
}

}  // namespace

TEST_CASE("Mutated files of MuJoCo are models or clear errors") {
  tryMutatedFiles(1000, "robot.xml", [](const Model& model, const VectorXd& q) { return formatMjcf(model, q).xml; });
}

TEST_CASE("Mutated files of USD are models or clear errors") {
  tryMutatedFiles(8000, "robot.usda", [](const Model& model, const VectorXd& q) { return formatUsd(model, q).usda; });
}

TEST_CASE("Mutated robots of parts are models or clear errors") {
  constexpr int kTrials = 1500;
  const std::string part = R"(mounts: {base: link}
points: [at]
parameters:
  length: {unit: m}
  density: {value: 2, unit: kg/m, bounds: [1, 10], help: mass per length}
  radius: {value: 0.01, unit: m, bounds: [0.001, 0.1], help: radius}
let: {end: -length*z, half: "length > 1 ? 0.5 : length/2"}
requires: [{that: length > 0, problem: the rod has no length, remedy: make it longer}]
tree:
  rod_{part}: {parent: base, joint: "swing_{part}", place: at, axis: y, range: [-1, half + 1],
               solids: [{rod: [origin, end], radius: radius, density: density}, {box: [0.1, half, 0.1], rpy: [0, half, 0], material: steel}]}
frames: {"end_{part}": {link: "rod_{part}", place: end}}
motors: {"swing_{part}": {armature: 0.001*length}}
)";
  const std::string robot = R"(parameters:
  span: {value: 0.5, unit: m, bounds: [0.1, 1], help: length}
  kind: {value: part, choices: [part], help: which}
let: {crank: span/5, rod: 3*crank}
tree:
  trunk: {solids: [{sphere: 0.1, mass: 5}, {cylinder: [0.1, span], axis: z, density: 3, color: frame, when: 1}]}
  slide: {parent: trunk, joint: slide, type: prismatic, axis: x, place: [rod + crank, 0, 0], solids: [{box: [0.1, 0.1, 0.1], mass: 1}]}
  upper: {part: "{kind}", prefix: upper_, role: arm, sides: [_left, _right], mounts: {base: trunk}, set: {at: 0.2*y, length: span}}
  lower: {part: "{kind}", prefix: lower_, sides: [_left, _right], mounts: {base: "rod_upper{side}"}, set: {at: -span*z, length: span/2}}
linkage:
  base: trunk
  density: 1
  points: {pivot: [0, 0], end: [crank, 0], pin: [crank + rod, 0]}
  fixed: {trunk: [pivot], slide: [pin]}
  bars: {crank: [pivot, end], rod: {points: [end, pin], radius: 0.01}}
  hinges: {pivot: motor}
motors: {motor: {armature: 0.001}}
roles: {arm: {armature: 0.1}}
references: {start: {joints: {motor: 0.1}, height: {frame: trunk, value: 1 + span}}}
)";
  const RobotDirectory directory;
  std::map<Trial, int> count;
  std::map<std::string, int> said;
  for (int i = 0; i < kTrials; ++i) {
    Random rng(i);
    const bool in_part = choose(rng, 2);
    directory.write("part.yaml", in_part ? mutate(part, rng) : part);
    const std::string file = directory.write("robot.yaml", in_part ? robot : mutate(robot, rng));
    CAPTURE(i, in_part);
    try {
      const Model model = loadRobot(file).model;
      CHECK(findWrong(model) == "");
      ++count[Trial::Valid];
    } catch (const InputError& error) {
      INFO(error.what());
      CHECK(isClear(error.what(), directory.path()));
      ++count[Trial::Refused];
      ++said[error.remedy()];
    }
  }
  std::cout << kTrials << " mutated robots of parts: " << count[Trial::Valid] << " models, " << count[Trial::Refused]
            << " refused with " << said.size() << " different remedies\n";
  CHECK(count[Trial::Valid] > kTrials / 20);
  CHECK(count[Trial::Refused] > kTrials / 4);
  CHECK(said.size() > 30);
}

TEST_CASE("Mutated SDF files are models or clear errors") {
  constexpr int kTrials = 600;  // libsdformat takes its time
  std::vector<std::string> files;
  for (const char* name : {"fourbar", "fivebar_leg", "belt_biped"}) {
    const Model model = loadRobot(BIELLE_SOURCE_DIR "/robots/" + std::string(name)).model;
    files.push_back(formatSdf(model, findClosedConfiguration(model).q).xml);
  }
  const RobotDirectory directory;
  std::map<Trial, int> count;
  for (int i = 0; i < kTrials; ++i) {
    Random rng(i);
    const std::string path =
        directory.write("robot.sdf", mutate(files[choose(rng, static_cast<int>(files.size()))], rng));
    const TrialResult result = tryRobot(path);
    ++count[result.trial];
    CAPTURE(i, result.message);
    CHECK(result.trial != Trial::Wrong);
  }
  std::cout << kTrials << " mutated SDF files: " << count[Trial::Valid] << " models, " << count[Trial::Refused]
            << " refused\n";
  CHECK(count[Trial::Refused] > kTrials / 4);
}
