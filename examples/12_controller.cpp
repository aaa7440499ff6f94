/// \file Feedback laws in a loop around a world: what a robot's own program would do.
///
/// A shooting problem with closures J(q) v = 0, contacts and wrench cones,
///     min  sum_k l_k(x_k, u_k)    s.t.  x_{k+1} = f_k(x_k, u_k),   c_k(x_k, u_k) within bounds,                 (1)
/// is solved once. Then, at every stage, its next N stages are solved anew from the state that was measured, and in between
///     u = u_k + K_k (x (-) x_k)                                                                                  (2)
/// acts. Someone pushes the robot while it walks. With (2) about the first solution it falls; with predictive control, a foot
/// that lands elsewhere catches the push. So does a law of our own, which holds each motor m stiffly on the solution,
///     u_m = u_m*(t) + k_p (q_m*(t) - q_m) + k_d (v_m*(t) - v_m).                                                  (3)
/// So far the world waits for the solver. In the end it does not: solves have a thread of their own, torques follow the
/// clock.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <memory>
#include <thread>
#include <vector>

#include "bielle/control/predictive_controller.h"
#include "bielle/dynamics/ball_cuts.h"
#include "bielle/motion/walk.h"
#include "bielle/robots/robot_loader.h"
#include "worlds/make_world.h"

using namespace bielle;

namespace {

constexpr std::chrono::milliseconds kPeriod(1);     // of the loop
constexpr double kPushStart = 1.5, kPushEnd = 1.6;  // s
const Vector3d kPush(-70, 0, 0);                    // N, from the front: 7 N s

// Eq. (3).
class MotorFeedback : public Controller {
 public:
  // \param plan  without gains: its torques are u*
  explicit MotorFeedback(Policy plan)
      : plan_(std::move(plan)), q_(plan_.model().nq()), e_(plan_.model().nv()), v_(plan_.model().nv()) {}

  void update(const Measurement& measured, VectorRef u) override {
    const Model& model = plan_.model();
    plan_.update(measured, u);
    plan_.getReference(measured.time, q_, v_);
    model.difference(measured.q, q_, e_);
    for (int m = 0; m < model.nu(); ++m) {
      const int dof = model.motors()[m].dof;
      u[m] += kStiffness * e_[dof] + kDamping * (v_[dof] - measured.v[dof]);
    }
  }

 private:
  static constexpr double kStiffness = 500, kDamping = 1;  // N m/rad, N m s/rad

  Policy plan_;
  VectorXd q_, e_, v_;  // nq, nv, nv: q*, q* (-) q, v*
};

// A simulated one, which is pushed. A real one has a driver in its place.
class Robot {
 public:
  Robot(const Model& model, const Policy& plan)
      : world_(worlds::makeWorld("bielle", model, {})), duration_(plan.duration() + 1) {
    VectorXd q = model.makeNeutral(), v = VectorXd::Zero(model.nv());
    plan.getReference(0, q, v);
    world_->reset(q, v);
  }

  void read(Measurement& measured) const {
    measured.time = world_->time();
    measured.q = world_->configuration();
    measured.v = world_->velocity();
  }
  void send(const VectorXd& u) { world_->setTorques(u); }
  void await() {  // the next instant: only a world must be asked to go on
    const bool is_pushed = world_->time() >= kPushStart && world_->time() < kPushEnd;
    world_->setPush(is_pushed ? kPush : Vector3d::Zero());
    moves_ = world_->advance(std::chrono::duration<double>(kPeriod).count());
  }
  double height() const { return world_->configuration()[2]; }  // of the trunk over the ground
  bool moves() const { return moves_; }                         // a world may break off
  bool isWalking() const { return moves_ && height() > 0.2 && world_->time() < duration_; }

 private:
  const std::unique_ptr<worlds::World> world_;
  const double duration_;
  bool moves_ = true;
};

struct Outcome {
  double height = 0;              // of the trunk at the end, or when it fell, m
  bool ended = false;             // else the world broke off
  std::vector<double> latencies;  // from each measurement to its torques, s
};

// Carries a plan out, by the clock or as fast as it goes.
Outcome run(const Model& model, const Policy& plan, Controller& controller, bool by_clock = false) {
  using Clock = std::chrono::steady_clock;
  Robot robot(model, plan);
  Outcome out;
  Measurement measured;
  VectorXd u(model.nu());
  Clock::time_point next = Clock::now();
  while (robot.isWalking()) {
    if (by_clock) std::this_thread::sleep_until(next);
    next += kPeriod;
    const Clock::time_point begin = Clock::now();
    robot.read(measured);
    controller.update(measured, u);
    robot.send(u);
    out.latencies.push_back(std::chrono::duration<double>(Clock::now() - begin).count());
    robot.await();
  }
  out.height = robot.height();
  out.ended = robot.moves();
  return out;
}

void printTimes(const PredictiveCounts& counts, Outcome of) {
  std::printf("in real time: trunk at the end %.3f m; %d of %d stages had no solve of their own\n", of.height,
              counts.missed, counts.stages);
  std::printf("  solves: median %.1f ms, 99 %% %.1f ms, worst %.1f ms\n", 1e3 * counts.calcQuantile(0.5),
              1e3 * counts.calcQuantile(0.99), 1e3 * counts.calcQuantile(1));
  std::sort(of.latencies.begin(), of.latencies.end());
  std::printf("  from a measurement to its torques: median %.3f ms, worst %.3f ms; to its policy: median %.0f ms\n",
              1e3 * of.latencies[of.latencies.size() / 2], 1e3 * of.latencies.back(),
              1e3 * counts.calcQuantile(0.5, &PredictiveSolve::latency));
}

}  // namespace

int main() {
  // Its rods are not cut in two, as those of its files: solves take three quarters of the time.
  const Model model = cutAtBalls(loadRobot(BIELLE_SOURCE_DIR "/robots/bipetto").model);
  WalkOptions options;
  options.speed = 0.4;
  const Solution solution = solve(makeWalk(model, options, {}));
  if (!solution.converged()) return 1;
  Policy gains = makePolicy(solution);
  MotorFeedback stiff(makePolicy(solution.motion, solution.trajectory));

  options.gait.foothold_room = 0.4;  // a foot may land elsewhere
  options.gait.cone_margin = 0.2;    // wrenches leave room for feedback
  options.gait.contact_kp = 0;       // and stands where it landed
  PredictiveOptions predictive;
  const auto makeController = [&] {
    const MotionPlan plan = planWalk(model, options, makeStandingRobot(model));
    return PredictiveController(makePredictiveMotion(model, plan, {}, predictive), solution.trajectory, predictive);
  };
  PredictiveController controller = makeController();

  const double start = solution.trajectory.xs[0][2];
  const auto stands = [start](const Outcome& outcome) { return outcome.ended && outcome.height > 0.9 * start; };
  const Outcome with_gains = run(model, gains, gains), with_stiff = run(model, gains, stiff),
                with_prediction = run(model, gains, controller);
  std::printf(
      "trunk at the start %.3f m; after the push with gains %.3f m, with stiff motors %.3f m, "
      "with predictive control %.3f m\n",
      start, with_gains.height, with_stiff.height, with_prediction.height);
  std::printf("%d solves, %d failed\n", controller.counts().solves, controller.counts().failed);

  predictive.own_thread = true;
  PredictiveController beside = makeController();
  printTimes(beside.counts(), run(model, gains, beside, true));  // of this machine: no part of the verdict
  return !stands(with_gains) && !stands(with_stiff) && stands(with_prediction) ? 0 : 1;
}
