// bielle-design: lengths, motors and linkages chosen by optimization.
#include "cli/program.h"

int main(int argc, char** argv) {
  using namespace bielle::cli;
  return runProgram(argc, argv, {{"design", &addDesign}, {"synthesize", &addSynthesize}});
}
