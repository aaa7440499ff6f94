#pragma once
// The command `bielle simulate` in tests.
#include <catch2/catch.hpp>
#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "robot_directory.h"
#include "run_command.h"

namespace bielle::testing {

// A directory for the time of a test.
struct Scratch {
  Scratch() {
    std::string pattern = (std::filesystem::temp_directory_path() / "bielle_simulate_XXXXXX").string();
    path = mkdtemp(pattern.data());
  }
  ~Scratch() { std::filesystem::remove_all(path); }
  std::filesystem::path path;
};

inline nlohmann::json parseSummary(const std::filesystem::path& directory) {
  return nlohmann::json::parse(readFile(directory / "summary.json"));
}

// A motion of Bipetto, kept while the program runs.
inline std::string solveMotion(const std::string& motion, const std::vector<std::string>& options) {
  static const Scratch scratch;
  const std::string directory = (scratch.path / motion).string();
  std::vector<std::string> arguments = {
      BIELLE_COMMAND, "solve",   motion,    "--robot",     BIELLE_SOURCE_DIR "/robots/bipetto",
      "-o",           directory, "--quiet", "--no-report", "--no-check"};
  arguments.insert(arguments.end(), options.begin(), options.end());
  const CommandResult solved = runCommand(arguments);
  CAPTURE(solved.err);
  REQUIRE(solved.status == 0);
  return directory;
}

// A walk of two steps, solved once.
inline const std::string& getWalk() {
  static const std::string walk = solveMotion("walk", {"--speed", "0.4", "--steps", "2"});
  return walk;
}

// A squat of 40 stages, whose gains are found at once.
inline const std::string& getSquat() {
  static const std::string squat = solveMotion(
      "squat", {"--depth", "0.9", "--set", "duration=0.6", "--set", "settle=0.1", "--set", "time_step=0.02"});
  return squat;
}

inline CommandResult simulate(const std::string& output, std::vector<std::string> options,
                              const std::string& motion = getWalk()) {
  std::vector<std::string> arguments = {BIELLE_COMMAND, "simulate", motion, "-o", output};
  arguments.insert(arguments.end(), options.begin(), options.end());
  return runCommand(arguments);
}

}  // namespace bielle::testing
