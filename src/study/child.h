#pragma once
// Child processes: started, waited for together with the signals of the user, and never left behind.
#include <signal.h>
#include <sys/types.h>

#include <string>
#include <vector>

namespace bielle::study {

// Starts a program (arguments[0] is its path) with both outputs in the file `log` and nothing to read. It is in a group
// of its own, so that Ctrl-C does not reach it, and dies with its parent, however that ends.
// \throws ModelError when there can be no new process
pid_t startChild(const std::vector<std::string>& arguments, const std::string& log);

struct ChildEnd {
  pid_t pid = 0;
  int status = 0;  // of the exit, or 128 + the signal that ended it
};

// While it lives, SIGINT, SIGTERM and SIGCHLD are not delivered but waited for. Children get the signals back that were
// there before.
class SignalWatch {
 public:
  SignalWatch();
  ~SignalWatch();
  SignalWatch(const SignalWatch&) = delete;
  SignalWatch& operator=(const SignalWatch&) = delete;

  // Sleeps until one of the signals comes; true if the user asks for the end.
  bool wait();
  // The children that have ended since the last call, without waiting.
  static std::vector<ChildEnd> collect();

 private:
  sigset_t watched_;
  sigset_t before_;
};

// Ends a child at once and waits until it is gone.
void killChild(pid_t pid);

}  // namespace bielle::study
