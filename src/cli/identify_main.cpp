// bielle-identify: what logs of a robot tell about it.
#include "cli/program.h"

int main(int argc, char** argv) {
  using namespace bielle::cli;
  return runProgram(argc, argv, {{"identify", &addIdentify}});
}
