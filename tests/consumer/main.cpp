// Loads an installed robot and solves a squat of few nodes.
#include <bielle/bielle.h>

#include <cstdio>
#include <cstdlib>
#include <string>

#include "bielle/robots/robot_loader.h"

int main(int argc, char** argv) {
  setenv("BIELLE_ROBOTS", ROBOTS, 1);
  const bielle::LoadedRobot robot = bielle::loadRobot("bipetto");
  if (robot.directory.rfind(ROBOTS, 0) != 0) {
    std::fprintf(stderr, "the robot is that of %s\n", robot.directory.c_str());
    return 1;
  }
  bielle::SquatOptions options;
  options.depth = 0.95;
  options.duration = 0.6;
  options.settle = 0;
  options.time_step = 0.02;
  const bielle::Solution solution = bielle::solve(bielle::makeSquat(robot.model, options));
  const bielle::MotionResult result = bielle::makeResult({"bipetto", {}}, solution);
  bielle::writeResult(argc > 1 ? argv[1] : "squat", result);
  std::printf("%s after %d iterations, lowest at %.4f m\n", getName(solution.summary.termination),
              solution.summary.iterations, result.com_lowest);
  return result.converged() ? 0 : 1;
}
