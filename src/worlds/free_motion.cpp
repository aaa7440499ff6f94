#include "worlds/free_motion.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "bielle/model/builder.h"
#include "control/clock.h"
#include "worlds/motion_recorder.h"

namespace bielle::worlds {
namespace {

// All instants up to the end at which a row is recorded or a force changes, in order.
std::vector<double> listInstants(const FreeMotionOptions& options, int rows) {
  std::vector<double> instants;
  for (int i = 1; i < rows; ++i) instants.push_back(i * options.record_period);
  for (const TimedTorques& torques : options.torques) instants.push_back(torques.time);
  for (const Push& push : options.pushes) {
    instants.push_back(push.time);
    instants.push_back(push.time + push.duration);
  }
  std::sort(instants.begin(), instants.end());
  std::vector<double> kept;
  for (double instant : instants)
    if (instant > (kept.empty() ? 0 : kept.back()) + kClockTolerance && instant < options.duration - kClockTolerance)
      kept.push_back(instant);
  kept.push_back(options.duration);
  return kept;
}

VectorXd findTorques(const std::vector<TimedTorques>& torques, double time, int nu) {
  VectorXd u = VectorXd::Zero(nu);
  for (const TimedTorques& entry : torques)
    if (entry.time <= time + kClockTolerance) u = entry.u;
  return u;
}

}  // namespace

FreeMotion moveFreely(World& world, ConstVectorRef q, ConstVectorRef v, const FreeMotionOptions& options,
                      const ExecutionObserver& observer) {
  using Clock = std::chrono::steady_clock;
  const auto getSeconds = [](Clock::time_point since) {
    return std::chrono::duration<double>(Clock::now() - since).count();
  };
  const int rows = std::max(1, static_cast<int>(std::ceil(options.duration / options.record_period - kClockTolerance)));
  MotionRecorder recorder(world, rows);
  const Clock::time_point start = Clock::now();
  world.reset(q, v);
  recorder.addNode();
  const auto describe = [&](double since) {
    Execution so_far = recorder.describe(since);
    so_far.whole_seconds = getSeconds(start);
    return so_far;
  };
  double next_row = options.record_period;
  bool has_stage = false, advances = world.message().empty();
  for (double instant : listInstants(options, rows)) {
    if (!advances) break;
    world.setTorques(findTorques(options.torques, world.time(), world.model().nu()));
    world.setPush(calcPush(options.pushes, world.time() + kClockTolerance));
    if (!has_stage) {
      recorder.addStage();
      recorder.addClosureForces();
      has_stage = true;
    }
    const Clock::time_point before = Clock::now();
    advances = world.advance(instant - world.time());
    recorder.noteAdvance(getSeconds(before));
    const bool is_end = instant >= options.duration - kClockTolerance;
    if (instant < next_row - kClockTolerance && !is_end && advances) continue;
    next_row += options.record_period;
    recorder.addNode();
    has_stage = false;
    if (observer && advances && !is_end) observer(world.time(), options.duration, describe);
  }
  if (recorder.numNodes() == 1) {  // a record has a stage at least
    recorder.addStage();
    recorder.addNode();
  }
  FreeMotion out{describe(0), recorder.books()};
  out.execution.outcome = !world.message().empty() ? Outcome::BrokeOff : advances ? Outcome::Ended : Outcome::Stopped;
  out.execution.message = world.message();
  return out;
}

Model addMotorSprings(const Model& model, const std::vector<MotorSpring>& springs) {
  ModelParts parts = takeParts(model);
  for (const MotorSpring& spring : springs) {
    const Motor& motor = model.motors()[spring.motor];
    JointForce* force = nullptr;
    for (JointForce& known : parts.joint_forces)
      if (known.joint == motor.joint) force = &known;
    if (!force) {
      JointForce added;
      added.joint = motor.joint;
      added.idx_q = model.joints()[motor.joint].idx_q;
      added.dof = motor.dof;
      parts.joint_forces.push_back(added);
      force = &parts.joint_forces.back();
    }
    // Two springs on one coordinate are one of the sum of their stiffnesses, at rest between them.
    const double sum = force->stiffness + spring.stiffness;
    if (sum > 0) force->rest = (force->stiffness * force->rest + spring.stiffness * spring.rest) / sum;
    force->stiffness = sum;
    force->damping += spring.damping;
  }
  return ModelBuilder::restore(std::move(parts));
}

}  // namespace bielle::worlds
