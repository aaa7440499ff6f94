#include "cli/subprocess.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <sstream>

extern char** environ;

namespace bielle::cli {
namespace {

using Clock = std::chrono::steady_clock;

// Starts the program in its own process group, with its output in `descriptor`. 0: it could not be started.
pid_t start(const std::vector<std::string>& arguments, int descriptor) {
  std::vector<std::string> copy = arguments;
  std::vector<char*> argv;
  for (std::string& argument : copy) argv.push_back(argument.data());
  argv.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_adddup2(&actions, descriptor, STDOUT_FILENO);
  posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
  pid_t pid = 0;
  if (posix_spawnp(&pid, argv[0], &actions, &attributes, argv.data(), environ) != 0) pid = 0;
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&actions);
  return pid;
}

// Reads until the end of the output; false if the deadline passes first.
bool readAll(int descriptor, Clock::time_point deadline, std::string& out) {
  char buffer[65536];
  while (true) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Clock::now()).count();
    pollfd entry = {descriptor, POLLIN, 0};
    if (left <= 0 || poll(&entry, 1, static_cast<int>(left)) <= 0) return false;
    const ssize_t count = read(descriptor, buffer, sizeof buffer);
    if (count <= 0) return count == 0;
    out.append(buffer, static_cast<size_t>(count));
  }
}

}  // namespace

bool isOnPath(const std::string& program) {
  const char* variable = std::getenv("PATH");
  std::istringstream directories(variable ? variable : "");
  for (std::string directory; std::getline(directories, directory, ':');)
    if (access((std::filesystem::path(directory) / program).c_str(), X_OK) == 0) return true;
  return false;
}

SubprocessResult runSubprocess(const std::vector<std::string>& arguments, double seconds) {
  const auto deadline =
      Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
  int ends[2];
  SubprocessResult result;
  if (pipe2(ends, O_CLOEXEC) != 0) return result;
  const pid_t pid = start(arguments, ends[1]);
  close(ends[1]);
  const bool is_whole = pid > 0 && readAll(ends[0], deadline, result.out);
  close(ends[0]);
  if (pid <= 0) return result;
  if (!is_whole) kill(-pid, SIGKILL);
  int state = 0;
  waitpid(pid, &state, 0);
  if (is_whole && WIFEXITED(state)) result.status = WEXITSTATUS(state);
  return result;
}

}  // namespace bielle::cli
