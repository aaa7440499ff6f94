#pragma once
// The command, run like a user does.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "bielle/results/result.h"
#include "run_bielle.h"

namespace bielle::testing {

// Bad input: status 2, nothing on the standard output, one line of error.
inline void checkRefused(const CommandResult& result, const std::string& text) {
  INFO(result.err);
  CHECK(result.status == 2);
  CHECK(result.out.empty());
  CHECK(result.err.rfind("bielle: error: ", 0) == 0);
  CHECK(result.err.find('\n') == result.err.size() - 1);
  CHECK_THAT(result.err, Catch::Contains(text));
}

class OutputDirectory {
 public:
  OutputDirectory() {
    std::string pattern = (std::filesystem::temp_directory_path() / "bielle_cli_XXXXXX").string();
    path_ = mkdtemp(pattern.data());
  }
  ~OutputDirectory() { std::filesystem::remove_all(path_); }
  std::string str() const { return (path_ / "result").string(); }
  nlohmann::json readSummary() const { return nlohmann::json::parse(std::ifstream(path_ / "result/summary.json")); }
  // The three files, the two of the robot, the report and no other; the CSV has a line for every node and the header.
  MotionRecord readTrajectory() const {
    CHECK(std::distance(std::filesystem::directory_iterator(path_ / "result"), std::filesystem::directory_iterator()) ==
          6);
    MotionRecord record = readRecord(str() + "/trajectory.npz");
    std::ifstream csv(str() + "/trajectory.csv");
    CHECK(std::count(std::istreambuf_iterator<char>(csv), {}, '\n') == record.time.size() + 1);
    return record;
  }

 private:
  std::filesystem::path path_;
};

inline const std::vector<std::string> kShortSquat = {"solve",        "squat", "--robot",    "bipetto", "--set",
                                                     "duration=0.6", "--set", "settle=0",   "--set",   "time_step=0.02",
                                                     "--depth",      "0.95",  "--no-check", "-o"};

inline std::vector<std::string> makeShortSquat(const std::string& directory,
                                               const std::vector<std::string>& more = {}) {
  std::vector<std::string> arguments = kShortSquat;
  arguments.push_back(directory);
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
}

}  // namespace bielle::testing
