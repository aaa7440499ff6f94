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

namespace {

// The program and its arguments until it ends: the value of wait(), or the error of posix_spawn().
struct Ended {
  int error = 0, status = 0;
};
Ended runProgram(const std::string& program, std::vector<std::string> arguments, bool quiet) {
  std::vector<char*> argv = {const_cast<char*>(program.c_str())};
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  std::cout.flush();
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  if (quiet) posix_spawn_file_actions_adddup2(&actions, STDERR_FILENO, STDOUT_FILENO);
  pid_t child = 0;
  Ended ended;
  ended.error = posix_spawnp(&child, program.c_str(), &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (ended.error != 0) return ended;
  while (waitpid(child, &ended.status, 0) < 0)
    if (errno != EINTR) return {errno, 0};
  return ended;
}

// Where this program was built and the other one was not, it is built: scripts/demo.sh builds only what its motion needs.
bool buildCompanion(const std::string& name) {
  std::error_code error;
  const std::filesystem::path build =
      std::filesystem::read_symlink("/proc/self/exe", error).parent_path().parent_path();
  if (error || !std::filesystem::exists(build / "CMakeCache.txt", error)) return false;
  std::cerr << "bielle: building " << name << ", which is not in " << build.string() << " yet; this happens once\n";
  const Ended ended = runProgram("cmake", {"--build", build.string(), "--target", name}, true);
  return ended.error == 0 && ended.status == 0;
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
  const auto [error, status] = runProgram(program, std::move(arguments), false);
  if (error == ENOENT && program == name) return {};  // beside this program it exists
  if (error != 0) return fail(std::string("cannot be started: ") + std::strerror(error));
  if (WIFEXITED(status)) return WEXITSTATUS(status);
  return fail("was terminated by signal " + std::to_string(WTERMSIG(status)));
}

}  // namespace bielle::cli
