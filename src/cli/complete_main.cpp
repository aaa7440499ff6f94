// bielle-complete: everything that a single process does, linked with the whole library.
#include "cli/program.h"

int main(int argc, char** argv) {
  using namespace bielle::cli;
  return runProgram(argc, argv,
                    {{"solve", &addSolve},
                     {"report", &addReport},
                     {"view", &addView},
                     {"export", &addExport},
                     {"convert", &addConvert},
                     {"adopt", &addAdopt},
                     {"info", &addInfo},
                     {"eval", &addEval},
                     {"robots", &addRobots},
                     {"generate", &addGenerate},
                     {"ratio", &addRatio},
                     {"modes", &addModes},
                     {"softness", &addSoftness},
                     {"lift", &addLift}});
}
