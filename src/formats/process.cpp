#include "formats/process.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <sstream>

#include "bielle/model/error.h"

namespace bielle {
namespace {

using Clock = std::chrono::steady_clock;

bool becomeFile(int file, int standard) { return file == standard || dup2(file, standard) >= 0; }

// From the fork to the new program: calls that are safe there only. (posix_spawn() cannot ask for PR_SET_PDEATHSIG.)
[[noreturn]] void becomeProgram(char** argv, pid_t parent, const ProcessOptions& options) {
  if (options.apart) {
    setpgid(0, 0);
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() != parent) _exit(kNotStarted);  // it ended before the call
    sigset_t none;
    sigemptyset(&none);
    sigprocmask(SIG_SETMASK, &none, nullptr);
  }
  if (becomeFile(options.in, STDIN_FILENO) && becomeFile(options.out, STDOUT_FILENO) &&
      becomeFile(options.error, STDERR_FILENO))
    execvp(argv[0], argv);
  _exit(kNotStarted);
}

// Reads until the end of the output; false if the deadline passes first.
bool readAll(int file, Clock::time_point deadline, std::string& out) {
  char buffer[65536];
  while (true) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Clock::now()).count();
    pollfd entry = {file, POLLIN, 0};
    if (left <= 0 || poll(&entry, 1, static_cast<int>(left)) <= 0) return false;
    const ssize_t count = read(file, buffer, sizeof buffer);
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

pid_t startProcess(const std::vector<std::string>& arguments, const ProcessOptions& options) {
  std::vector<std::string> copy = arguments;
  std::vector<char*> argv;
  for (std::string& argument : copy) argv.push_back(argument.data());
  argv.push_back(nullptr);
  const pid_t parent = getpid(), child = fork();
  if (child == 0) becomeProgram(argv.data(), parent, options);
  if (child < 0) throw InputError("", "new process", std::strerror(errno), "end other processes");
  return child;
}

int getStatus(int state) { return WIFEXITED(state) ? WEXITSTATUS(state) : kSignalled + WTERMSIG(state); }

int waitForProcess(pid_t pid) {
  int state = 0;
  while (waitpid(pid, &state, 0) < 0)
    if (errno != EINTR) return kNotStarted;
  return getStatus(state);
}

ProcessOutput runProcess(const std::vector<std::string>& arguments, double seconds) {
  const auto deadline =
      Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
  const int none = open("/dev/null", O_RDWR | O_CLOEXEC);
  int ends[2] = {-1, -1};
  ProcessOutput result;
  if (pipe2(ends, O_CLOEXEC) == 0) {
    const pid_t pid = startProcess(arguments, {none, ends[1], none, true});
    close(ends[1]);
    if (!readAll(ends[0], deadline, result.out)) kill(-pid, SIGKILL);
    close(ends[0]);
    result.status = waitForProcess(pid);
  }
  close(none);
  return result;
}

}  // namespace bielle
