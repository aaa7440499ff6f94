// The world of Simbody: the trials of all worlds, and a walk that both worlds carry out alike.
#include <catch2/catch.hpp>

#include "bielle/control/policy.h"
#include "bielle/motion/walk.h"
#include "bielle/worlds/bielle_world.h"
#include "own_robots.h"
#include "world_trials.h"
#include "worlds/simbody_world.h"

namespace bielle::worlds {
namespace {

using bielle::testing::getBipetto;

const testing::TrialTolerances kSimbodyTolerances{0.01, 1e-6, 1e-6};

Policy makeWalkPolicy(const Model& model) {
  WalkOptions options;
  options.speed = 0.4;
  options.steps = 2;
  const Solution solution = solve(makeWalk(model, options));
  REQUIRE(solution.converged());
  return makePolicy(solution);
}

// The configuration after following the policy.
VectorXd follow(World& world, Policy& policy, const Model& model, double duration) {
  Measurement at{0, model.makeNeutral(), VectorXd::Zero(model.nv())};
  policy.getReference(0, at.q, at.v);
  world.reset(at.q, at.v);
  VectorXd u(model.nu());
  for (int i = 0; i < static_cast<int>(std::lround(duration / 1e-3)); ++i) {
    at = {world.time(), world.configuration(), world.velocity()};
    policy.update(at, u);
    world.setTorques(u);
    REQUIRE(world.advance(1e-3));
  }
  return world.configuration();
}

}  // namespace

TEST_CASE("simbody world: a robot stands without creeping") {
  testing::checkStanding(*makeSimbodyWorld(getBipetto()), getBipetto(), kSimbodyTolerances);
}

TEST_CASE("simbody world: a robot is dropped, and the books balance") {
  testing::checkDropped(*makeSimbodyWorld(getBipetto()), getBipetto(), kSimbodyTolerances);
}

TEST_CASE("simbody world: a robot is pushed, and the work of the push is booked") {
  testing::checkPushed(*makeSimbodyWorld(getBipetto()), getBipetto(), kSimbodyTolerances);
}

TEST_CASE("simbody world: a stop holds a joint, and takes energy") {
  testing::checkStopped(*makeSimbodyWorld(getBipetto()), getBipetto(), kSimbodyTolerances);
}

TEST_CASE("simbody world: springs and dampers between points move a linkage, and are booked") {
  const Model model = testing::makeSprungFivebar();
  SimbodyWorldOptions options;
  options.accuracy = 1e-5;
  CHECK(testing::checkSprung(*makeSimbodyWorld(model, options), model, 1e-3) < 1e-3);
}

TEST_CASE("simbody world: where loops are cut does not change the motion", "[long]") {
  const Model& model = getBipetto();
  Policy policy = makeWalkPolicy(model);
  SimbodyWorldOptions options;
  const auto fewest = makeSimbodyWorld(model, options);
  options.as_modelled = true;
  const auto as_modelled = makeSimbodyWorld(model, options);
  // Joints without coordinates in Simbody are read from the placements of their bodies. The state in motion is closed.
  const VectorXd moved = follow(*as_modelled, policy, model, 0.1);
  fewest->reset(moved, as_modelled->velocity());
  CHECK(model.difference(moved, fewest->configuration()).cwiseAbs().maxCoeff() < 1e-6);
  CHECK((as_modelled->velocity() - fewest->velocity()).cwiseAbs().maxCoeff() < 1e-5);
  CHECK(as_modelled->velocity().cwiseAbs().maxCoeff() > 0.1);
  const VectorXd other = follow(*fewest, policy, model, 0.1);
  CHECK(model.difference(moved, other).cwiseAbs().maxCoeff() < 1e-5);
  CHECK(fewest->gap() < 1e-7);
}

TEST_CASE("simbody world: a walk goes as in Bielle's world, the more so the finer the steps", "[long]") {
  const Model& model = getBipetto();
  Policy policy = makeWalkPolicy(model);
  constexpr double kDuration = 0.5;  // a foot has left the ground by then
  const auto run = [&](double time_step) {
    BielleWorldOptions options;
    options.world.time_step = time_step;
    return follow(*makeBielleWorld(model, options), policy, model, kDuration);
  };
  const VectorXd reference = follow(*makeSimbodyWorld(model), policy, model, kDuration);
  const auto compare = [&](const VectorXd& q) { return model.difference(reference, q).cwiseAbs().maxCoeff(); };
  const double coarse = compare(run(5e-4)), fine = compare(run(1.25e-4));
  CHECK(fine < 2e-5);
  CHECK(fine < 0.2 * coarse);
  // The state an instant of control earlier is another one.
  CHECK(compare(follow(*makeBielleWorld(model), policy, model, kDuration - 1e-3)) > 10 * fine);
}

}  // namespace bielle::worlds
