#pragma once
// States from which many worlds begin, and what is left between them and the same robots alone.
#include <catch2/catch.hpp>
#include <cstring>
#include <memory>
#include <random>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/constrained.h"
#include "bielle/worlds/batch.h"
#include "worlds/posture_hold.h"

namespace bielle::testing {

struct BatchStart {
  MatrixXd q, v, u, push;  // a column per world
};

// Near the ground, turned and moving in all coordinates, with random torques and pushes.
inline BatchStart makeStarts(const Model& model, int count, unsigned seed) {
  const worlds::PostureHold posture(model);
  const ConstraintSet closures = makeConstraintSet(model);
  Workspace ws(model);
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> any(-1, 1);
  const auto draw = [&] { return any(generator); };
  BatchStart out{posture.posture().replicate(1, count), MatrixXd(model.nv(), count), MatrixXd(model.nu(), count),
                 MatrixXd::Zero(3, count)};
  for (int i = 0; i < count; ++i) {
    VectorXd turn = VectorXd::Zero(model.nv());
    turn.head<6>() << 0, 0, 2e-3 * draw(), 0.02 * draw(), 0.02 * draw(), 3 * draw();
    out.q.col(i) = model.integrate(out.q.col(i), turn);
    VectorXd v(model.nv());
    for (double& x : v) x = draw();
    out.v.col(i) = projectVelocity(model, ws, closures, out.q.col(i), v);
    for (double& x : out.u.col(i)) x = 10 * draw();
    if (i % 3 == 0) out.push.col(i) << 20 * draw(), 20 * draw(), 0;
  }
  return out;
}

inline worlds::WorldBatchOptions makeBatchOptions(double time_step, int threads = 1) {
  worlds::WorldBatchOptions options;
  options.world.world.time_step = time_step;
  options.threads = threads;
  return options;
}

// Velocities of all worlds after a duration (nv x count), less those of single worlds.
// \param makeAlone  the single world, or what takes its place, by the number of a world of the batch
// \param other      where the single worlds start, or null: where those of the batch do
template <class MakeWorld>
MatrixXd subtractAlone(const Model& model, const worlds::WorldParameters& parameters, const MakeWorld& makeAlone,
                       const BatchStart& starts, double time_step, double duration, const BatchStart* other = nullptr) {
  const auto count = static_cast<int>(starts.q.cols());
  worlds::WorldBatch batch(model, count, makeBatchOptions(time_step));
  batch.set(parameters);
  batch.reset(starts.q, starts.v);
  CHECK(batch.step(starts.u, starts.push, duration));
  MatrixXd out = batch.velocities();
  const BatchStart& alone = other ? *other : starts;
  for (int i = 0; i < count; ++i) {
    const std::unique_ptr<worlds::World> world = makeAlone(i);
    world->reset(alone.q.col(i), alone.v.col(i));
    world->setTorques(starts.u.col(i));
    world->setPush(starts.push.col(i));
    REQUIRE(world->advance(duration));
    out.col(i) -= world->velocity();
  }
  return out;
}

inline bool isEqual(const VectorXd& a, const VectorXd& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), sizeof(double) * static_cast<size_t>(a.size())) == 0;
}

}  // namespace bielle::testing
