#pragma once
// Another program, run to its end.
#include <string>
#include <vector>

namespace bielle::cli {

// Whether a program of this name is on the PATH.
bool isOnPath(const std::string& program);

struct SubprocessResult {
  int status = -1;  // exit status; -1: it could not be started, was ended by a signal, or timed out
  std::string out;  // its standard output
};
// Searches for the program on the PATH. Its standard error is discarded; after `seconds` it is killed.
SubprocessResult runSubprocess(const std::vector<std::string>& arguments, double seconds);

}  // namespace bielle::cli
