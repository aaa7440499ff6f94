#include "tasks/child.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/signalfd.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "bielle/model/error.h"
#include "formats/process.h"

namespace bielle::tasks {
namespace {

struct OpenFile {
  ~OpenFile() { close(file); }
  int file;
};

// By which the user asks for the end.
sigset_t getEndSignals() {
  sigset_t signals;
  sigemptyset(&signals);
  for (const int number : {SIGINT, SIGTERM}) sigaddset(&signals, number);
  return signals;
}

}  // namespace

pid_t startChild(const std::vector<std::string>& arguments, const std::string& log) {
  const OpenFile in{open("/dev/null", O_RDONLY | O_CLOEXEC)};
  const OpenFile out{open(log.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644)};
  return startProcess(arguments, {in.file, out.file, out.file, true});  // without a log it is not started
}

PipedChild startPipedChild(const std::vector<std::string>& arguments) {
  int in[2], out[2];
  if (pipe2(in, O_CLOEXEC) != 0) throw InputError("", "new pipe", std::strerror(errno), "close other files");
  if (pipe2(out, O_CLOEXEC) != 0) {
    close(in[0]), close(in[1]);
    throw InputError("", "new pipe", std::strerror(errno), "close other files");
  }
  PipedChild child{0, in[1], out[0]};
  try {
    child.pid = startProcess(arguments, {in[0], out[1], STDERR_FILENO, true});
  } catch (...) {
    for (const int file : {in[0], in[1], out[0], out[1]}) close(file);
    throw;
  }
  close(in[0]), close(out[1]);
  return child;
}

SignalWatch::SignalWatch() {
  signal(SIGCHLD, SIG_DFL);  // if ignored, children would leave no status
  watched_ = getEndSignals();
  sigaddset(&watched_, SIGCHLD);
  sigprocmask(SIG_BLOCK, &watched_, &before_);
}

SignalWatch::~SignalWatch() { sigprocmask(SIG_SETMASK, &before_, nullptr); }

bool SignalWatch::wait() {
  int number = 0;
  while (sigwait(&watched_, &number) != 0) {
  }
  return number != SIGCHLD;
}

bool SignalWatch::waitForFile(int file) {
  const sigset_t asked = getEndSignals();
  const int signals = signalfd(-1, &asked, SFD_CLOEXEC);
  pollfd files[] = {{file, POLLIN, 0}, {signals, POLLIN, 0}};
  while (poll(files, 2, -1) < 0 && errno == EINTR) {
  }
  signalfd_siginfo taken;  // else it would be delivered when signals are no longer blocked
  const bool is_asked = files[1].revents != 0 && read(signals, &taken, sizeof taken) > 0;
  close(signals);
  return is_asked;
}

std::optional<int> SignalWatch::waitForChild(pid_t pid) {
  int state = 0;
  while (waitpid(pid, &state, WNOHANG) == 0)
    if (wait()) {
      killChild(pid);
      return std::nullopt;
    }
  return getStatus(state);
}

bool SignalWatch::isEndAsked() {
  const sigset_t asked = getEndSignals();
  const timespec now{};
  return sigtimedwait(&asked, nullptr, &now) > 0;
}

std::vector<ChildEnd> SignalWatch::collect() {
  std::vector<ChildEnd> ends;
  int state = 0;
  for (pid_t pid = waitpid(-1, &state, WNOHANG); pid > 0; pid = waitpid(-1, &state, WNOHANG))
    ends.push_back({pid, getStatus(state)});
  return ends;
}

void killChild(pid_t pid) {
  kill(pid, SIGKILL);
  waitForProcess(pid);
}

}  // namespace bielle::tasks
