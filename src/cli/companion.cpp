// The programs that use physics engines, installed beside `bielle`: bielle-validate, bielle-check, bielle-simulate.
#include <unistd.h>

#include <filesystem>
#include <iostream>

#include "cli/commands.h"
#include "formats/process.h"

namespace bielle::cli {

void addCompanions(CLI::App& app) {
  app.add_subcommand("validate", "Compare the dynamics with Simbody's (see bielle validate --help)");
  app.add_subcommand("check", "Check a motion's files with Simbody (see bielle check --help)");
  app.add_subcommand("simulate", "Execute a motion in a physics simulation with contact (see bielle simulate --help)");
}

namespace {

// Where this program was built and the other one was not, it is built: scripts/demo.sh builds only what its motion needs.
bool buildCompanion(const std::string& name) {
  std::error_code error;
  const std::filesystem::path build =
      std::filesystem::read_symlink("/proc/self/exe", error).parent_path().parent_path();
  if (error || !std::filesystem::exists(build / "CMakeCache.txt", error)) return false;
  std::cerr << "bielle: building " << name << ", which is not in " << build.string() << " yet; this happens once\n";
  ProcessOptions options;
  options.out = STDERR_FILENO;
  return waitForProcess(startProcess({"cmake", "--build", build.string(), "--target", name}, options)) == 0;
}

}  // namespace

int becomeCompanion(const std::string& name, char** arguments) {
  std::string program = findCompanion(name);
  arguments[0] = program.data();
  execvp(program.c_str(), arguments);
  if (buildCompanion(name)) {
    program = findCompanion(name);
    arguments[0] = program.data();
    execvp(program.c_str(), arguments);
  }
  std::cerr << "bielle: error: " << name << " is neither beside this program nor on the PATH; build Bielle with "
            << (name == "bielle-simulate" ? "-DBIELLE_BUILD_SIMULATION=ON" : "-DBIELLE_BUILD_VALIDATION=ON")
            << " (it needs Simbody)" << std::endl;
  return kBadInput;
}

std::optional<int> runCompanion(const std::string& name, std::vector<std::string> arguments) {
  const std::string program = findCompanion(name);
  const auto fail = [&name](const std::string& why) {
    std::cerr << "bielle: error: " << name << " " << why << std::endl;
    return kFailed;
  };
  if (program == name && !isOnPath(name)) return {};
  arguments.insert(arguments.begin(), program);
  std::cout.flush();
  const int status = waitForProcess(startProcess(arguments));
  if (status == kNotStarted) return fail("cannot be started");
  if (status > kSignalled) return fail("was terminated by signal " + std::to_string(status - kSignalled));
  return status;
}

}  // namespace bielle::cli
