#include "bench/batch_speed.h"

#include <chrono>
#include <cmath>
#include <ctime>
#include <random>

#include "bielle/dynamics/kinematics.h"
#include "bielle/model/error.h"
#include "bielle/motion/registry.h"
#include "bielle/motion/solve.h"
#include "bielle/worlds/batch.h"
#include "dynamics/largest_gaps.h"
#include "math/lane_registers.h"

namespace bielle {
namespace {

double readWallClock() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

// The plan, then once more from there for gains with small penalties (PlanControl::Gains).
Policy makeWalk(const Model& model) {
  MotionRequest request = findMotion("", "walk").request;
  request.options.set("speed", 0.4);
  request.options.set("steps", 4);
  Solution solution = solve(makeMotion(model, request));
  SolveOptions options;
  options.solver = FddpOptions();
  options.start = StartingPoint{solution.trajectory};
  options.refine = false;
  solution = solve(solution.motion, options);
  if (!solution.converged())
    throw InputError(model.name(), "walk at 0.4 m/s",
                     std::string("its solve ended as: ") + getName(solution.summary.termination),
                     "give a robot that walks so, such as bipetto");
  return makePolicy(solution);
}

}  // namespace

const char* getName(BatchMotion motion) {
  return motion == BatchMotion::Stand ? "stand" : motion == BatchMotion::Walk ? "walk" : "fall";
}

BatchTask::BatchTask(const Model& model, BatchMotion motion) : model_(model), motion_(motion), hold_(model) {
  if (motion == BatchMotion::Walk) policy_ = makeWalk(model);
}

// Any number of worlds are about evenly spread over the walk.
const Policy::Stage& BatchTask::getStart(int world) const {
  constexpr double kGolden = 0.6180339887498949;
  const double share = std::fmod((world + 1) * kGolden, 1);
  return policy_->stages()[static_cast<size_t>(share * static_cast<double>(policy_->stages().size()))];
}

VectorXd BatchTask::makeConfiguration(int world) const {
  if (policy_) return getStart(world).q;
  VectorXd q = hold_.posture();
  if (motion_ == BatchMotion::Fall) q[2] += 0.05;
  return q;
}

VectorXd BatchTask::makeVelocity(int world) const {
  if (policy_) return getStart(world).v;
  VectorXd v = VectorXd::Zero(model_.nv());
  std::mt19937 generator(static_cast<unsigned>(world));
  std::uniform_real_distribution<double> any(-1, 1);
  for (int i = 0; i < 6 && motion_ == BatchMotion::Fall; ++i) v[i] = any(generator);
  return v;
}

VectorXd BatchTask::calcTorques(int tick, int world, ConstVectorRef q, ConstVectorRef v) {
  if (motion_ == BatchMotion::Stand) return hold_.calcTorques(q, v);
  VectorXd u = VectorXd::Zero(model_.nu());
  if (!policy_) return u;
  measured_.time = getStart(world).start + tick * kTick;
  measured_.q = q;
  measured_.v = v;
  policy_->update(measured_, u);
  return u;
}

double BatchTask::calcPush(int tick, int world) const {
  return motion_ == BatchMotion::Fall || tick >= 50 ? 0 : 10.0 / (1 + world);
}

double BatchTask::calcDeviation(int tick, int world, ConstVectorRef q) const {
  VectorXd planned = makeConfiguration(world), rates(model_.nv());
  if (policy_) policy_->getReference(getStart(world).start + tick * kTick, planned, rates);
  return model_.difference(planned, q).lpNorm<Eigen::Infinity>();
}

BatchSpeed measureBatch(BatchTask& task, int worlds, double seconds, double time_step, int threads) {
  const Model& model = task.model();
  worlds::WorldBatchOptions options;
  options.world.world.time_step = time_step;
  options.threads = threads;
  worlds::WorldBatch batch(model, worlds, options);
  MatrixXd v(model.nv(), worlds), u(model.nu(), worlds), push = MatrixXd::Zero(3, worlds);
  MatrixXd q(model.nq(), worlds);
  for (int i = 0; i < worlds; ++i) {
    q.col(i) = task.makeConfiguration(i);
    v.col(i) = task.makeVelocity(i);
  }
  batch.reset(q, v);
  BatchSpeed out;
  const int ticks = static_cast<int>(std::lround(seconds / BatchTask::kTick));
  for (int t = 0; t < ticks; ++t) {
    for (int i = 0; i < worlds; ++i) {
      u.col(i) = task.calcTorques(t, i, batch.configurations().col(i), batch.velocities().col(i));
      push(0, i) = task.calcPush(t, i);
    }
    const double processor = readProcessorClock(), wall = readWallClock();
    batch.step(u, push, BatchTask::kTick);
    out.processor += readProcessorClock() - processor;
    out.wall += readWallClock() - wall;
  }
  out.steps = std::round(BatchTask::kTick / time_step) * ticks * worlds;
  out.rounds = batch.rounds() / (out.steps / static_cast<double>(kLane));
  for (int i = 0; i < worlds; ++i) {
    out.broken += !batch.ok(i);
    out.gap = std::max(out.gap, calcLargestGap(model, batch.configurations().col(i)));
    out.deviation = std::max(out.deviation, task.calcDeviation(ticks, i, batch.configurations().col(i)));
    out.least_height = std::min(out.least_height, batch.configurations()(2, i));
  }
  return out;
}

double calcLargestGap(const Model& model, ConstVectorRef q) {
  Workspace ws(model);
  updatePlacements<double>(model, ws, q);
  return calcLargestGaps(model, ws).position;
}

double readProcessorClock() {
  timespec t;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

}  // namespace bielle
