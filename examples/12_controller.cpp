/// \file Feedback laws in a loop around a world: what a robot's own program would do.
///
/// A shooting problem with closures J(q) v = 0, contacts and wrench cones,
///     min  sum_k l_k(x_k, u_k)    s.t.  x_{k+1} = f_k(x_k, u_k),   c_k(x_k, u_k) within bounds,                 (1)
/// is solved once. Then, at every stage, its next N stages are solved anew from the state that was measured, and in between
///     u = u_k + K_k (x (-) x_k)                                                                                  (2)
/// acts. Someone pushes the robot while it walks. With (2) about the first solution it falls; with predictive control, a foot
/// that lands elsewhere catches the push. So does a law of our own, which holds each motor m stiffly on the solution,
///     u_m = u_m*(t) + k_p (q_m*(t) - q_m) + k_d (v_m*(t) - v_m).                                                  (3)
#include <cstdio>

#include "bielle/control/predictive_controller.h"
#include "bielle/motion/walk.h"
#include "bielle/robots/robot_loader.h"
#include "worlds/make_world.h"

using namespace bielle;

namespace {

constexpr double kPeriod = 1e-3;                    // of the loop, s
constexpr double kPushStart = 1.5, kPushEnd = 1.6;  // s
const Vector3d kPush(-70, 0, 0);                    // N, from the front: 7 N s

// Eq. (3).
class MotorFeedback : public Controller {
 public:
  // \param plan  without gains: its torques are u*
  explicit MotorFeedback(Policy plan)
      : plan_(std::move(plan)), q_(plan_.getModel().nq()), e_(plan_.getModel().nv()), v_(plan_.getModel().nv()) {}

  void update(const Measurement& measured, VectorRef u) override {
    const Model& model = plan_.getModel();
    plan_.update(measured, u);
    plan_.getReference(measured.time, q_, v_);
    model.difference(measured.q, q_, e_);
    for (int m = 0; m < model.nu(); ++m) {
      const int dof = model.motors()[m].dof;
      u[m] += kStiffness * e_[dof] + kDamping * (v_[dof] - measured.v[dof]);
    }
  }

 private:
  static constexpr double kStiffness = 500, kDamping = 10;  // N m/rad, N m s/rad

  Policy plan_;
  VectorXd q_, e_, v_;  // nq, nv, nv: q*, q* (-) q, v*
};

// Height of the trunk over the ground at the end, or when it fell below 0.2 m.
double run(const Model& model, const Policy& plan, Controller& controller) {
  const auto world = worlds::makeWorld("bielle", model, {});
  Measurement measured{0, model.makeNeutral(), VectorXd::Zero(model.nv())};
  plan.getReference(0, measured.q, measured.v);
  world->reset(measured.q, measured.v);
  VectorXd u(model.nu());
  while (world->getTime() < plan.getDuration() + 1 && world->getConfiguration()[2] > 0.2) {
    measured.time = world->getTime();
    measured.q = world->getConfiguration();
    measured.v = world->getVelocity();
    controller.update(measured, u);
    world->setTorques(u);
    const bool pushed = measured.time >= kPushStart && measured.time < kPushEnd;
    world->setPush(pushed ? kPush : Vector3d::Zero());
    if (!world->advance(kPeriod)) break;
  }
  return world->getConfiguration()[2];
}

}  // namespace

int main() {
  const LoadedRobot robot = loadRobot(BIELLE_SOURCE_DIR "/robots/bipetto");
  const Model& model = robot.model;
  WalkOptions options;
  options.speed = 0.4;
  const Solution solution = solve(makeWalk(model, options, {}));
  if (!solution.converged()) return 1;
  Policy gains = makePolicy(solution);
  MotorFeedback stiff(makePolicy(solution.motion, solution.trajectory));

  options.gait.foothold_room = 0.4;  // a foot may land elsewhere
  options.gait.cone_margin = 0.2;    // wrenches leave room for feedback
  options.gait.contact_kp = 0;       // and stands where it landed
  const PredictiveOptions predictive;
  PredictiveController controller(
      makePredictiveMotion(model, planWalk(model, options, makeStandingRobot(model)), {}, predictive),
      solution.trajectory, predictive);

  const double start = solution.trajectory.xs[0][2];
  const double with_gains = run(model, gains, gains), with_stiff = run(model, gains, stiff),
               with_prediction = run(model, gains, controller);
  std::printf(
      "trunk at the start %.3f m; after the push with gains %.3f m, with stiff motors %.3f m, "
      "with predictive control %.3f m\n",
      start, with_gains, with_stiff, with_prediction);
  std::printf("%d solves, %d failed\n", controller.getCounts().solves, controller.getCounts().failed);
  return with_gains < 0.9 * start && with_stiff > 0.9 * start && with_prediction > 0.9 * start ? 0 : 1;
}
