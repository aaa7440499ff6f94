#include "worlds/execution.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <thread>

#include "bielle/dynamics/assembly.h"
#include "control/clock.h"
#include "math/constants.h"
#include "model/number_text.h"
#include "motion/motor_scale.h"
#include "worlds/balance.h"
#include "worlds/motion_recorder.h"
#include "worlds/robot_errors.h"

namespace bielle::worlds {
namespace {

// The clock beside a world.
class Pace {
 public:
  // s since the start
  double elapsed() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }
  // Keeps the world from running ahead. \returns how far it is behind, s
  double await(double time) const {
    const Clock::time_point due =
        start_ + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(time));
    std::this_thread::sleep_until(due);
    return std::chrono::duration<double>(Clock::now() - due).count();
  }

 private:
  using Clock = std::chrono::steady_clock;
  const Clock::time_point start_ = Clock::now();
};

// Advances by a control period, through all changes of the torques that fall into it.
bool advance(World& world, TorqueDelay& delay, double time, double period) {
  double elapsed = 0;
  for (;;) {
    world.setTorques(delay.getTorques(time + elapsed));
    const double next = delay.nextChange() - time;
    const bool ends = next >= period - kClockTolerance;
    if (!world.advance((ends ? period : next) - elapsed)) return false;
    if (ends) return true;
    elapsed = next;
  }
}

// The largest torque often tells why a world cannot go on: a motor without a limit gives whatever it is asked for.
std::string describeBreak(const World& world) {
  const Model& model = world.model();
  if (model.nu() == 0) return world.message();
  Eigen::Index largest = 0;
  const double torque = world.torques().cwiseAbs().maxCoeff(&largest);
  const Motor& motor = model.motors()[largest];
  return world.message() + "; motor '" + motor.name + "' was at " + formatNumber(torque, "%.3g") +
         (isLinear(model, motor) ? " N" : " N m");
}

// A sole that rolls over its edge turns by less before it lets go, and the softest ground of ours gives way by less.
constexpr double kMostTilt = 0.2, kMostDepth = 5e-3;  // rad, m

constexpr double kBalancePeriod = 5e-3;  // between looks at the balance, s

int countPeriods(double duration, double period) {
  return std::max(1, static_cast<int>(std::lround(duration / period)));
}

}  // namespace

std::string describeFeet(const Model& model, const Execution& e) {
  const auto describe = [&](const FootExtreme& extreme, const char* verb, const std::string& by) {
    return "contact " + model.contacts()[extreme.contact].name + " " + verb + " the ground by " + by + " at " +
           formatNumber(extreme.time, "%.3f s") + " while it carried the robot";
  };
  std::string text;
  if (e.largest_tilt.value > kMostTilt)
    text = describe(e.largest_tilt, "was turned from", formatNumber(e.largest_tilt.value, "%.2f rad"));
  if (e.largest_depth.value > kMostDepth)
    text += (text.empty() ? "" : "; ") +
            describe(e.largest_depth, "sank into", formatNumber(e.largest_depth.value, "%.3f m"));
  return text;
}

Vector3d calcPush(const std::vector<Push>& pushes, double time) {
  Vector3d force = Vector3d::Zero();
  for (const Push& push : pushes) {
    if (time < push.time || time >= push.time + push.duration) continue;
    const double angle = push.direction * kDegree;
    force += push.impulse / push.duration * Vector3d(std::cos(angle), std::sin(angle), 0);
  }
  return force;
}

const char* getName(Outcome outcome) {
  switch (outcome) {
    case Outcome::Running:
      return "running";
    case Outcome::Stood:
      return "stood";
    case Outcome::Ended:
      return "ended";
    case Outcome::Fell:
      return "fell";
    case Outcome::BrokeOff:
      return "failed";
    case Outcome::Stopped:
      return "was stopped";
    case Outcome::Undecided:
      return "not decided";
  }
  return "?";
}

double getEnd(const Plan& plan, const ExecutionOptions& o) {
  return o.duration > 0 ? o.duration : plan.end.value_or(plan.reference().duration() + o.hold);
}

