// The world that moves mechanisms in steps of controlled error: closed forms of the field's benchmarks, random mechanisms of
// every kind, and the trials of all worlds.
#include <catch2/catch.hpp>
#include <cmath>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/worlds/bielle_world.h"
#include "edge_trials.h"
#include "mechanisms.h"
#include "own_robots.h"
#include "selection.h"
#include "world_trials.h"

namespace bielle::worlds {
namespace {

using namespace bielle::testing;

Joint makeHinge(const std::string& name, const Vector3d& at, const Vector3d& axis) {
  Joint joint;
  joint.name = name;
  joint.kind = JointKind::Continuous;
  joint.X_PJ.p = at;
  joint.axis = axis;
  return joint;
}

// A rod of 1 kg from the origin of its link to `end`, with a square section.
Inertia makeRod(const Vector3d& end, double side) {
  const double length = end.norm(), across = (length * length + side * side) / 12, along = side * side / 6;
  const Vector3d e = end / length;
  return {1, 0.5 * end, across * (Matrix3d::Identity() - e * e.transpose()) + along * e * e.transpose()};
}

// N four-bars side by side (IFToMM's problem A02): rods of 1 m upright on the ground, their tops joined.
Model makeFourBars(int count) {
  ModelBuilder builder("four-bars");
  builder.setGravity({0, -9.81, 0});
  const Vector3d up = Vector3d::UnitY(), along = Vector3d::UnitX();
  for (int i = 0; i <= count; ++i)
    builder.addLink("upright" + std::to_string(i), "world",
                    makeHinge("foot" + std::to_string(i), i * along, Vector3d::UnitZ()), makeRod(up, 0));
  for (int i = 0; i < count; ++i) {
    const std::string bar = "bar" + std::to_string(i), next = "upright" + std::to_string(i + 1);
    builder.addLink(bar, "upright" + std::to_string(i), makeHinge("top" + std::to_string(i), up, Vector3d::UnitZ()),
                    makeRod(along, 0));
    builder.addFrame(bar + "-end", bar, {Matrix3d::Identity(), along});
    builder.addFrame(next + "-top", next, {Matrix3d::Identity(), up});
    builder.addClosure("corner" + std::to_string(i), ClosureKind::Ball3D, bar + "-end", next + "-top");
  }
  return builder.build();
}

// All uprights turn at `rate`, and the bars stay level.
VectorXd makeFourBarVelocity(const Model& model, double rate) {
  VectorXd v(model.nv());
  for (size_t j = 1; j < model.joints().size(); ++j)
    v[model.joints()[j].idx_v] = model.joints()[j].name.substr(0, 4) == "foot" ? rate : -rate;
  return v;
}

// Bricard's six hinges (A04): no freedom by count, one in truth.
Model makeBricard() {
  ModelBuilder builder("bricard");
  builder.setGravity({0, -9.81, 0});
  const Vector3d x = Vector3d::UnitX(), y = Vector3d::UnitY(), z = Vector3d::UnitZ();
  const Vector3d rods[] = {x, -y, z, -x, y}, axes[] = {y, z, x, y, z};
  std::string parent = "world";
  Vector3d at = Vector3d::Zero();
  for (int i = 0; i < 5; ++i) {
    const std::string rod = "rod" + std::to_string(i);
    builder.addLink(rod, parent, makeHinge("hinge" + std::to_string(i), at, axes[i]), makeRod(rods[i], 0.1));
    parent = rod, at = rods[i];
  }
  builder.addFrame("end", parent, {Matrix3d::Identity(), at});
  builder.addFrame("ground", "world", {Matrix3d::Identity(), z});
  builder.addClosure("last", ClosureKind::Hinge5D, "end", "ground", x);
  return builder.build();
}

std::unique_ptr<World> makeTight(const Model& model, double tolerance = 1e-11, double height = 0) {
  ManifoldWorldOptions options;
  options.world.ground.height = height;
  options.tolerance = tolerance;
  return makeManifoldWorld(model, options);
}

Vector3d calcPoint(const Model& model, const World& world, int body, const Vector3d& point) {
  Workspace ws(model);
  updatePositions(model, ws, world.configuration());
  return ws.X_WB[body].act(point);
}

}  // namespace

TEST_CASE("manifold world: Bricard's mechanism, with a redundant row, as its closed form") {
  const Model model = makeBricard();
  const auto world = makeTight(model);
  world->reset(model.makeNeutral(), VectorXd::Zero(model.nv()));
  const double start = world->books().energy();
  // The joints turn by (-a, -b, -a, -b, -a) with (1 - sin a)(1 - sin b) = 1; the energy integral by quadrature.
  const double times[] = {0.25, 0.5, 1, 2};
  const Vector3d places[] = {{0.99809250226, -1.05993979848, 0.93826381180},
                             {0.96828367911, -1.22462515944, 0.75014660944},
                             {0.51050146119, -1.64916759940, 0.14012311455},
                             {-0.96934034478, -1.22124689496, 0.75427801078}};
  for (int i = 0; i < 4; ++i) {
    REQUIRE(world->advance(times[i] - world->time()));
    CHECK((calcPoint(model, *world, 3, Vector3d::UnitZ()) - places[i]).norm() < 2e-11);
    CHECK(world->gap() < 1e-12);
  }
  // A period later in the same place, and the energy of the start.
  constexpr double kPeriod = 2 * 2.495855756843;
  REQUIRE(world->advance(2 * kPeriod + 0.5 - world->time()));
  CHECK((calcPoint(model, *world, 3, Vector3d::UnitZ()) - places[1]).norm() < 1e-9);
  CHECK(std::abs(world->books().energy() - start) < 1e-9);
}

TEST_CASE("manifold world: four-bars side by side pass their horizontal posture") {
  struct Case {
    int count;
    double time, x, y;
  };
  for (const Case& c : {Case{2, 1, -0.19502030195, -0.98079920566}, Case{2, 5, -0.81131046101, -0.58461554535},
                        Case{2, 10, 0.3284581115408, 0.9445185381786}, Case{10, 10, 0.20435356099, 0.97889714583}}) {
    const Model model = makeFourBars(c.count);
    const auto world = makeTight(model, 1e-12);
    world->reset(model.makeNeutral(), makeFourBarVelocity(model, -1));
    const double start = world->books().energy();
    const bool advances = world->advance(c.time);
    CAPTURE(c.count, c.time, world->message());
    REQUIRE(advances);
    const Vector3d top = calcPoint(model, *world, 1, Vector3d::UnitY());
    CHECK(std::hypot(top.x() - c.x, top.y() - c.y) < 1e-9);
    CHECK(world->gap() < 1e-12);
    CHECK(std::abs(world->books().energy() - start) < 1e-8);
  }
}

TEST_CASE("manifold world: many four-bars, whose rows are factorized as a sparse matrix") {
  const Model model = makeFourBars(60);
  const auto world = makeTight(model, 1e-9);
  world->reset(model.makeNeutral(), makeFourBarVelocity(model, -1));
  const double start = world->books().energy();
  REQUIRE(world->advance(1.5));  // past the horizontal posture
  CHECK(std::abs(world->books().energy() - start) < 1e-5);
  CHECK(world->gap() < 1e-12);
  const VectorXd& q = world->configuration();
  for (size_t j = 1; j < model.joints().size(); ++j)
    CHECK(std::abs(std::abs(q[model.joints()[j].idx_q]) - std::abs(q[0])) < 1e-6);
}

TEST_CASE("manifold world: a start where the loops are singular is refused with its ranks") {
  const Model model = makeFourBars(2);
  const auto world = makeTight(model);
  VectorXd q = model.makeNeutral();
  for (size_t j = 1; j < model.joints().size(); ++j)
    q[model.joints()[j].idx_q] = model.joints()[j].name.substr(0, 4) == "foot" ? -M_PI / 2 : M_PI / 2;
  world->reset(q, VectorXd::Zero(model.nv()));
  CHECK_FALSE(world->advance(0.1));
  CAPTURE(world->message());
  CHECK(world->message().find("singular at the start: they have rank 2") != std::string::npos);
}

TEST_CASE("manifold world: mechanisms of every joint and closure keep their energy, and converge", "[sweep]") {
  std::mt19937 rng(11);
  Selection selection;
  for (JointKind joint : kJointKinds)
    for (ClosureKind closure : kClosureKinds) {
      if (selection.isLeftOut()) continue;
      const Mechanism mechanism = makeRandomMechanism(rng, joint, closure, MechanismBase::FreeFlyer);
      const Model& model = mechanism.model;
      Workspace ws(model);
      const VectorXd v =
          projectVelocity(model, ws, makeConstraintSet(model), mechanism.q_closed, randomVector(rng, model.nv(), 0.5));
      std::vector<VectorXd> ends;
      for (double tolerance : {1e-6, 1e-9, 1e-12}) {
        const auto world = makeTight(model, tolerance, -100);
        world->reset(mechanism.q_closed, v);
        const double start = world->books().energy();
        const bool advances = world->advance(0.3);
        CAPTURE(getName(joint), getName(closure), tolerance, world->message());
        REQUIRE(advances);
        CHECK(std::abs(world->books().energy() - start) < 1e4 * tolerance * (1 + std::abs(start)));
        CHECK(world->gap() < 1e-11);
        ends.push_back(world->configuration());
      }
      const double coarse = model.difference(ends[0], ends[2]).norm(), fine = model.difference(ends[1], ends[2]).norm();
      CAPTURE(getName(joint), getName(closure), coarse, fine);
      CHECK(coarse < 1e-3);
      CHECK(fine < 1e-6);
    }
}

TEST_CASE("manifold world: a robot stands, is dropped, is pushed and meets its stops as in the other worlds") {
  const Model& model = getBipetto();
  const testing::TrialTolerances tolerances{1e-3, 1e-6, 1e-10};
  testing::checkStanding(*makeTight(model, 1e-6), model, tolerances);
  testing::checkDropped(*makeTight(model, 1e-6), model, tolerances);
  testing::checkPushed(*makeTight(model, 1e-6), model, tolerances);
  testing::checkStopped(*makeTight(model, 1e-6), model, tolerances);
}

TEST_CASE("manifold world: soles and edges rest on the sides and corners of steps", "[sweep]") {
  testing::checkOverhangs([](const Model& model, const WorldOptions& options) {
    return makeManifoldWorld(model, {options, {}, 1e-6});
  });
}

TEST_CASE("manifold world: springs and dampers between points move a linkage, and are booked") {
  const Model model = testing::makeSprungFivebar();
  CHECK(testing::checkSprung(*makeTight(model, 1e-9), model, 1e-7) < 1e-7);
}

}  // namespace bielle::worlds
