/// \file The serial model and lifting: a squat planned without linkages, then transferred to them.
///
/// Bipetto's knee is turned by a motor through a four-bar. Planning often omits it: the linkage is frozen at a posture
/// q_r, and a motor is assumed on the knee itself. With q_s the joints that remain (base, hips, knees, ankles),
///     M_s(q_s) a_s + b_s = B_s u_s + J_s^T lambda                                                              (1)
/// where M_s(q_s) is, at q_r, the inertia of the closed robot with its linkage joints locked.
/// Lifting finds the closed configuration with the same q_s, and with T the closed velocity per serial velocity
///     v = T v_s,    a = T a_s + dT/dt v_s,    T^T (M a + b - J^T lambda) = T^T B u.                            (2)
/// (2) gives the motor torques u if the linkages can follow. For one motor and one joint it reads u R = tau with the
/// ratio R = v_motor / v_joint: where R tends to infinity, at a dead point of the knee, the motor must turn infinitely
/// fast and its torque does not reach the knee. The serial model ignores this.
///
/// We plan squats of several depths on (1), lift them by (2), and verify u with the constrained dynamics of the closed
/// robot. The shallow ones are lifted, the deep ones fold the knee beyond its dead point:
///     06_lift [depth ...]
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "bielle/motion/squat.h"
#include "bielle/results/result.h"
#include "bielle/robots/robot_loader.h"

using namespace bielle;

namespace {

bool check(const char* what, double error, double tolerance) {
  std::printf("  %-56s %.1e  %s\n", what, error, error < tolerance ? "ok" : "FAILED");
  return error < tolerance;
}

double findPeak(const MotionResult& result, const std::string& motor) {
  for (const auto& [name, torque] : result.peak_torques)
    if (name == motor) return torque;
  return 0;
}

// Plans a squat on the serial model and lifts it. False if a check fails.
bool planAndLift(const Model& closed, const SerialModel& serial, double depth) {
  SquatOptions options;
  options.depth = depth;
  // Lifting takes accelerations at the nodes, where Euler steps have them.
  const Motion motion = makeSquat(serial.model, options, {Formulation::Reduced, StepRule::Euler});
  const Solution solution = solve(motion);
  const MotionRecord record = makeRecord(motion, solution.trajectory);
  double knee = 0;
  for (const VectorXd& x : solution.trajectory.xs)
    knee = std::max(knee, x[serial.model.joints()[serial.model.findJoint("knee_right")].idx_q]);
  std::printf("\nsquat to %.2f on the serial model: %s after %d iterations, knee to %.4f rad\n", depth,
              getName(solution.summary.termination), solution.summary.iterations, knee);

  const LiftResult lifted = lift(closed, serial, makeSerialTrajectory(motion, record));
  if (!lifted.lifted()) {
    const LiftNode& last = lifted.nodes.back();
    std::printf("  not lifted: node %zu, %s: %s\n", lifted.nodes.size() - 1, getName(last.status),
                last.message.c_str());
    return last.status != NumericalStatus::Inaccurate;
  }
  const MotionResult result = makeLiftedResult({"bipetto", "", {}}, closed, motion, lifted, 0);
  double acceleration = 0, speed = 0;
  for (const LiftNode& node : lifted.nodes) acceleration = std::max(acceleration, node.acceleration_error);
  for (const VectorXd& x : lifted.trajectory.xs)
    speed = std::max(speed, std::abs(x[closed.nq() + closed.motors()[closed.findMotor("motor_knee_right")].dof]));
  std::printf("  lifted: right knee motor up to %.2f N m and %.2f rad/s; the serial knee required %.2f N m\n",
              findPeak(result, "motor_knee_right"), speed,
              record.u.col(serial.model.findMotor("knee_right")).cwiseAbs().maxCoeff());
  bool ok = check("serial accelerations in the closed dynamics [rad/s^2]", acceleration, 1e-5);
  ok &= check("loops stay closed [m]", result.gap_position, 1e-9);
  return ok;
}

}  // namespace

int main(int argc, char** argv) {
  const Model closed = loadRobot("bipetto").model;
  const SerialModel serial = makeSerialModel(closed, makeStandingPosture(closed));
  std::printf("%zu joints frozen, %zu closures dropped\n", serial.frozen_joints.size(), serial.dropped_closures.size());
  for (const SerialModel::Replacement& replacement : serial.replacements)
    std::printf("  %s and its kind: motors on %s, ratio %.3f\n", replacement.motors.front().c_str(),
                replacement.joints.front().c_str(), replacement.R(0, 0));
  bool ok = true;
  for (int i = 1; i < argc; ++i) ok &= planAndLift(closed, serial, std::atof(argv[i]));
  if (argc < 2)
    for (const double depth : {0.9, 0.8, 0.7}) ok &= planAndLift(closed, serial, depth);
  return ok ? 0 : 1;
}