Execution carryOut(const Plan& plan, Controller& controller, World& world, const PerceptionOptions& sensors,
                   const ExecutionOptions& o, const ExecutionObserver& observer) {
  const Policy& reference = plan.reference();
  const Model& model = world.model();
  const double duration = getEnd(plan, o);
  const int ticks = countPeriods(duration, o.control_period);
  const int most_ticks = ticks + countPeriods(kMostExtension, o.control_period);
  const int ticks_per_row = countPeriods(o.record_period, o.control_period);
  const int ticks_per_look = countPeriods(kBalancePeriod, o.control_period);
  MotionRecorder recorder(world, (most_ticks + ticks_per_row - 1) / ticks_per_row);
  Execution& happened = recorder.happened;

  Perception perception(reference.model(), plan.schedule, sensors);
  TorqueDelay delay(model.nu(), o.control_period, o.delay);
  VectorXd u = VectorXd::Zero(model.nu());
  Measurement measurement{0, model.makeNeutral(), VectorXd::Zero(model.nv())};
  reference.getReference(0, measurement.q, measurement.v);
  if (model.isCopyOf(reference.model())) {
    world.reset(measurement.q, measurement.v);
  } else {
    const VectorXd q = assembleMachine(reference.model(), model, measurement.q);
    Workspace ws(model);
    world.reset(q, projectVelocity(model, ws, makeConstraintSet(model), q, measurement.v));
  }
  FallDetector detector(model, reference, world.configuration(), o.fall, world.ground(), plan.ground);
  Balance balance(world, plan.schedule);
  perception.reset(world, measurement.q, measurement.v);
  happened.update_seconds.reserve(static_cast<size_t>(most_ticks));
  recorder.addNode(controller.footholds());
  int cut = 0, tick = 0;
  bool advances = true, is_stopped = false, stands = false;
  std::string fall;
  const Pace pace;
  const auto describe = [&](double since) {
    Execution so_far = recorder.describe(since);
    so_far.distance = recorder.way().head<2>().norm();
    so_far.saturated_share = static_cast<double>(cut) / (std::max(1, tick) * std::max(1, model.nu()));
    so_far.whole_seconds = pace.elapsed();
    so_far.estimation = perception.errors();
    return so_far;
  };
  for (; tick < most_ticks && !stands && !is_stopped && fall.empty(); ++tick) {
    if (o.real_time) happened.largest_lag = std::max(happened.largest_lag, pace.await(world.time()));
    const double start = pace.elapsed();
    measurement = perception.update(world, controller.getPlanTime(world.time()));
    measurement.delay = o.delay.delay;
    const double perceived = pace.elapsed();
    controller.update(measurement, u);
    happened.update_seconds.push_back(pace.elapsed() - perceived);
    delay.send(measurement.time, u);
    world.setPush(calcPush(o.pushes, measurement.time));
    const double controlled = pace.elapsed();
    advances = advance(world, delay, measurement.time, o.control_period);
    happened.control_seconds += controlled - start;
    recorder.noteAdvance(pace.elapsed() - controlled);
    is_stopped = o.interrupt && *o.interrupt;
    for (int m = 0; m < model.nu(); ++m) cut += delay.acting()[m] != world.torques()[m];
    if (!world.message().empty()) break;
    if (tick % ticks_per_row == 0) recorder.addStage();
    fall = detector.find(world.time(), controller.getPlanTime(world.time()), world.configuration());
    happened.largest_deviation = std::max(happened.largest_deviation, detector.deviation());
    happened.largest_joint_deviation = std::max(happened.largest_joint_deviation, detector.jointDeviation());
    const bool is_pushed = !calcPush(o.pushes, measurement.time).isZero(0);
    if (is_pushed || tick % ticks_per_look == 0 || tick + 1 >= ticks)
      balance.update(controller.getPlanTime(world.time()), controller.footholds(), is_pushed);
    stands = tick + 1 >= ticks && balance.stands();
    const bool ends = stands || tick + 1 == most_ticks || is_stopped || !fall.empty();
    if ((tick + 1) % ticks_per_row != 0 && !ends) continue;
    recorder.addNode(controller.footholds());
    if (observer && !ends) observer(world.time(), std::max(duration, world.time()), describe);
  }
  Execution out = describe(0);
  out.extension = std::max(0, tick - ticks) * o.control_period;
  if (!world.message().empty()) {
    balance.update(controller.getPlanTime(world.time()), controller.footholds(), false);
    const bool falls = world.time() > 0 && balance.falls();  // before the first step no ground has borne a sole
    out.outcome = falls ? Outcome::Fell : Outcome::BrokeOff;
    out.message = describeBreak(world);
    if (falls)
      out.message = balance.describe() + " at " + formatNumber(out.duration, "%.3f s") +
                    ", where the world broke off: " + out.message;
  } else if (!fall.empty()) {
    out.outcome = Outcome::Fell;
    out.message = fall;
  } else if (!advances || is_stopped) {
    out.outcome = Outcome::Stopped;
  } else if (!stands) {
    out.outcome = Outcome::Undecided;
    out.message = balance.describe();
  } else {
    out.outcome = Outcome::Stood;
    out.message = describeFeet(model, out);
  }
  return out;
}

}  // namespace bielle::worlds
