#include "bench/batch_speed.h"

#include <chrono>
#include <cmath>
#include <ctime>
#include <random>

#include "bielle/dynamics/kinematics.h"
#include "bielle/worlds/batch.h"
#include "dynamics/largest_gaps.h"
#include "math/lane_registers.h"

namespace bielle {
namespace {

double readWallClock() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

}  // namespace

BatchTask::BatchTask(const Model& model, bool falls) : model_(model), falls_(falls), hold_(model) {}

VectorXd BatchTask::makeConfiguration() const {
  VectorXd q = hold_.posture();
  if (falls_) q[2] += 0.05;
  return q;
}

VectorXd BatchTask::makeVelocity(int world) const {
  VectorXd v = VectorXd::Zero(model_.nv());
  std::mt19937 generator(static_cast<unsigned>(world));
  std::uniform_real_distribution<double> any(-1, 1);
  for (int i = 0; i < 6 && falls_; ++i) v[i] = any(generator);
  return v;
}

VectorXd BatchTask::calcTorques(ConstVectorRef q, ConstVectorRef v) const {
  if (falls_) return VectorXd::Zero(model_.nu());
  return hold_.calcTorques(q, v);
}

double BatchTask::calcPush(int tick, int world) const { return falls_ || tick >= 50 ? 0 : 10.0 / (1 + world); }

BatchSpeed measureBatch(const BatchTask& task, int worlds, double seconds, double time_step, int threads) {
  const Model& model = task.model();
  worlds::WorldBatchOptions options;
  options.world.world.time_step = time_step;
  options.threads = threads;
  worlds::WorldBatch batch(model, worlds, options);
  MatrixXd v(model.nv(), worlds), u(model.nu(), worlds), push = MatrixXd::Zero(3, worlds);
  for (int i = 0; i < worlds; ++i) v.col(i) = task.makeVelocity(i);
  batch.reset(task.makeConfiguration().replicate(1, worlds), v);
  BatchSpeed out;
  const int ticks = static_cast<int>(std::lround(seconds / BatchTask::kTick));
  for (int t = 0; t < ticks; ++t) {
    for (int i = 0; i < worlds; ++i) {
      u.col(i) = task.calcTorques(batch.configurations().col(i), batch.velocities().col(i));
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
