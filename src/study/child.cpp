#include "study/child.h"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "bielle/model/error.h"

namespace bielle::study {
namespace {

// From the fork to the new program: calls that are safe there only.
[[noreturn]] void becomeProgram(char** argv, const char* log, pid_t parent) {
  setpgid(0, 0);
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(127);  // it ended before the call
  sigset_t none;
  sigemptyset(&none);
  sigprocmask(SIG_SETMASK, &none, nullptr);
  dup2(open("/dev/null", O_RDONLY), STDIN_FILENO);
  const int out = open(log, O_WRONLY | O_CREAT | O_TRUNC, 0644);
  if (out < 0) _exit(127);
  dup2(out, STDOUT_FILENO);
  dup2(out, STDERR_FILENO);
  execv(argv[0], argv);
  _exit(127);
}

}  // namespace

pid_t startChild(const std::vector<std::string>& arguments, const std::string& log) {
  std::vector<std::string> copy = arguments;
  std::vector<char*> argv;
  for (std::string& argument : copy) argv.push_back(argument.data());
  argv.push_back(nullptr);
  const pid_t parent = getpid(), child = fork();
  if (child == 0) becomeProgram(argv.data(), log.c_str(), parent);
  if (child < 0) throw ModelError("", "new process", std::strerror(errno), "run fewer jobs");
  return child;
}

SignalWatch::SignalWatch() {
  signal(SIGCHLD, SIG_DFL);  // if ignored, children would leave no status
  sigemptyset(&watched_);
  for (const int number : {SIGINT, SIGTERM, SIGCHLD}) sigaddset(&watched_, number);
  sigprocmask(SIG_BLOCK, &watched_, &before_);
}

SignalWatch::~SignalWatch() { sigprocmask(SIG_SETMASK, &before_, nullptr); }

bool SignalWatch::wait() {
  int number = 0;
  while (sigwait(&watched_, &number) != 0) {
  }
  return number != SIGCHLD;
}

std::vector<ChildEnd> SignalWatch::collect() {
  std::vector<ChildEnd> ends;
  int state = 0;
  for (pid_t pid = waitpid(-1, &state, WNOHANG); pid > 0; pid = waitpid(-1, &state, WNOHANG))
    ends.push_back({pid, WIFEXITED(state) ? WEXITSTATUS(state) : 128 + WTERMSIG(state)});
  return ends;
}

void killChild(pid_t pid) {
  kill(pid, SIGKILL);
  while (waitpid(pid, nullptr, 0) < 0 && errno == EINTR) {
  }
}

}  // namespace bielle::study
