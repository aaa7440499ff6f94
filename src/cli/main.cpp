// bielle: the core: motions of robots from Bielle's own files.
#include "cli/program.h"

int main(int argc, char** argv) {
  using namespace bielle::cli;
  return runProgram(argc, argv,
                    {{"solve", &addSolve}, {"report", &addReport}, {"info", &addInfo}, {"robots", &addRobots}});
}
