// The world of Simbody: the trials of all worlds, and a walk that both worlds carry out alike.
#include <catch2/catch.hpp>

#include "bielle/control/policy.h"
#include "bielle/dynamics/assembly.h"
#include "bielle/model/builder.h"
#include "bielle/motion/walk.h"
#include "bielle/worlds/bielle_world.h"
#include "edge_trials.h"
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

TEST_CASE("simbody world: soles and edges rest on the sides and corners of steps", "[sweep]") {
  testing::checkOverhangs([](const Model& model, const WorldOptions& options) {
    SimbodyWorldOptions simbody;
    simbody.world = options;
    return makeSimbodyWorld(model, simbody);
  });
}

TEST_CASE("simbody world: a sole bears the same moment about its normal on level ground and on steps") {
  testing::checkTwists([](const Model& model, const WorldOptions& options) {
    SimbodyWorldOptions simbody;
    simbody.world = options;
    return makeSimbodyWorld(model, simbody);
  });
}

TEST_CASE("simbody world: a sole stops at the side of a step") {
  testing::checkRisers([](const Model& model, const WorldOptions& options) {
    SimbodyWorldOptions simbody;
    simbody.world = options;
    return makeSimbodyWorld(model, simbody);
  });
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

TEST_CASE("simbody world: loops at rest do not loosen the one that moves") {
  // Four-bars side by side without gravity, of which the first one turns.
  const auto findLargestGap = [](int loops) {
    ModelBuilder builder("bars");
    builder.setGravity(Vector3d::Zero());
    for (int i = 0; i < loops; ++i) {
      const std::string number = std::to_string(i);
      const auto add = [&](const std::string& link, const std::string& parent, double x) {
        Joint joint;
        joint.name = link + "_joint";
        joint.kind = JointKind::Continuous;
        joint.axis = Vector3d::UnitY();
        joint.X_PJ.p = Vector3d(x, parent == "world" ? i : 0, 0);
        Inertia inertia;
        inertia.mass = 1;
        inertia.com = Vector3d(0.1, 0, 0);
        inertia.I_com = 0.01 * Matrix3d::Identity();
        builder.addLink(link, parent, joint, inertia);
      };
      add("crank" + number, "world", 0);
      add("coupler" + number, "crank" + number, 0.15);
      add("rocker" + number, "world", 0.4);
      builder.addFrame("end" + number, "coupler" + number, {Matrix3d::Identity(), Vector3d(0.35, 0, 0)});
      builder.addFrame("tip" + number, "rocker" + number, {Matrix3d::Identity(), Vector3d(0.3, 0, 0)});
      builder.addClosure("loop" + number, ClosureKind::Ball3D, "end" + number, "tip" + number);
    }
    const Model model = builder.build();
    VectorXd q = model.makeNeutral(), v = VectorXd::Zero(model.nv());
    for (int i = 0; i < loops; ++i) q.segment<3>(3 * i) << -1, 0.5, -1.6;
    q = closeConfiguration(model, q).q;
    v[0] = 8;
    Workspace ws(model);
    v = projectVelocity(model, ws, makeConstraintSet(model), q, v);
    REQUIRE(v.head<3>().norm() > 1);
    SimbodyWorldOptions options;
    options.gap = 1e-5;
    const auto world = makeSimbodyWorld(model, options);
    world->reset(q, v);
    double largest = 0;
    for (int i = 0; i < 200; ++i) {
      REQUIRE(world->advance(0.005));
      largest = std::max(largest, world->gap());
    }
    CHECK(world->integration().closure_tolerance == options.gap);
    return largest;
  };
  const double alone = findLargestGap(1), among_others = findLargestGap(25);
  CAPTURE(alone, among_others);
  CHECK(alone > 1e-7);  // or else nothing is tried
  CHECK(among_others < std::sqrt(3) * 1e-5);
}

TEST_CASE("simbody world: where the engine breaks off, the motion up to there remains, with its reason") {
  // Bennett's linkage, which moves in space with five redundant rows: Simbody's projection may give up.
  const double a = 0.25, alpha = 35 * EIGEN_PI / 180, beta = 80 * EIGEN_PI / 180,
               b = a * std::sin(beta) / std::sin(alpha);
  const double at1 = 1.0;
  const double at2 = 2 * std::atan(std::sin((beta + alpha) / 2) / std::sin((beta - alpha) / 2) / std::tan(at1 / 2));
  const auto place = [](double x, double twist) {
    return SE3{Eigen::AngleAxisd(twist, Vector3d::UnitX()).toRotationMatrix(), {x, 0, 0}};
  };
  ModelBuilder builder("bennett");
  std::string parent = "world";
  const auto addLink = [&](const std::string& name, const SE3& X_PJ, double length) {
    Joint joint;
    joint.name = name;
    joint.kind = JointKind::Continuous;
    joint.axis = Vector3d::UnitZ();
    joint.X_PJ = X_PJ;
    builder.addLink(joint.name, parent, joint, Inertia{0.3, {length / 2, 0, 0}, 3e-4 * Matrix3d::Identity()});
    parent = name;
  };
  addLink("l1", place(0, 0), a);
  addLink("l2", place(a, alpha), b);
  addLink("l3", place(b, beta), a);
  builder.addFrame("end", parent, place(a, alpha));
  builder.addFrame("seat", "world", place(-b, -beta));
  builder.addClosure("pin", ClosureKind::Hinge5D, "end", "seat", Vector3d::UnitZ());
  const Model model = builder.build();
  const VectorXd q = closeConfiguration(model, (VectorXd(3) << at1, at2, -at1).finished()).q;
  Workspace ws(model);
  const VectorXd v = projectVelocity(model, ws, makeConstraintSet(model), q, VectorXd::Unit(3, 0) * 8);
  REQUIRE(v.norm() > 1);
  int broken = 0;
  for (const double accuracy : {1e-3, 1e-4, 1e-5, 1e-6}) {
    CAPTURE(accuracy);
    SimbodyWorldOptions options;
    options.accuracy = accuracy;
    const auto world = makeSimbodyWorld(model, options);
    world->reset(q, v);
    const double energy = world->books().energy();
    bool is_going = true;
    VectorXd last = q;
    double time = 0;
    for (int i = 0; i < 300 && is_going; ++i) {
      last = world->configuration();
      time = world->time();
      is_going = world->advance(0.01);
      CHECK(world->gap() < 1e-4);
      CHECK(world->books().energy() == Approx(energy).epsilon(0.02));
    }
    if (is_going) continue;
    ++broken;
    CAPTURE(world->message());
    CHECK_THAT(world->message(), Catch::Contains("step"));
    CHECK_THAT(world->message(), !Catch::Contains("State Cache entry"));
    CHECK(world->time() == time);
    CHECK(world->configuration() == last);
  }
  CHECK(broken > 0);  // or else nothing is tried
}

TEST_CASE("simbody world: no step is longer than is asked for") {
  SimbodyWorldOptions options;
  const Model model = testing::makeSprungFivebar();
  const auto findLongestStep = [&](double time_step) {
    options.world.time_step = time_step;
    const auto world = makeSimbodyWorld(model, options);
    world->reset(findClosedConfiguration(model).q, VectorXd::Zero(model.nv()));
    REQUIRE(world->advance(0.1));
    return world->integration().longest_step;
  };
  CHECK(findLongestStep(0) > 2e-3);
  CHECK(findLongestStep(1e-3) == Approx(1e-3));
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
