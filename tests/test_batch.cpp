// Many worlds at once: the single world as an oracle, one step at a time, and independence to the last bit.
#include <catch2/catch.hpp>
#include <limits>
#include <random>

#include "batch_starts.h"
#include "bielle/model/builder.h"
#include "bielle/worlds/batch.h"
#include "count_allocations.h"
#include "own_robots.h"
#include "world_trials.h"

namespace bielle::worlds {
namespace {

using bielle::testing::getBipetto;
using bielle::testing::isEqual;
using bielle::testing::makeBatchOptions;
using bielle::testing::makeStarts;
using Start = bielle::testing::BatchStart;

// Largest difference of two steps from those of single worlds: of coordinates and velocities, and 1e-3 of that of wrenches, relative.
double compareStep(const Model& model, const WorldBatchOptions& options, const BielleWorldOptions& single, int count) {
  const Start starts = makeStarts(model, count, 5);
  WorldBatch batch(model, count, options);
  batch.reset(starts.q, starts.v);
  CHECK(batch.step(starts.u, starts.push, 1e-3));
  CHECK(batch.step(starts.u, starts.push, 1e-3));
  double worst = 0;
  const auto world = makeBielleWorld(model, single);
  for (int i = 0; i < count; ++i) {
    world->reset(starts.q.col(i), starts.v.col(i));
    for (int k = 0; k < 2; ++k) {
      world->setTorques(starts.u.col(i));
      world->setPush(starts.push.col(i));
      REQUIRE(world->advance(1e-3));
    }
    CHECK(batch.times()[i] == world->time());
    worst = std::max({worst, (batch.configurations().col(i) - world->configuration()).cwiseAbs().maxCoeff(),
                      (batch.velocities().col(i) - world->velocity()).cwiseAbs().maxCoeff()});
    for (size_t c = 0; c < model.contacts().size(); ++c) {
      const Vector6d& wrench = world->feet()[c].wrench;
      const Vector6d other = batch.wrenches().col(i).segment<6>(6 * static_cast<Eigen::Index>(c));
      worst = std::max(worst, 1e-3 * (other - wrench).norm() / (1 + wrench.norm()));
    }
  }
  return worst;
}

// Random parameters. \param loops_alike  all bodies and rotors within the loops of a world have the same factor
WorldParameters makeParameters(const Model& model, int count, bool loops_alike) {
  std::mt19937 generator(4);
  std::uniform_real_distribution<double> any(0.8, 1.25);
  std::vector<char> is_in_loop(static_cast<size_t>(model.numBodies()), 0);
  for (const LoopCluster& cluster : model.clusters())
    for (int dof : cluster.dofs) is_in_loop[model.dofs()[dof].joint] = 1;
  WorldParameters out;
  out.mass_factors.resize(model.numBodies(), count);
  out.armatures.resize(model.nu(), count);
  out.effort_limits.resize(model.nu(), count);
  out.friction.resize(count);
  for (int i = 0; i < count; ++i) {
    const double alike = any(generator);
    for (int b = 0; b < model.numBodies(); ++b)
      out.mass_factors(b, i) = loops_alike && is_in_loop[b] ? alike : any(generator);
    for (int m = 0; m < model.nu(); ++m) {
      out.armatures(m, i) = (loops_alike ? alike : any(generator)) * model.motors()[m].armature;
      out.effort_limits(m, i) = 5 * any(generator);
    }
    out.friction[i] = 0.3 * any(generator);
  }
  return out;
}

// Of the robot of a world with parameters, alone, with a model of its own.
std::unique_ptr<World> makeAlone(const Model& model, const WorldParameters& parameters, int i, double time_step) {
  ModelParts parts = takeParts(model);
  for (int b = 0; b < model.numBodies(); ++b) {
    parts.bodies[b].inertia.mass *= parameters.mass_factors(b, i);
    parts.bodies[b].inertia.I_com *= parameters.mass_factors(b, i);
  }
  for (int m = 0; m < model.nu(); ++m) {
    parts.motors[m].armature = parts.armature[model.motors()[m].dof] = parameters.armatures(m, i);
    parts.motors[m].effort_limit = parameters.effort_limits(m, i);
  }
  BielleWorldOptions options = makeBatchOptions(time_step).world;
  options.world.ground.friction = parameters.friction[i];
  return makeBielleWorld(ModelBuilder::restore(std::move(parts)), options);
}

// Velocities of all worlds less those of the same robots alone, maybe with other parameters, after a duration.
MatrixXd calcDifference(const Model& model, const Start& starts, const WorldParameters& parameters,
                        const WorldParameters& alone, double time_step, double duration) {
  return bielle::testing::subtractAlone(
      model, parameters, [&](int i) { return makeAlone(model, alone, i, time_step); }, starts, time_step, duration);
}

}  // namespace

TEST_CASE("batch: a step is that of a single world") {
  for (double h : {2.5e-4, 1e-3}) {
    const WorldBatchOptions options = makeBatchOptions(h);
    CHECK(compareStep(getBipetto(), options, options.world, 100) < 1e-11);
    BielleWorldOptions other = options.world;
    other.world.ground.friction = 0.7007;
    CHECK(compareStep(getBipetto(), options, other, 20) > 1e-9);
  }
}

TEST_CASE("batch: a step on a ground of steps, and of a robot with springs between points, is that of a single world") {
  WorldBatchOptions options = makeBatchOptions(1e-3);
  GroundStep step;
  step.top = {0.02, 0.05, 1e-3};
  step.length = step.width = 0.15;
  step.yaw = 0.3;
  options.world.world.ground.steps = {step};
  CHECK(compareStep(getBipetto(), options, options.world, 9) < 1e-11);
  CHECK(compareStep(bielle::testing::loadOwn("spring_biped").model, options, options.world, 9) < 1e-11);
}

TEST_CASE("batch: what becomes of a world does not depend on the others, to the last bit") {
  const Model& model = getBipetto();
  constexpr int kCount = 19, kLimp = 4, kBroken = 6;
  const Start starts = makeStarts(model, kCount, 7);
  const auto run = [&](WorldBatch& batch, const std::vector<int>& worlds) {
    const auto select = [&](const MatrixXd& all) {
      MatrixXd out(all.rows(), static_cast<Eigen::Index>(worlds.size()));
      for (size_t i = 0; i < worlds.size(); ++i) out.col(static_cast<Eigen::Index>(i)) = all.col(worlds[i]);
      return out;
    };
    batch.reset(select(starts.q), select(starts.v));
    for (int tick = 0; tick < 40; ++tick) {
      MatrixXd u = starts.u, push = starts.push;
      if (tick == 5) u(2, kLimp) = std::numeric_limits<double>::quiet_NaN();
      if (tick == 7) push(0, kBroken) = 1e13;
      batch.step(select(u), select(push), 2e-3);
    }
  };
  std::vector<int> all(kCount), reversed;
  for (int i = 0; i < kCount; ++i) all[static_cast<size_t>(i)] = i;
  reversed.assign(all.rbegin(), all.rend());
  WorldBatch together(model, kCount, makeBatchOptions(2e-3)), threads(model, kCount, makeBatchOptions(2e-3, 2)),
      backward(model, kCount, makeBatchOptions(2e-3));
  run(together, all);
  run(threads, all);
  run(backward, reversed);
  double least = 1;
  for (int i = 0; i < kCount; ++i) {
    CAPTURE(i, together.message(i));
    const VectorXd q = together.configurations().col(i), v = together.velocities().col(i);
    WorldBatch alone(model, 1, makeBatchOptions(2e-3));
    run(alone, {i});
    const auto check = [&](const WorldBatch& batch, int at) {
      CHECK(isEqual(batch.configurations().col(at), q));
      CHECK(isEqual(batch.velocities().col(at), v));
      CHECK(isEqual(batch.wrenches().col(at), together.wrenches().col(i)));
      CHECK(batch.message(at) == together.message(i));
      CHECK(batch.times()[at] == together.times()[i]);
    };
    check(threads, i);
    check(backward, kCount - 1 - i);
    check(alone, 0);
    CHECK(q.allFinite());
    CHECK(together.ok(i) == (i != kLimp && i != kBroken));
    if (i > 0) least = std::min(least, (q - together.configurations().col(i - 1)).norm());
  }
  CHECK(least > 0);
  CHECK(together.message(kLimp) == "its torques or its push are not finite");
  CHECK(together.times()[kLimp] == Approx(0.01));
  CHECK_THAT(together.message(kBroken), Catch::StartsWith("after 0.01") && Catch::Contains("s, in a step of "));
  CHECK(together.times()[kBroken] == Approx(0.014));
}

TEST_CASE("batch: parameters of a world are those of a changed model") {
  const Model& model = getBipetto();
  const Start starts = makeStarts(model, 10, 9);
  const WorldParameters parameters = makeParameters(model, 10, true);
  const auto compare = [&](const WorldParameters& alone) {
    return calcDifference(model, starts, parameters, alone, 1e-3, 2e-3).cwiseAbs().maxCoeff();
  };
  CHECK(compare(parameters) < 1e-11);
  const auto sees = [&](auto part) {
    WorldParameters other = parameters;
    (other.*part).col(0) *= 1.001;
    return compare(other) > 1e-6;
  };
  CHECK(sees(&WorldParameters::mass_factors));
  CHECK(sees(&WorldParameters::armatures));
  CHECK(sees(&WorldParameters::effort_limits));
  CHECK(sees(&WorldParameters::friction));
}

// A batch closes its loops along the metric of one model (reduction.h), a changed model along its own: to second order in the step
// both are the same, and extrapolation leaves nothing of the difference.
TEST_CASE("batch: masses within loops are those of a changed model as steps become short") {
  const Model& model = getBipetto();
  Start starts = makeStarts(model, 4, 9);
  starts.q.row(2).array() += 1;
  const WorldParameters parameters = makeParameters(model, 4, false);
  const auto extrapolate = [&](const WorldParameters& alone) {
    const MatrixXd once = calcDifference(model, starts, parameters, alone, 2.5e-4, 0.01);
    return ((4 * calcDifference(model, starts, parameters, alone, 1.25e-4, 0.01) - once) / 3).cwiseAbs().maxCoeff();
  };
  CHECK(extrapolate(parameters) < 2e-5);
  WorldParameters other = parameters;
  other.mass_factors *= 1.001;
  CHECK(extrapolate(other) > 1e-4);
}

TEST_CASE("batch: parameters are kept over resets, told, and none of the neighbours' business") {
  const Model& model = getBipetto();
  constexpr int kCount = 11;
  const Start starts = makeStarts(model, kCount, 2);
  WorldParameters parameters = makeParameters(model, kCount, false);
  for (int i = 0; i < kCount; i += 2) {  // nothing of their own
    parameters.mass_factors.col(i).setOnes();
    for (int m = 0; m < model.nu(); ++m) {
      parameters.armatures(m, i) = model.armature()[model.motors()[m].dof];
      parameters.effort_limits(m, i) = model.motors()[m].effort_limit;
    }
    parameters.friction[i] = Ground().friction;
  }
  const auto run = [&](WorldBatch& batch) {
    batch.reset(starts.q, starts.v);
    for (int k = 0; k < 4; ++k) batch.step(starts.u, starts.push, 2e-3);
  };
  WorldBatch batch(model, kCount, makeBatchOptions(1e-3)), plain(model, kCount, makeBatchOptions(1e-3));
  run(plain);
  batch.reset(starts.q, starts.v);
  for (int k = 0; k < 2; ++k) CHECK(batch.step(starts.u, starts.push, 2e-3));
  batch.set(parameters);  // on the way
  for (int k = 0; k < 2; ++k) CHECK(batch.step(starts.u, starts.push, 2e-3));
  for (int i = 0; i < kCount; i += 2) CHECK(isEqual(batch.velocities().col(i), plain.velocities().col(i)));
  run(batch);
  const MatrixXd v = batch.velocities();
  run(batch);
  CHECK(batch.velocities() == v);
  for (int i = 0; i < kCount; ++i) {
    WorldBatch alone(model, 1, makeBatchOptions(1e-3));
    WorldParameters own{parameters.mass_factors.col(i),
                        parameters.armatures.col(i),
                        parameters.effort_limits.col(i),
                        parameters.friction.segment(i, 1),
                        {}};
    alone.set(own);
    alone.reset(starts.q.col(i), starts.v.col(i));
    for (int k = 0; k < 4; ++k) alone.step(starts.u.col(i), starts.push.col(i), 2e-3);
    CHECK(isEqual(alone.velocities(), v.col(i)));
    CHECK(isEqual(plain.velocities().col(i), v.col(i)) == (i % 2 == 0));
  }
  CHECK(batch.parameters().mass_factors == parameters.mass_factors);
  CHECK(batch.parameters().friction == parameters.friction);
  CHECK(plain.parameters().effort_limits(0, 1) == model.motors()[0].effort_limit);
}

TEST_CASE("batch: delayed torques act later, in each world by its own delay") {
  const Model& model = getBipetto();
  constexpr int kCount = 5, kTicks = 5;
  const Start starts = makeStarts(model, kCount, 8);
  WorldParameters parameters;
  parameters.delays.resize(kCount);
  parameters.delays << 0, 1e-3, 2e-3, 3e-3, 7e-3;
  WorldBatch batch(model, kCount, makeBatchOptions(1e-3));
  batch.set(parameters);
  const auto getTorques = [&](int tick, int i) { return VectorXd(starts.u.col(i) / (1 + std::max(0, tick))); };
  for (int k = 0; k < 2; ++k) {  // nothing of the first time is left in the second one
    batch.reset(starts.q, starts.v);
    for (int tick = 0; tick < kTicks; ++tick) {
      MatrixXd u = starts.u;
      for (int i = 0; i < kCount; ++i) u.col(i) = getTorques(tick, i);
      REQUIRE(batch.step(u, starts.push, 2e-3));
    }
  }
  const auto world = makeBielleWorld(model, makeBatchOptions(1e-3).world);
  for (int i = 0; i < kCount; ++i) {
    const int delay = static_cast<int>(std::lround(1e3 * parameters.delays[i]));
    world->reset(starts.q.col(i), starts.v.col(i));
    world->setPush(starts.push.col(i));
    for (int t = 0; t < 2 * kTicks;) {                                      // ms
      const bool changes = delay % 2 == 1 && t % 2 == 0 && t >= delay + 1;  // on the way
      const int end = (t - t % 2) + (changes ? 1 : 2);
      world->setTorques(getTorques(t < delay ? 0 : (t - delay) / 2, i));
      REQUIRE(world->advance(1e-3 * (end - t)));
      t = end;
    }
    CAPTURE(i);
    CHECK(batch.times()[i] == Approx(world->time()));
    CHECK((batch.velocities().col(i) - world->velocity()).cwiseAbs().maxCoeff() < 1e-9);
  }
}

TEST_CASE("batch: worlds are reset alone, and begin as the others did") {
  const Model& model = getBipetto();
  const Start starts = makeStarts(model, 10, 3);
  WorldBatch batch(model, 10, makeBatchOptions(1e-3));
  CHECK(batch.message(9) == "it has not been reset");
  CHECK_FALSE(batch.step(starts.u, starts.push, 1e-3));
  batch.reset(starts.q, starts.v);
  CHECK(batch.step(starts.u, starts.push, 2e-3));
  const MatrixXd after = batch.configurations();
  std::vector<char> where(10, 0);
  where[1] = where[8] = 1;
  batch.reset(starts.q, starts.v, where);
  CHECK(batch.times()[1] == 0);
  CHECK(batch.times()[2] == 2e-3);
  CHECK(isEqual(batch.configurations().col(2), after.col(2)));
  CHECK(batch.step(starts.u, starts.push, 2e-3));
  for (int i : {1, 8}) CHECK(isEqual(batch.configurations().col(i), after.col(i)));
  // Those that were not reset go on as if nothing had been.
  WorldBatch other(model, 10, makeBatchOptions(1e-3));
  other.reset(starts.q, starts.v);
  other.step(starts.u, starts.push, 2e-3);
  other.step(starts.u, starts.push, 2e-3);
  for (int i : {0, 2, 9}) CHECK(isEqual(batch.configurations().col(i), other.configurations().col(i)));
}

TEST_CASE("batch: nothing is allocated once worlds step and are reset, on flat ground or on steps") {
  const Model& model = getBipetto();
  const Start starts = makeStarts(model, 19, 3);
  WorldBatchOptions options = makeBatchOptions(1e-3, 2);
  std::vector<char> where(19, 0);
  where[3] = where[17] = 1;
  for (const bool has_steps : {false, true}) {
    GroundStep step;
    step.top = {0.02, 0.05, 1e-3};
    step.length = step.width = 0.15;
    if (has_steps) options.world.world.ground.steps = {step};
    WorldBatch batch(model, 19, options);
    WorldParameters parameters;
    parameters.delays.setConstant(19, 3e-3);
    parameters.mass_factors.setConstant(model.numBodies(), 19, 1.1);
    batch.set(parameters);
    const auto run = [&] {
      batch.reset(starts.q, starts.v);
      bool is_ok = true;
      for (int tick = 0; tick < 10; ++tick) {
        is_ok = batch.step(starts.u, starts.push, 2e-3) && is_ok;
        batch.reset(starts.q, starts.v, where);
      }
      return is_ok;
    };
    CHECK(run());  // starts the threads
    const long before = num_allocations;
    const bool is_ok = run();
    CHECK(num_allocations == before);
    CHECK(is_ok);
  }
}

TEST_CASE("batch: what it cannot take is refused, and nothing is stepped") {
  const Model& model = getBipetto();
  const Start starts = makeStarts(model, 3, 3);
  CHECK_THROWS_WITH(WorldBatch(model, 0), Catch::Contains("count is 0"));
  WorldBatch batch(model, 3, makeBatchOptions(1e-3));
  batch.reset(starts.q, starts.v);
  CHECK_THROWS_WITH(batch.reset(starts.q.leftCols(2), starts.v), Catch::Contains(" x 2; give "));
  CHECK_THROWS_WITH(batch.reset(starts.q, starts.v, {1, 0}), Catch::Contains("where has 2 entries; give 3"));
  MatrixXd v = starts.v;
  v(0, 1) = std::numeric_limits<double>::infinity();
  CHECK_THROWS_WITH(batch.reset(starts.q, v), Catch::Contains("world 1"));
  CHECK_THROWS_WITH(batch.step(starts.u.topRows(2), starts.push, 1e-3), Catch::Contains("u is 2 x 3"));
  CHECK_THROWS_WITH(batch.step(starts.u, starts.push, 0), Catch::Contains("positive"));
  const auto refuses = [&](const WorldParameters& parameters, const char* what) {
    CHECK_THROWS_WITH(batch.set(parameters), Catch::Contains(what));
  };
  const VectorXd friction = Vector3d(0.5, -1, 0.5);
  refuses({{}, {}, {}, friction, {}}, "friction of world 1 has a -1.000000; give numbers that are not negative");
  refuses({{}, {}, {}, friction.head(2), {}}, "friction is 1 x 2; give 1 x 3");
  refuses({{}, {}, {}, {}, Vector3d(0, v(0, 1), 0)}, "delays of world 1 has a inf");
  MatrixXd factors = MatrixXd::Ones(model.numBodies(), 3);
  factors(4, 2) = 0;
  refuses({factors, {}, {}, {}, {}}, "mass_factors of world 2 has a 0");
  refuses({{}, {}, starts.u.topRows(2), {}, {}}, "effort_limits is 2 x 3");
  CHECK(batch.parameters().mass_factors.minCoeff() == 1);
  CHECK(batch.times().isZero(0));
  CHECK((batch.velocities() - starts.v).cwiseAbs().maxCoeff() < 1e-9);
}

TEST_CASE("batch: a world whose loops are open where it is reset says so, and the others step") {
  const Model& model = getBipetto();
  Start starts = makeStarts(model, 3, 3);
  const Joint& knee = model.joints()[model.findJoint("knee_right")];
  starts.q(knee.idx_q, 1) += 1e-3;
  starts.q(knee.idx_q, 2) += 1e-9;
  WorldBatch batch(model, 3, makeBatchOptions(1e-3));
  batch.reset(starts.q, starts.v);
  CHECK((batch.ok(0) && !batch.ok(1) && batch.ok(2)));
  CHECK_THAT(batch.message(1), Catch::Contains("loops are open by") && Catch::Contains("give a closed configuration"));
  batch.step(starts.u, starts.push, 2e-3);
  CHECK(batch.times() == Vector3d(2e-3, 0, 2e-3));
  starts.q(knee.idx_q, 1) -= 1e-3;
  batch.reset(starts.q, starts.v, {0, 1, 0});
  CHECK(batch.ok(1));
}

}  // namespace bielle::worlds
