/// \file A custom motion: Bipetto sways from foot to foot.
///
/// The centre of mass follows a given path,
///     c_y(t) = A sin(2 pi t / T) s(t),    c_x, c_z as at rest,                                                (1)
/// with s going smoothly from 0 to 1 over the first period, and from 1 to 0 over the last one. On flat ground, at
/// constant height, it determines the centre of pressure of both feet together, whatever the legs do,
///     p_y = c_y - (c_z / g) d^2 c_y / dt^2,                                                                   (2)
/// except for the change of the angular momentum about the centre of mass. The program compares both sides, and fails
/// if they differ too much.
///
/// Usage: 07_own_motion [DIRECTORY]   writes trajectory.csv, trajectory.npz and summary.json
#include <cmath>
#include <cstdio>

#include "bielle/dynamics/kinematics.h"
#include "bielle/motion/motion.h"
#include "bielle/results/result.h"
#include "bielle/robots/robot_loader.h"

using namespace bielle;

namespace {

constexpr double kPi = 3.14159265358979323846;

struct SwayOptions {
  double amplitude = 0.04;    // m
  double period = 1.6;        // s
  int periods = 3;            // with the first, which begins it, and the last, which ends it
  double time_step = 0.02;    // s
  double com_weight = 1e4;    // 1/m^2
  double torso_weight = 100;  // of its roll and pitch, within the state regularization
};

// Eq. (1).
double calcSway(const SwayOptions& o, double t) {
  const auto smooth = [](double x) { return x <= 0 ? 0 : x >= 1 ? 1 : x * x * (3 - 2 * x); };
  const double s = smooth(t / o.period) * smooth(o.periods - t / o.period);
  return o.amplitude * s * std::sin(2 * kPi * t / o.period);
}

// Both feet stay where they are; motions with steps have several phases, see motion/locomotion.h.
StageSpec makeStage(const Model& model, const SwayOptions& o, const std::vector<ContactTarget>& feet,
                    const VectorXd& q0, const Vector3d& com) {
  StageSpec stage;
  stage.dt = o.time_step;
  stage.constraints = makeConstraintSet(model, feet);
  stage.state = {0.1, q0, VectorXd::Zero(model.nv()), makeStateWeights(model)};
  stage.state.weights.segment<2>(3).setConstant(o.torso_weight);
  raiseMotorWeights(model, 1, stage.state.weights);
  stage.control = {1e-3, VectorXd::Zero(model.nu()), VectorXd::Ones(model.nu())};
  stage.costs.push_back({"com", o.com_weight, Activation::makeQuadratic(Vector3d::Ones()), makeComPosition(com)});
  // The feet do not share the load evenly: no force reference, only the limits of pressure and friction.
  GroundCosts ground;
  ground.force_weight = 0;
  const double weight = model.mass() * model.gravity().norm();
  addGroundCosts(model, ground, VectorXd::Constant(feet.size(), weight / feet.size()), stage);
  return stage;
}

Motion makeSway(const Model& model, const SwayOptions& o) {
  const VectorXd q0 = makeStandingPosture(model);
  const std::vector<ContactTarget> feet = makeContactTargets(model, q0, {0, 1}, 1e4, 200);
  Workspace ws(model);
  updatePositions(model, ws, q0);
  const Vector3d com = calcCom(model, ws);

  const int nodes = static_cast<int>(std::lround(o.periods * o.period / o.time_step));
  MotionPlan plan;
  for (int k = 0; k <= nodes; ++k)
    plan.stages.push_back(makeStage(model, o, feet, q0, com + Vector3d(0, calcSway(o, k * o.time_step), 0)));
  StageSpec& terminal = plan.stages.back();  // no forces there: at rest in the posture of the start
  terminal.constraints = {};
  terminal.control.weight = 0;
  terminal.costs.clear();
  terminal.state.weight = 1e3;

  plan.name = "sway";
  plan.schedule.phases = {{"double support", nodes, o.time_step, feet}};
  VectorXd x0 = VectorXd::Zero(model.nq() + model.nv());
  x0.head(model.nq()) = q0;
  plan.guess.xs.assign(nodes + 1, x0);
  plan.guess.us.assign(nodes, calcStaticTorques(model, makeConstraintSet(model, feet), q0).u);
  plan.q_start = plan.q_end = q0;
  plan.options = {{"amplitude", o.amplitude}, {"period", o.period}};
  return makeMotion(model, std::move(plan), {});
}

// Largest difference of both sides of Eq. (2), m.
double calcPressureError(const MotionRecord& record, double dt) {
  double error = 0;
  for (int k = 1; k + 1 < static_cast<int>(record.time.size()); ++k) {
    double force = 0, moment = 0;
    for (size_t foot = 0; foot < record.contact_names.size(); ++foot) {
      const double f_z = record.contact_wrenches(k, 6 * foot + 2), n_x = record.contact_wrenches(k, 6 * foot + 3);
      const double y = record.contact_names[foot] == "foot_left" ? 0.125 : -0.125;  // see robots/bipetto
      force += f_z;
      moment += y * f_z + n_x;
    }
    const double acceleration = (record.com(k + 1, 1) - 2 * record.com(k, 1) + record.com(k - 1, 1)) / (dt * dt);
    error = std::max(error, std::abs(moment / force - (record.com(k, 1) - record.com(k, 2) / 9.81 * acceleration)));
  }
  return error;
}

}  // namespace

int main(int argc, char** argv) {
  const LoadedRobot robot = loadRobot("bipetto");
  const SwayOptions options;
  const Motion motion = makeSway(robot.model, options);
  const Solution solution = solve(motion);
  const MotionResult result = makeResult({"bipetto", robot.file, {}}, solution);
  const FddpSummary& summary = solution.summary;
  std::printf("%s after %d iterations\n", getName(summary.termination), summary.iterations);
  writeResult(argc > 1 ? argv[1] : "sway", result);

  const auto path = result.record.com.col(1);
  const double pressure_error = calcPressureError(result.record, options.time_step);
  std::printf("sways from %.3f to %.3f m; Eq. (2) within %.1f mm\n", path.minCoeff(), path.maxCoeff(),
              1e3 * pressure_error);
  const bool ok = path.maxCoeff() > 0.9 * options.amplitude && pressure_error < 0.01;
  return result.converged() && ok ? 0 : 1;
}
