#pragma once
// Runs a program and captures its output.
#include <sys/types.h>

#include <string>
#include <vector>

namespace bielle::testing {

struct CommandResult {
  int status = -1;  // of the exit, or 128 + the signal that ended it
  std::string out, err;
};

// A program that has been started; its outputs go to files.
class Command {
 public:
  // The first argument is the program. `input` is its standard input.
  explicit Command(const std::vector<std::string>& arguments, const std::string& input = "");
  ~Command();
  Command(const Command&) = delete;
  Command& operator=(const Command&) = delete;

  // Whether the text appears in the standard output before the deadline (or the end of the program).
  bool waitForOutput(const std::string& text, double seconds);
  void sendSignal(int signal);
  CommandResult wait();

 private:
  std::string directory_;
  pid_t pid_ = -1;
};

CommandResult runCommand(const std::vector<std::string>& arguments, const std::string& input = "");

}  // namespace bielle::testing
