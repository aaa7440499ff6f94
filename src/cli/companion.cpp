// The programs that use physics engines, installed beside `bielle`: bielle-validate, bielle-check, bielle-simulate.
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <iostream>

#include "cli/commands.h"

extern char** environ;

namespace bielle::cli {

std::string findCompanion(const std::string& program) {
  std::error_code error;
  const std::filesystem::path self = std::filesystem::read_symlink("/proc/self/exe", error);
  const std::filesystem::path beside = self.parent_path() / program;
  return !error && access(beside.c_str(), X_OK) == 0 ? beside.string() : program;
}

void addCompanions(CLI::App& app) {
  app.add_subcommand("validate", "Compare the dynamics with Simbody's (see bielle validate --help)");
  app.add_subcommand("check", "Check a motion's files with Simbody (see bielle check --help)");
  app.add_subcommand("simulate", "Execute a motion in a physics simulation with contact (see bielle simulate --help)");
}

int becomeCompanion(const std::string& name, char** arguments) {
  std::string program = findCompanion(name);
  arguments[0] = program.data();
  execvp(program.c_str(), arguments);
  std::cerr << "bielle: error: " << name << " is neither beside this program nor on the PATH; build Bielle with "
            << (name == "bielle-simulate" ? "-DBIELLE_BUILD_SIMULATION=ON" : "-DBIELLE_BUILD_VALIDATION=ON")
            << " (it needs Simbody)" << std::endl;
  return kBadInput;
}

std::optional<int> runCompanion(const std::string& name, std::vector<std::string> arguments) {
  std::string program = findCompanion(name);
  std::vector<char*> argv = {program.data()};
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  std::cout.flush();
  pid_t child = 0;
  const auto fail = [&name](const std::string& why) {
    std::cerr << "bielle: error: " << name << " " << why << std::endl;
    return kFailed;
  };
  const int error = posix_spawnp(&child, program.c_str(), nullptr, nullptr, argv.data(), environ);
  if (error == ENOENT && program == name) return {};  // beside this program it exists
  if (error != 0) return fail(std::string("could not be started: ") + std::strerror(error));
  int status = 0;
  while (waitpid(child, &status, 0) < 0)
    if (errno != EINTR) return fail(std::string("was lost: ") + std::strerror(errno));
  if (WIFEXITED(status)) return WEXITSTATUS(status);
  return fail("was terminated by signal " + std::to_string(WTERMSIG(status)));
}

}  // namespace bielle::cli
