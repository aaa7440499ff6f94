// bielle-tasks: many runs.
#include "cli/program.h"

int main(int argc, char** argv) {
  using namespace bielle::cli;
  return runProgram(argc, argv, {{"compare", &addCompare}, {"campaign", &addCampaign}, {"dataset", &addDataset}});
}
