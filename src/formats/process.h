#pragma once
// Other programs: started, awaited, heard.
#include <sys/types.h>

#include <string>
#include <vector>

namespace bielle {

// Whether a program of this name is on the PATH.
bool isOnPath(const std::string& program);

struct ProcessOptions {
  int in = 0, out = 1, error = 2;  // what become its standard files
  // In a separate process group, so that Ctrl-C does not reach it, with no signal blocked; it dies with its parent,
  // however that ends.
  bool apart = false;
};
// Starts a program, which is searched on the PATH unless arguments[0] has a slash.
// \throws InputError when there can be no new process
pid_t startProcess(const std::vector<std::string>& arguments, const ProcessOptions& options = {});

// How a process has ended, as shells tell it: the status of its exit, or 128 + the signal that ended it.
constexpr int kNotStarted = 127, kSignalled = 128;
// From what waitpid() tells.
int getStatus(int state);
// Waits for the end of a process.
int waitForProcess(pid_t pid);

struct ProcessOutput {
  int status = kNotStarted;
  std::string out;
};
// Runs a program apart, without input, and reads what it prints. Its errors are discarded; after `seconds` it is
// killed, with all processes of its group.
ProcessOutput runProcess(const std::vector<std::string>& arguments, double seconds);

}  // namespace bielle
