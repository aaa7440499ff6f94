#include "formats/companion.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <thread>

#include "bielle/model/error.h"
#include "formats/process.h"

namespace fs = std::filesystem;

namespace bielle {
namespace {

fs::path getOwnDirectory() {
  std::error_code error;
  return fs::read_symlink("/proc/self/exe", error).parent_path();
}

// The build tree whose programs stand beside this one, if it can build this one (cmake/install.cmake); otherwise empty.
fs::path findBuildTree(const std::string& program) {
  const fs::path build = getOwnDirectory().parent_path();
  std::ifstream list(build / "companions.txt");
  for (std::string line; std::getline(list, line);)
    if (line == program) return build;
  return {};
}

// As many compilers as there are cores and memory for, at 1.5 GB each.
int countJobs() {
  int jobs = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  std::ifstream memory("/proc/meminfo");
  std::string key, unit;
  for (long kilobytes = 0; memory >> key >> kilobytes && std::getline(memory, unit);)
    if (key == "MemAvailable:") jobs = std::min(jobs, static_cast<int>(kilobytes / 1500000));
  return std::max(jobs, 1);
}

bool exists(const std::string& path) { return path.find('/') != std::string::npos || isOnPath(path); }

// Held until it is closed, or the programs that inherit it have ended.
int lock(const fs::path& build) {
  const int file = open((build / "companions.lock").c_str(), O_RDWR | O_CREAT, 0644);
  if (file >= 0 && flock(file, LOCK_EX | LOCK_NB) != 0) {
    std::cerr << "bielle: waiting for another call that builds in " << build.string() << "\n";
    flock(file, LOCK_EX);
  }
  return file;
}

void build(const std::string& program, const fs::path& tree) {
  const auto start = std::chrono::steady_clock::now();
  std::cerr << "bielle: building " << program << ", which is not in " << tree.string() << " yet; this happens once\n";
  setenv("NINJA_STATUS", "[%f of %t, %e s] ", 0);
  ProcessOptions options;
  options.out = STDERR_FILENO;
  const int status = waitForProcess(startProcess(
      {"cmake", "--build", tree.string(), "--parallel", std::to_string(countJobs()), "--target", program}, options));
  const auto seconds =
      std::chrono::duration_cast<std::chrono::seconds>(std::chrono::steady_clock::now() - start).count();
  if (status == 0)
    std::cerr << "bielle: built " << program << " in " << seconds << " s\n";
  else
    std::cerr << "bielle: building " << program << " ended after " << seconds
              << " s (see above); what is built is kept, and the next call goes on from there\n";
}

constexpr const char* kMissing = "is neither beside this program nor on the PATH";

std::string findRemedy(const std::string& program) {
  static const std::map<std::string, std::string> builds = {
      {"bielle-check", "build Bielle with -DBIELLE_BUILD_VALIDATION=ON (it needs Simbody)"},
      {"bielle-dxf", "it is a part of Bielle: install that again, or run cmake in its build tree, which puts it there"},
      {"bielle-identify", "build Bielle where Ceres is (Debian: libceres-dev)"},
      {"bielle-simulate", "build Bielle with -DBIELLE_BUILD_SIMULATION=ON (it needs Simbody)"},
      {"bielle-step",
       "build Bielle where OpenCASCADE is (Debian: libocct-data-exchange-dev, libocct-modeling-algorithms-dev, "
       "libocct-ocaf-dev)"},
      {"bielle-validate", "build Bielle with -DBIELLE_BUILD_VALIDATION=ON (it needs Simbody)"},
      {"bielle-workers",
       "install the packages coop-computing-tools and coop-computing-tools-dev, and build Bielle again"}};
  const auto build = builds.find(program);
  return build != builds.end() ? build->second
                               : "it is a part of Bielle: install that again, or build its target " + program;
}

}  // namespace

std::string findCompanion(const std::string& program) {
  const fs::path beside = getOwnDirectory() / program;
  return access(beside.c_str(), X_OK) == 0 ? beside.string() : program;
}

std::string obtainCompanion(const std::string& program) {
  std::string path = findCompanion(program);
  if (exists(path)) return path;
  const fs::path tree = findBuildTree(program);
  if (tree.empty()) return "";
  const int file = lock(tree);
  if (path = findCompanion(program); !exists(path)) build(program, tree);
  close(file);
  path = findCompanion(program);
  return exists(path) ? path : "";
}

std::string requireCompanion(const std::string& program) {
  std::string path = obtainCompanion(program);
  if (path.empty()) throw InputError("", program, std::string("it ") + kMissing, findRemedy(program));
  return path;
}

std::string describeMissingCompanion(const std::string& program) {
  return program + " " + kMissing + "; " + findRemedy(program);
}

}  // namespace bielle
