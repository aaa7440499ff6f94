/// \file Bipetto walks: footholds first, then everything else.
///
/// A speed of v m/s, with steps of duration T, moves the middle of the feet by v T per step, which determines the
/// foothold of every step. Carried by one foot at p, a mass at a constant height z over it moves like an inverted
/// pendulum,
///     c'' = g / z (c - p).                                                                                     (1)
/// It is unstable: only one of its motions stays near a given sequence of p. gait.h finds it by a tridiagonal system.
/// The robot is not such a pendulum, because its legs swing and have masses; so (1) is a reference, and the dynamics
/// with 6 closed loops are a constraint:
///     min over u   sum_k h l_k(x_k, u_k, lambda_k) + l_N(x_N)    s.t.   x_{k+1} = f_k(x_k, u_k),               (2)
/// where the feet on the ground in f_k are those of the schedule at stage k, and l_k makes the centre of mass follow
/// (1), the swing foot follow its path, stance feet carry their share in the middle of their soles, and the torso stay
/// upright. We solve (2), and compare speed, footholds and the path of the centre of mass with the requested ones.
///
/// Usage: 03_walk [DIRECTORY [SPEED [STEPS]]]   writes trajectory.csv, trajectory.npz and summary.json
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <iostream>

#include "bielle/dynamics/kinematics.h"
#include "bielle/motion/walk.h"
#include "bielle/results/result.h"
#include "bielle/robots/robot_loader.h"

using namespace bielle;

namespace {

// Position of each foot in every phase, and its distance from the foothold.
double printFootholds(const Motion& motion, const ShootingTrajectory& trajectory) {
  const Model& model = motion.problem->model();
  Workspace ws(model);
  std::printf("\n%7s  %-14s %-10s %9s %9s %13s\n", "t [s]", "phase", "foot", "x [m]", "y [m]", "off by [mm]");
  double worst = 0;
  int k = 0;
  for (const ContactPhase& phase : motion.schedule.phases) {
    updatePositions(model, ws, trajectory.xs[k].head(model.nq()));
    for (const ContactTarget& target : phase.contacts) {
      const ContactFrame& foot = model.contacts()[target.contact];
      const Vector3d p = getPlacement(ws, foot.body, foot.X_BF).p;
      const double error = (p - target.X_WT.p).norm();
      std::printf("%7.3f  %-14s %-10s %9.4f %9.4f %13.3f\n", motion.schedule.getTime(k), phase.name.c_str(),
                  foot.name.c_str(), p.x(), p.y(), 1e3 * error);
      worst = std::max(worst, error);
    }
    k += phase.nodes;
  }
  return worst;
}

// Mean velocity of the centre of mass between the ends of two steps, counted from the first one.
double calcSpeed(const Motion& motion, const MotionRecord& record, int first, int last) {
  int k = 0, step = 0, from = 0, to = 0;
  for (const ContactPhase& phase : motion.schedule.phases) {
    if (k > 0 && phase.contacts.size() == 2) {
      if (step == first) from = k;
      if (step == last) to = k;
      ++step;
    }
    k += phase.nodes;
  }
  return (record.com(to, 0) - record.com(from, 0)) / (record.time[to] - record.time[from]);
}

}  // namespace

int main(int argc, char** argv) {
  const std::string directory = argc > 1 ? argv[1] : "walk";
  WalkOptions options;
  if (argc > 2) options.speed = std::atof(argv[2]);
  if (argc > 3) options.steps = std::atoi(argv[3]);

  const LoadedRobot robot = loadRobot("bipetto");
  const Motion motion = makeWalk(robot.model, options);
  std::printf("%d stages, %zu phases, steps of %.3f m every %.3f s\n", motion.problem->numStages(),
              motion.schedule.phases.size(), options.speed * options.gait.timing.stepDuration(),
              options.gait.timing.stepDuration());

  SolveObserver observer;
  observer.motion.callback = makeFddpPrinter(std::cout);
  const Solution solution = solve(motion, {}, observer);
  const FddpSummary& summary = solution.summary;
  const MotionResult result = makeResult({"bipetto", robot.file, {}}, solution);

  const double worst = printFootholds(motion, solution.trajectory);
  const int steps = static_cast<int>(options.steps);
  if (steps >= 5)  // the first two and the last two are not steady
    std::printf("\n%.4f m/s requested, %.4f m/s walked\n", options.speed,
                calcSpeed(motion, result.record, 1, steps - 3));
  std::printf("%s after %d iterations and %.2f s, feet within %.2f mm of their footholds, slip %.2f mm\n",
              getName(summary.termination), summary.iterations, summary.seconds, 1e3 * worst,
              1e3 * result.slip_position);
  for (const std::string& path : writeResult(directory, result)) std::printf("%s\n", path.c_str());
  return result.converged() ? 0 : 1;
}
