/// \file A squat of Bipetto, whose knees and ankles are driven through connecting rods.
///
/// The state is x = (q, v) of the spanning tree, with every loop closed; motors give u, closures and soles the forces:
///     M(q) a + b(q, v) = B u + J(q)^T lambda,    d/dt (J(q) v) = 0                                            (1)
/// for 6 closures of 6 rows and 2 feet of 6 rows. With steps of length h that end on the closures again, find
///     min over u   sum_k h l_k(x_k, u_k, lambda_k) + l_N(x_N),                                                (2)
/// where l makes the centre of mass follow
///     c_z(t) = c_z(0) (1 - (1 - depth) (1 - cos 2 pi t / T) / 2),                                             (3)
/// the feet share the weight and the robot stay upright, with small motor torques. FDDP solves (2).
///
/// Usage: 02_squat [DIRECTORY [DURATION]]   writes trajectory.csv, trajectory.npz and summary.json
#include <cstdio>
#include <cstdlib>
#include <iostream>

#include "bielle/model/names.h"
#include "bielle/motion/squat.h"
#include "bielle/results/result.h"
#include "bielle/robots/robot_loader.h"

using namespace bielle;

namespace {

// Knee and knee motor at some nodes: the rods change both the angle and the torque.
void printMotion(const MotionResult& result, const SquatOptions& options) {
  const MotionRecord& record = result.record;
  const int knee = findColumn(record.q_names, "knee_right"), crank = findColumn(record.q_names, "motor_knee_right");
  const int motor = findColumn(record.u_names, "motor_knee_right"),
            foot = findColumn(record.contact_names, "foot_right");
  const int stages = static_cast<int>(record.time.size()) - 1;
  std::printf("\n%7s %10s %10s %11s %12s %13s %13s\n", "t [s]", "CoM [m]", "Eq. 3 [m]", "knee [rad]", "motor [rad]",
              "motor [N m]", "right sole [N]");
  for (int i = 0; i <= 8; ++i) {
    const int k = std::min(i * stages / 8, stages - 1);  // the last node has no torque
    std::printf("%7.3f %10.4f %10.4f %11.4f %12.4f %13.3f %13.2f\n", record.time[k], record.com(k, 2),
                record.com(0, 2) * calcSquatHeight(options, record.time[k]), record.q(k, knee), record.q(k, crank),
                record.u(k, motor), record.contact_wrenches(k, 6 * foot + 2));
  }
}

}  // namespace

int main(int argc, char** argv) {
  const std::string directory = argc > 1 ? argv[1] : "squat";
  SquatOptions options;
  options.depth = 0.7;
  if (argc > 2) options.duration = std::atof(argv[2]);

  const LoadedRobot robot = loadRobot("bipetto");
  const Motion motion = makeSquat(robot.model, options);
  std::printf("%d stages, %d velocities, %d motors\n", motion.problem->numStages(), robot.model.nv(), robot.model.nu());

  SolveObserver observer;
  observer.motion.callback = makeFddpPrinter(std::cout);
  const Solution solution = solve(motion, {}, observer);
  const FddpSummary& summary = solution.summary;
  const MotionResult result = makeResult({"bipetto", robot.file, {}}, solution);
  printMotion(result, options);

  std::printf("\n%s after %d iterations and %.2f s, cost %.6f\n", getName(summary.termination), summary.iterations,
              summary.seconds, summary.cost);
  std::printf("closures open by at most %.1e m and %.1e rad, feet slip by at most %.1e m\n", result.gap_position,
              result.gap_angle, result.slip_position);
  for (const std::string& path : writeResult(directory, result)) std::printf("%s\n", path.c_str());
  return result.converged() ? 0 : 1;
}
