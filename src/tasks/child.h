#pragma once
// Child processes that are awaited together with the user's signals, and never left running.
#include <signal.h>
#include <sys/types.h>

#include <optional>
#include <string>
#include <vector>

namespace bielle::tasks {

// Starts a program apart (formats/process.h), with both outputs in the file `log` and no input.
// \throws InputError when there can be no new process
pid_t startChild(const std::vector<std::string>& arguments, const std::string& log);

// A program that is spoken with: what is written to `in` it reads, what it prints is read from `out`; its errors go where
// ours go.
struct PipedChild {
  pid_t pid = 0;
  int in = -1, out = -1;
};
// Otherwise as startChild.
PipedChild startPipedChild(const std::vector<std::string>& arguments);

struct ChildEnd {
  pid_t pid = 0;
  int status = 0;  // formats/process.h
};

// During its lifetime, SIGINT, SIGTERM and SIGCHLD are blocked and awaited. Children get the previous signal mask.
class SignalWatch {
 public:
  SignalWatch();
  ~SignalWatch();
  SignalWatch(const SignalWatch&) = delete;
  SignalWatch& operator=(const SignalWatch&) = delete;

  // Sleeps until one of the signals comes; true if the user asks for the end.
  bool wait();
  // Sleeps until the file can be read or has been closed; true if the user asks for the end before.
  bool waitForFile(int file);
  // Sleeps until a child has ended, and returns its status (ChildEnd); empty if the user asks for the end before, which
  // is also that of the child.
  std::optional<int> waitForChild(pid_t pid);
  // Whether the user has asked for the end, without waiting.
  static bool isEndAsked();
  // The children that have ended since the last call, without waiting.
  static std::vector<ChildEnd> collect();

 private:
  sigset_t watched_;
  sigset_t before_;
};

// Ends a child at once and waits until it is gone.
void killChild(pid_t pid);

}  // namespace bielle::tasks
