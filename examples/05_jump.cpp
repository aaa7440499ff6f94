/// \file A jump of Bipetto: its height, its duration, and the load on the knees.
///
/// Off the ground, whatever the motors do, the centre of mass c of a robot of mass m follows a ballistic path:
///     c'' = -g e_z,    c_z(t) = c_z(0) + v0 t - g t^2 / 2.                                                      (1)
/// It returns to its initial height after T = 2 v0 / g. Requesting a time T in the air means requesting
///     v0 = g T / 2    and for a rise of    v0^2 / (2 g) = g T^2 / 8.                                          (2)
/// The push must provide m v0 within the time D that the feet remain on the ground, and so must press with
///     f / (m g) = 1 + v0 / (g D)                                                                              (3)
/// on average, within the range of the legs from folded to stretched. The optimal control problem is that of
/// 02_squat.cpp with changing contacts: there are none from take-off to touchdown. There is no impact: costs bring the
/// feet to rest at touchdown, so that the legs fold at the speed of the fall.
///
/// Usage: 05_jump [DIRECTORY [FLIGHT [LENGTH [TIME_STEP]]]]   seconds, metres, seconds; writes trajectory and summary
#include <cstdio>
#include <cstdlib>
#include <iostream>

#include "bielle/model/names.h"
#include "bielle/motion/jump.h"
#include "bielle/results/result.h"
#include "bielle/robots/robot_loader.h"

using namespace bielle;

namespace {

// A few nodes of every phase.
void printMotion(const MotionResult& result, const JumpOptions& options) {
  const MotionRecord& record = result.record;
  const int knee = findColumn(record.q_names, "knee_right"), motor = findColumn(record.u_names, "motor_knee_right");
  const int foot = findColumn(record.contact_names, "foot_right");
  std::printf("\n%8s %8s %10s %12s %11s %12s %14s\n", "", "t [s]", "CoM [m]", "planned [m]", "knee [rad]",
              "motor [N m]", "right sole [N]");
  int start = 0;
  for (const ContactPhase& phase : result.schedule.phases) {
    for (int i = 0; i < 4; ++i) {
      const int k = start + i * phase.nodes / 4;
      std::printf("%8s %8.3f %10.4f %12.4f %11.4f %12.3f %14.2f\n", i == 0 ? phase.name.c_str() : "", record.time[k],
                  record.com(k, 2), record.com(0, 2) + calcJumpHeight(options, 9.81, record.time[k]).height,
                  record.q(k, knee), record.u(k, motor), record.contact_wrenches(k, 6 * foot + 2));
    }
    start += phase.nodes;
  }
}

// Eq. (1) at three nodes of the flight: the second difference of the height over a quarter of it.
double calcFallAcceleration(const MotionResult& result) {
  int start = 0, nodes = 0;
  for (const ContactPhase& phase : result.schedule.phases) {
    if (phase.contacts.empty()) {
      nodes = phase.nodes;
      break;
    }
    start += phase.nodes;
  }
  const int step = nodes / 4, middle = start + nodes / 2;
  const auto height = [&](int k) { return result.record.com(k, 2); };
  const double dt = result.schedule.getTime(step);
  return (height(middle - step) - 2 * height(middle) + height(middle + step)) / (dt * dt);
}

}  // namespace

int main(int argc, char** argv) {
  const std::string directory = argc > 1 ? argv[1] : "jump";
  JumpOptions options;
  if (argc > 2) options.flight = std::atof(argv[2]);
  if (argc > 3) options.length = std::atof(argv[3]);
  if (argc > 4) options.time_step = std::atof(argv[4]);

  const LoadedRobot robot = loadRobot("bipetto");
  const JumpFigures figures = calcJumpFigures(options, robot.model.gravity().norm());
  std::printf("%.3f s in the air: take-off at %.3f m/s, rise of %.4f m, %.2f times the weight on average to push off\n",
              figures.flight, figures.take_off, figures.rise,
              1 + figures.take_off / (robot.model.gravity().norm() * figures.push));
  const Motion motion = makeJump(robot.model, options);

  SolveObserver observer;
  observer.motion.callback = makeFddpPrinter(std::cout);
  const Solution solution = solve(motion, {}, observer);
  const FddpSummary& summary = solution.summary;
  const MotionResult result = makeResult({"bipetto", robot.file, {}}, solution);
  printMotion(result, options);

  std::printf("\n%s after %d iterations and %.2f s; falls with %.3f m/s^2, feet slip by at most %.1e m\n",
              getName(summary.termination), summary.iterations, summary.seconds, calcFallAcceleration(result),
              result.slip_position);
  for (const std::string& path : writeResult(directory, result)) std::printf("%s\n", path.c_str());
  return result.converged() ? 0 : 1;
}
