// Worlds of a batch with windings and rods of their own: single worlds of models that were built with these, as an oracle.
#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <string>

#include "batch_starts.h"
#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/constrained.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/model/builder.h"
#include "bielle/worlds/batch.h"
#include "count_allocations.h"
#include "dynamics/largest_gaps.h"
#include "own_robots.h"
#include "worlds/contact_law.h"

namespace bielle::worlds {
namespace {

using bielle::testing::BatchStart;
using bielle::testing::getBipetto;
using bielle::testing::isEqual;
using bielle::testing::loadOwn;
using bielle::testing::makeBatchOptions;
using bielle::testing::makeStarts;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

using MakeModel = std::function<Model(int world)>;

// Velocities of all worlds less those of robots of models of their own, alone.
MatrixXd calcDifference(const Model& model, const WorldParameters& parameters, const MakeModel& makeAlone,
                        const BatchStart& starts, double time_step, double duration,
                        const BatchStart* other = nullptr) {
  const auto makeWorld = [&](int i) { return makeBielleWorld(makeAlone(i), makeBatchOptions(time_step).world); };
  return bielle::testing::subtractAlone(model, parameters, makeWorld, starts, time_step, duration, other);
}

// Bipetto with gear motors whose supply bounds the torque of those that turn fast.
Model makeWound() {
  ModelParts parts = takeParts(getBipetto());
  for (Motor& motor : parts.motors) {
    motor.drive.ratio = 9;
    motor.drive.torque_constant = 0.1;
    motor.drive.resistance = 0.4;
    motor.drive.voltage = 4;
    motor.drive.current = 12;
    motor.drive.efficiency = 0.9;
    motor.effort_limit = std::min(motor.effort_limit, 0.9 * 9 * 0.1 * 12);
  }
  return ModelBuilder::restore(std::move(parts));
}

WorldParameters makeWindings(const Model& model, int count) {
  std::mt19937 generator(3);
  std::uniform_real_distribution<double> any(0.8, 1.25);
  WorldParameters out;
  for (MatrixXd* x : {&out.torque_constants, &out.resistances, &out.voltages, &out.currents})
    *x = MatrixXd::NullaryExpr(model.nu(), count, [&] { return any(generator); });
  out.torque_constants *= 0.1;
  out.resistances *= 0.4;
  out.voltages *= 4;
  out.currents *= 6;
  return out;
}

Model rewind(const Model& model, const WorldParameters& p, int world) {
  ModelParts parts = takeParts(model);
  for (int m = 0; m < model.nu(); ++m) {
    Motor& motor = parts.motors[m];
    motor.drive.torque_constant = p.torque_constants(m, world);
    motor.drive.resistance = p.resistances(m, world);
    motor.drive.voltage = p.voltages(m, world);
    motor.drive.current = p.currents(m, world);
    motor.effort_limit = std::min(motor.effort_limit, 0.9 * 9 * motor.drive.torque_constant * motor.drive.current);
  }
  return ModelBuilder::restore(std::move(parts));
}

// Of linkages of a crank and a rocker, whose hinges are not parallel.
enum class Ties { Distance, Ball, BallFromRocker, Halves };
const Vector3d kCrankEnd(0, 0, 0.1), kRocker(0.3, 0, 0), kRockerEnd(0, 0, 0.15);
const Vector3d kRodLine = kRocker + kRockerEnd - kCrankEnd;

// \param longer  than its line, m. The rod has no mass, so that the metric (reduction.h) of each is the same
Model makeCrankRocker(Ties ties, double longer) {
  ModelBuilder builder("crank and rocker");
  builder.setGravity({0, 0, -9.81});
  const auto makeHinge = [](const char* name, const Vector3d& axis, const Vector3d& p) {
    Joint joint;
    joint.name = name;
    joint.kind = JointKind::Revolute;
    joint.axis = axis.normalized();
    joint.X_PJ.p = p;
    return joint;
  };
  const auto makeCross = [](const char* name, JointKind kind, const Vector3d& p) {
    Joint joint;
    joint.name = name;
    joint.kind = kind;
    joint.axis = Vector3d::UnitY();
    joint.axis2 = Vector3d::UnitZ();
    joint.X_PJ.p = p;
    return joint;
  };
  const Inertia arm{0.2, {0.01, 0, 0.05}, 1e-4 * Matrix3d::Identity()};
  const Vector3d u = kRodLine.normalized(), middle = 0.4 * kRodLine;
  const auto at = [](const Vector3d& p) { return SE3(Matrix3d::Identity(), p); };
  const SE3 turned(Eigen::AngleAxisd(0.8, Vector3d(1, 2, 3).normalized()).toRotationMatrix(), Vector3d::Zero());
  builder.addLink("crank", "world", makeHinge("crank", {0, 1, 0}, Vector3d::Zero()), arm);
  builder.addLink("rocker", "world", makeHinge("rocker", {0.2, 1, 0.1}, kRocker), arm);
  builder.addFrame("crank end", "crank", at(kCrankEnd));
  builder.addFrame("rocker end", "rocker", at(kRockerEnd));
  if (ties == Ties::Distance) {
    builder.addDistance("rod", "crank end", "rocker end", kRodLine.norm() + longer);
  } else {
    const bool halves = ties == Ties::Halves;
    builder.addLink("rod", "crank", makeCross("rod", halves ? JointKind::Spherical : JointKind::Universal, kCrankEnd),
                    {});
    builder.addFrame("rod end", "rod", at((halves ? middle : kRodLine) + longer * u) * turned);
    if (halves) {
      builder.addLink("other half", "rocker", makeCross("other half", JointKind::Universal, kRockerEnd), {});
      builder.addFrame("other end", "other half", at(middle - kRodLine) * turned);
      builder.addClosure("rod", ClosureKind::Weld6D, "rod end", "other end");
    } else if (ties == Ties::Ball) {
      builder.addClosure("rod", ClosureKind::Ball3D, "rod end", "rocker end");
    } else {
      builder.addClosure("rod", ClosureKind::Ball3D, "rocker end", "rod end");
    }
  }
  builder.addMotor("crank", 1e-4);
  builder.addMotor("rocker", 1e-4);
  return builder.build();
}

BatchStart closeStarts(const MakeModel& makeAlone, const BatchStart& near) {
  BatchStart out = near;
  for (int i = 0; i < near.q.cols(); ++i) {
    const Model own = makeAlone(i);
    const AssemblyResult closed = closeConfiguration(own, near.q.col(i));
    REQUIRE(closed.status == NumericalStatus::Ok);
    out.q.col(i) = closed.q;
    Workspace ws(own);
    out.v.col(i) = projectVelocity(own, ws, makeConstraintSet(own), closed.q, near.v.col(i));
  }
  return out;
}

double calcGap(const Model& model, ConstVectorRef q) {
  Workspace ws(model);
  updatePlacements<double>(model, ws, q);
  const ClosureGap gap = calcLargestGaps(model, ws);
  return std::max(gap.position, gap.angle);
}

// Changes of Bipetto's rods of up to 1 mm; every other world has none.
MatrixXd drawChanges(const Model& model, int count) {
  std::mt19937 generator(6);
  std::uniform_real_distribution<double> any(-1e-3, 1e-3);
  MatrixXd out = MatrixXd::Zero(static_cast<Eigen::Index>(model.closures().size()), count);
  for (int i = 1; i < count; i += 2)
    for (double& x : out.col(i)) x = any(generator);
  return out;
}

// Bipetto's rods are halves on lines from pivot to pivot: from the origin of one half to that of the other.
Model lengthenRods(const Model& model, ConstVectorRef changes) {
  ModelParts parts = takeParts(model);
  for (size_t c = 0; c < parts.closures.size(); ++c) {
    Closure& closure = parts.closures[c];
    REQUIRE(closure.kind == ClosureKind::Weld6D);
    const Vector3d line = closure.X_B1.p - closure.X_B1.R * closure.X_B2.R.transpose() * closure.X_B2.p;
    closure.X_B1.p += changes[static_cast<Eigen::Index>(c)] * line.normalized();
  }
  return ModelBuilder::restore(std::move(parts));
}

}  // namespace

TEST_CASE("batch: windings of a world are those of a changed model") {
  const Model model = makeWound();
  constexpr int kCount = 10;
  BatchStart starts = makeStarts(model, kCount, 9);
  starts.v *= 4;  // fast motors
  const WorldParameters parameters = makeWindings(model, kCount);
  const auto compare = [&](const WorldParameters& alone) {
    const auto makeAlone = [&](int i) { return rewind(model, alone, i); };
    return calcDifference(model, parameters, makeAlone, starts, 1e-3, 2e-3).cwiseAbs().maxCoeff();
  };
  CHECK(compare(parameters) < 1e-11);
  for (const auto part : {&WorldParameters::torque_constants, &WorldParameters::resistances, &WorldParameters::voltages,
                          &WorldParameters::currents}) {
    WorldParameters other = parameters;
    (other.*part) *= 1.001;
    CHECK(compare(other) > 1e-6);
  }
  // Where the supply bounds nothing else, torques are those of MotorDrive, Eq. (1): |R u / (e n k) + n k w| = U.
  WorldBatch batch(model, kCount, makeBatchOptions(1e-3));
  batch.set(parameters);
  batch.reset(starts.q, starts.v);
  const MatrixXd v = batch.velocities();
  CHECK(batch.step(100 * starts.u, starts.push, 1e-3));
  int num_bounded = 0;
  for (int i = 0; i < kCount; ++i)
    for (int m = 0; m < model.nu(); ++m) {
      const Motor& motor = model.motors()[m];
      const double k = 9 * parameters.torque_constants(m, i), u = batch.torques()(m, i);
      const double most = std::min(motor.effort_limit, 0.9 * k * parameters.currents(m, i));
      CHECK(std::abs(u) < (1 + 1e-12) * most);
      if (std::abs(u) > (1 - 1e-9) * most) continue;
      ++num_bounded;
      const double volts = parameters.resistances(m, i) * u / (0.9 * k) + k * v(motor.dof, i);
      CHECK(std::abs(volts) == Approx(parameters.voltages(m, i)).epsilon(1e-12));
    }
  CHECK(num_bounded > 20);
}

TEST_CASE("batch: rods of a world are those of a changed model") {
  constexpr int kCount = 11;
  for (const Ties ties : {Ties::Distance, Ties::Ball, Ties::BallFromRocker, Ties::Halves}) {
    CAPTURE(static_cast<int>(ties));
    const Model model = makeCrankRocker(ties, 0);
    WorldParameters parameters;
    parameters.rod_changes.setZero(1, kCount);
    for (int i = 1; i < kCount; i += 2) parameters.rod_changes(0, i) = 2e-3 * (i - 5.5);
    const auto makeAlone = [&](int i) { return makeCrankRocker(ties, parameters.rod_changes(0, i)); };
    BatchStart starts{model.makeNeutral().replicate(1, kCount), MatrixXd::Zero(model.nv(), kCount), MatrixXd(2, kCount),
                      MatrixXd::Zero(3, kCount)};
    starts.v.row(0).setConstant(2);
    for (int i = 0; i < kCount; ++i) starts.u.col(i) << 0.02 * (i % 3), -0.05;
    starts = closeStarts(makeAlone, starts);
    CHECK(calcDifference(model, parameters, makeAlone, starts, 1e-3, 0.1).cwiseAbs().maxCoeff() < 1e-11);
    const auto makeOther = [&](int i) { return makeCrankRocker(ties, 1.001 * parameters.rod_changes(0, i)); };
    const BatchStart others = closeStarts(makeOther, starts);
    CHECK(calcDifference(model, parameters, makeOther, starts, 1e-3, 0.1, &others).cwiseAbs().maxCoeff() > 1e-6);

    // To the last bit: worlds of the model as without the others, the others as alone.
    WorldBatch together(model, kCount, makeBatchOptions(1e-3)), plain(model, kCount, makeBatchOptions(1e-3));
    together.set(parameters);
    for (WorldBatch* batch : {&together, &plain}) {
      batch->reset(starts.q, starts.v);
      batch->step(starts.u, starts.push, 0.1);
    }
    for (int i = 0; i < kCount; ++i) {
      CHECK(together.ok(i));
      WorldBatch alone(model, 1, makeBatchOptions(1e-3));
      WorldParameters own;
      own.rod_changes = parameters.rod_changes.col(i);
      alone.set(own);
      alone.reset(starts.q.col(i), starts.v.col(i));
      CHECK(alone.step(starts.u.col(i), starts.push.col(i), 0.1));
      CHECK(isEqual(alone.configurations(), together.configurations().col(i)));
      CHECK(isEqual(alone.velocities(), together.velocities().col(i)));
      CHECK(isEqual(plain.velocities().col(i), together.velocities().col(i)) == (i % 2 == 0));
      CHECK(calcGap(makeAlone(i), together.configurations().col(i)) < 1e-12);
    }
  }
}

// As with masses, the metric of a batch is that of one model: to second order in the step both are the same.
TEST_CASE("batch: rods of a robot are those of a changed model as steps become short") {
  const Model& model = getBipetto();
  constexpr int kCount = 4;
  WorldParameters parameters;
  parameters.rod_changes = drawChanges(model, kCount);
  const auto makeAlone = [&](int i) { return lengthenRods(model, parameters.rod_changes.col(i)); };
  BatchStart starts = makeStarts(model, kCount, 9);
  starts.q.row(2).array() += 1;
  starts = closeStarts(makeAlone, starts);
  const auto extrapolate = [&](const MakeModel& make) {
    const BatchStart own = closeStarts(make, starts);
    const auto calc = [&](double h) { return calcDifference(model, parameters, make, starts, h, 0.01, &own); };
    return ((4 * calc(1.25e-4) - calc(2.5e-4)) / 3).cwiseAbs().maxCoeff();
  };
  CHECK(extrapolate(makeAlone) < 2e-5);
  CHECK(extrapolate([&](int i) { return lengthenRods(model, 1.1 * parameters.rod_changes.col(i)); }) > 1e-4);
}

TEST_CASE(
    "batch: worlds whose rods change wait for a reset, which closes their loops and leaves feet at their height") {
  const Model& model = getBipetto();
  constexpr int kCount = 10;
  const BatchStart starts = makeStarts(model, kCount, 3);
  WorldParameters parameters;
  parameters.rod_changes = drawChanges(model, kCount);
  WorldBatch batch(model, kCount, makeBatchOptions(1e-3)), plain(model, kCount, makeBatchOptions(1e-3));
  for (WorldBatch* each : {&batch, &plain}) {
    each->reset(starts.q, starts.v);
    CHECK(each->step(starts.u, starts.push, 2e-3));
  }
  batch.set(parameters);
  CHECK_FALSE(batch.step(starts.u, starts.push, 2e-3));
  CHECK(plain.step(starts.u, starts.push, 2e-3));
  for (int i = 0; i < kCount; ++i) {
    CHECK(batch.ok(i) == (i % 2 == 0));
    CHECK(isEqual(batch.velocities().col(i), plain.velocities().col(i)) == (i % 2 == 0));
  }
  CHECK_THAT(batch.message(1), Catch::Contains("rods") && Catch::Contains("reset it"));
  batch.set(parameters);  // the same ones
  batch.reset(starts.q, starts.v);
  Workspace ws(model);
  for (int i = 0; i < kCount; ++i) {
    const VectorXd q = batch.configurations().col(i);
    CHECK(batch.ok(i));
    CHECK(calcGap(lengthenRods(model, parameters.rod_changes.col(i)), q) < 1e-12);
    CHECK((calcGap(model, q) > 1e-5) == (i % 2 == 1));
    CHECK(calcLeastHeight(model, ws, q) == Approx(calcLeastHeight(model, ws, starts.q.col(i))).margin(1e-12));
  }
  for (int k = 0; k < 50; ++k) CHECK(batch.step(MatrixXd::Zero(model.nu(), kCount), starts.push, 2e-3));
  for (int i = 1; i < kCount; i += 2)
    CHECK(calcGap(lengthenRods(model, parameters.rod_changes.col(i)), batch.configurations().col(i)) < 1e-11);
  // As it was.
  parameters.rod_changes.setZero();
  batch.set(parameters);
  for (WorldBatch* each : {&batch, &plain}) {
    each->reset(starts.q, starts.v);
    CHECK(each->step(starts.u, starts.push, 2e-3));
  }
  for (int i = 0; i < kCount; ++i) CHECK(isEqual(batch.velocities().col(i), plain.velocities().col(i)));
}

TEST_CASE("batch: a rod that does not reach breaks off its world alone") {
  const Model model = makeCrankRocker(Ties::Ball, 0);
  WorldParameters parameters;
  parameters.rod_changes.setZero(1, 3);
  parameters.rod_changes(0, 1) = 1;
  WorldBatch batch(model, 3, makeBatchOptions(1e-3));
  batch.set(parameters);
  batch.reset(model.makeNeutral().replicate(1, 3), MatrixXd::Zero(model.nv(), 3));
  CHECK(batch.ok(0));
  CHECK_FALSE(batch.ok(1));
  CHECK(batch.ok(2));
  CHECK_THAT(batch.message(1), Catch::Contains("'rod' does not close") && Catch::Contains("left open"));
}

TEST_CASE("batch: nothing is allocated where rods and windings differ") {
  const Model& model = getBipetto();
  const BatchStart starts = makeStarts(model, 10, 3);
  WorldBatch batch(model, 10, makeBatchOptions(1e-3));
  WorldParameters parameters;
  parameters.rod_changes = drawChanges(model, 10);
  parameters.torque_constants.setConstant(model.nu(), 10, 0.5);
  parameters.resistances.setConstant(model.nu(), 10, 0.2);
  parameters.voltages.setConstant(model.nu(), 10, 24);
  batch.set(parameters);
  const auto run = [&] {
    batch.reset(starts.q, starts.v);
    return batch.step(starts.u, starts.push, 2e-3);
  };
  CHECK(run());
  const long before = num_allocations;
  const bool is_ok = run();
  CHECK(num_allocations == before);
  CHECK(is_ok);
}

TEST_CASE("batch: windings and rods that cannot be are refused, with a remedy") {
  const auto refuses = [](const Model& model, const WorldParameters& parameters, const char* what, const char* remedy) {
    WorldBatch batch(model, 2, makeBatchOptions(1e-3));
    CHECK_THROWS_WITH(batch.set(parameters), Catch::Contains(what) && Catch::Contains(remedy));
    CHECK(batch.parameters().rod_changes.isZero(0));
  };
  const auto change = [](const Model& model, int closure, double by) {
    WorldParameters out;
    out.rod_changes.setZero(static_cast<Eigen::Index>(model.closures().size()), 2);
    out.rod_changes(closure, 1) = by;
    return out;
  };
  const Model fourbar = loadOwn("fourbar").model, belts = loadOwn("belt_biped").model,
              own = makeCrankRocker(Ties::Distance, 0);
  refuses(fourbar, change(fourbar, 0, 1e-3), "rod_changes of world 1, closure 'coupler': of the 6 rows of its loops 3 ",
          "make it a closure of type distance");
  refuses(belts, change(belts, 0, 1e-3), "it does not close the end of a rod", "name a rod with a body of its own");
  refuses(own, change(own, 0, -1), "closure 'rod': its rod has a length of 0.304138 m", "take off less");
  refuses(own, change(own, 0, kInfinity), "rod_changes of world 1 has a inf", "finite");
  WorldParameters windings;
  windings.voltages.setConstant(own.nu(), 2, 24);
  refuses(own, windings, "motor 'crank' of world 0 has a resistance, a voltage or a current", "give torque_constants");
  windings.torque_constants.setConstant(own.nu(), 2, -1);
  refuses(own, windings, "torque_constants of world 0 has a -1", "not negative");
  windings.torque_constants.setConstant(own.nu() + 1, 2, 1);
  refuses(own, windings, "torque_constants is 3 x 2", "give 2 x 2");
  windings.torque_constants.setConstant(own.nu(), 2, 1);
  windings.voltages(1, 1) = 0;
  refuses(own, windings, "voltages of world 1 has a 0", "positive");
}

}  // namespace bielle::worlds
