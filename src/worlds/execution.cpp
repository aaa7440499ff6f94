#include <algorithm>
#include <cmath>

#include "bielle/dynamics/assembly.h"
#include "control/clock.h"
#include "math/constants.h"
#include "model/number_text.h"
#include "motion/motor_scale.h"
#include "worlds/carrying.h"
#include "worlds/robot_errors.h"

namespace bielle::worlds {
namespace {

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

Carrying::Carrying(const Plan& plan, Controller& controller, World& world, const PerceptionOptions& sensors,
                   const ExecutionOptions& o)
    : options_(o),
      duration_(getEnd(plan, o)),
      controller_(controller),
      world_(world),
      ticks_(countPeriods(duration_, o.control_period)),
      most_ticks_(ticks_ + countPeriods(kMostExtension, o.control_period)),
      ticks_per_row_(countPeriods(o.record_period, o.control_period)),
      recorder_(world, (most_ticks_ + ticks_per_row_ - 1) / ticks_per_row_),
      perception_(plan.reference().model(), plan.schedule, sensors),
      delay_(world.model().nu(), o.control_period, o.delay),
      u_(VectorXd::Zero(world.model().nu())) {
  const Policy& reference = plan.reference();
  const Model& model = world.model();
  VectorXd q = model.makeNeutral(), v = VectorXd::Zero(model.nv());
  reference.getReference(0, q, v);
  if (model.isCopyOf(reference.model())) {
    world.reset(q, v);
  } else {
    const VectorXd closed = assembleMachine(reference.model(), model, q);
    Workspace ws(model);
    world.reset(closed, projectVelocity(model, ws, makeConstraintSet(model), closed, v));
  }
  detector_.emplace(model, reference, world.configuration(), o.fall, world.ground(), plan.ground);
  balance_.emplace(world, plan.schedule);
  perception_.reset(world, q, v);
  recorder_.happened.update_seconds.reserve(static_cast<size_t>(most_ticks_));
  recorder_.addNode(controller.footholds());
}

bool Carrying::isOver() const { return has_broken_ || ends_ || tick_ >= most_ticks_; }

void Carrying::command() {
  Execution& happened = recorder_.happened;
  if (options_.real_time) happened.largest_lag = std::max(happened.largest_lag, pace_.await(world_.time()));
  const double start = pace_.elapsed();
  measurement_ = perception_.update(world_, controller_.getPlanTime(world_.time()));
  measurement_.delay = options_.delay.delay;
  const double perceived = pace_.elapsed();
  controller_.update(measurement_, u_);
  happened.update_seconds.push_back(pace_.elapsed() - perceived);
  delay_.send(measurement_.time, u_);
  world_.setPush(calcPush(options_.pushes, measurement_.time));
  controlled_ = pace_.elapsed();
  happened.control_seconds += controlled_ - start;
}

bool Carrying::advance() { return worlds::advance(world_, delay_, measurement_.time, options_.control_period); }

void Carrying::holdTorques() { world_.setTorques(delay_.getTorques(measurement_.time)); }

void Carrying::note(bool advances, const ExecutionObserver& observer) {
  Execution& happened = recorder_.happened;
  recorder_.noteAdvance(pace_.elapsed() - controlled_);
  advances_ = advances;
  is_stopped_ = options_.interrupt && *options_.interrupt;
  for (int m = 0; m < world_.model().nu(); ++m) cut_ += delay_.acting()[m] != world_.torques()[m];
  has_broken_ = !world_.message().empty();
  if (has_broken_) return;
  if (tick_ % ticks_per_row_ == 0) recorder_.addStage();
  const double plan_time = controller_.getPlanTime(world_.time());
  fall_ = detector_->find(world_.time(), plan_time, world_.configuration());
  happened.largest_deviation = std::max(happened.largest_deviation, detector_->deviation());
  happened.largest_joint_deviation = std::max(happened.largest_joint_deviation, detector_->jointDeviation());
  const bool is_pushed = !calcPush(options_.pushes, measurement_.time).isZero(0);
  const int ticks_per_look = countPeriods(kBalancePeriod, options_.control_period);
  if (is_pushed || tick_ % ticks_per_look == 0 || tick_ + 1 >= ticks_)
    balance_->update(plan_time, controller_.footholds(), is_pushed);
  stands_ = tick_ + 1 >= ticks_ && balance_->stands();
  ends_ = stands_ || tick_ + 1 == most_ticks_ || is_stopped_ || !fall_.empty();
  if ((tick_ + 1) % ticks_per_row_ == 0 || ends_) {
    recorder_.addNode(controller_.footholds());
    if (observer && !ends_)
      observer(world_.time(), std::max(duration_, world_.time()), [this](double since) { return describe(since); });
  }
  ++tick_;
}

Execution Carrying::describe(double since) const {
  Execution so_far = recorder_.describe(since);
  so_far.distance = recorder_.way().head<2>().norm();
  so_far.saturated_share = static_cast<double>(cut_) / (std::max(1, tick_) * std::max(1, static_cast<int>(u_.size())));
  so_far.whole_seconds = pace_.elapsed();
  so_far.estimation = perception_.errors();
  return so_far;
}

Execution Carrying::finish() {
  Execution out = describe(0);
  out.extension = std::max(0, tick_ - ticks_) * options_.control_period;
  if (!world_.message().empty()) {
    balance_->update(controller_.getPlanTime(world_.time()), controller_.footholds(), false);
    const bool falls = world_.time() > 0 && balance_->falls();  // before the first step no ground has borne a sole
    out.outcome = falls ? Outcome::Fell : Outcome::BrokeOff;
    out.message = describeBreak(world_);
    if (falls)
      out.message = balance_->describe() + " at " + formatNumber(out.duration, "%.3f s") +
                    ", where the world broke off: " + out.message;
  } else if (!fall_.empty()) {
    out.outcome = Outcome::Fell;
    out.message = fall_;
  } else if (!advances_ || is_stopped_) {
    out.outcome = Outcome::Stopped;
  } else if (!stands_) {
    out.outcome = Outcome::Undecided;
    out.message = balance_->describe();
  } else {
    out.outcome = Outcome::Stood;
    out.message = describeFeet(world_.model(), out);
  }
  return out;
}

Execution carryOut(const Plan& plan, Controller& controller, World& world, const PerceptionOptions& sensors,
                   const ExecutionOptions& options, const ExecutionObserver& observer) {
  Carrying carrying(plan, controller, world, sensors, options);
  while (!carrying.isOver()) {
    carrying.command();
    carrying.note(carrying.advance(), observer);
  }
  return carrying.finish();
}

}  // namespace bielle::worlds
