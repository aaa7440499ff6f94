// bielle-bench: measurements.
#include "cli/program.h"

int main(int argc, char** argv) {
  using namespace bielle::cli;
  return runProgram(argc, argv, {{"bench", &addBench}});
}
