#pragma once
// Another program, run to its end.
#include <string>
#include <vector>

namespace bielle::cli {

// Whether a program of this name is on the PATH.
bool isOnPath(const std::string& program);

struct SubprocessResult {
  int status = -1;  // of the exit; -1: it could not be started, was ended by a signal, or had no more time
  std::string out;  // what it wrote on its standard output
};
// The program is looked for on the PATH. Its standard error goes nowhere; after `seconds` it is killed.
SubprocessResult runSubprocess(const std::vector<std::string>& arguments, double seconds);

}  // namespace bielle::cli
