/// \file Bipetto walks to some stairs, climbs them and jumps on top: three motions as one problem.
///
/// Motion i plans its stages from a standing posture q_i and is intended to end in another one, q_{i+1}. Alone it would
/// solve
///     min over u^i   sum_k l^i_k(x_k, u_k) + l^i_N(x_N)    s.t.   x_{k+1} = f_k(x_k, u_k),   x_0 = (q_i, 0).     (1)
/// In sequence the states in between are free and the terminal costs l^i_N are dropped, all but the last:
///     min over u     sum_i sum_k l^i_k(x_k, u_k) + l^last_N(x_N),   x_0 = (q_0, 0).                              (2)
/// This is less demanding, so that its optimum is below the total cost of the solutions of (1) with their terminal
/// costs; the difference is the cost of coming to rest in between. We print both.
///
/// Usage: 09_sequence [DIRECTORY [STAIRS]]   writes trajectory.csv, trajectory.npz and summary.json
#include <cstdio>
#include <cstdlib>
#include <iostream>

#include "bielle/motion/jump.h"
#include "bielle/motion/registry.h"
#include "bielle/motion/stairs.h"
#include "bielle/motion/walk.h"
#include "bielle/results/result.h"
#include "bielle/robots/robot_loader.h"

using namespace bielle;

int main(int argc, char** argv) {
  WalkOptions walk;
  walk.speed = 0.4;
  walk.steps = 4;
  StairsOptions stairs;
  stairs.height = 0.05;
  stairs.stairs = argc > 2 ? std::atoi(argv[2]) : 3;
  JumpOptions jump;
  jump.flight = 0.24;
  const std::vector<SequencePart> parts = {
      {"walk", [&](const Model& model, const StandingRobot& standing) { return planWalk(model, walk, standing); }},
      {"stairs",
       [&](const Model& model, const StandingRobot& standing) { return planStairs(model, stairs, standing); }},
      {"jump", [&](const Model& model, const StandingRobot& standing) { return planJump(model, jump, standing); }}};

  const LoadedRobot robot = loadRobot("bipetto");
  const Motion motion = makeSequence(robot.model, parts);
  double alone = 0;
  const auto report = [&](const std::string& part, const FddpSummary& summary) {
    std::printf("%-8s %-10s after %2d iterations, cost %9.5f\n", part.c_str(), getName(summary.termination),
                summary.iterations, summary.cost);
    alone += summary.cost;
  };
  SolveOptions options;
  options.start = StartingPoint{solveParts(robot.model, parts, makeStandingRobot(robot.model), {}, {}, {}, report)};
  SolveObserver observer;
  observer.motion.callback = makeFddpPrinter(std::cout);
  const Solution solution = solve(motion, options, observer);
  const FddpSummary& summary = solution.summary;
  const MotionResult result = makeResult({"bipetto", robot.file, {}}, solution);

  std::printf("\n%s after %d iterations and %.2f s: cost %.5f, one by one %.5f\n", getName(summary.termination),
              summary.iterations, summary.seconds, summary.cost, alone);
  int start = 0;
  for (const ContactPhase& phase : motion.schedule.phases) {
    std::printf("%8.3f s  %-24s CoM %.3f m high\n", result.record.time[start], phase.name.c_str(),
                result.record.com(start, 2));
    start += phase.nodes;
  }
  for (const std::string& path : writeResult(argc > 1 ? argv[1] : "sequence", result))
    std::printf("%s\n", path.c_str());
  return result.converged() && summary.cost < alone ? 0 : 1;
}
