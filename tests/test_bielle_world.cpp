// The world of Bielle's own dynamics: the trials of all worlds, forward dynamics of the full system as an oracle, the order
// of its steps, and no allocation.
#include <atomic>
#include <catch2/catch.hpp>
#include <random>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/constrained.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/motion/motion.h"
#include "bielle/worlds/bielle_world.h"
#include "count_allocations.h"
#include "edge_trials.h"
#include "mechanisms.h"
#include "own_robots.h"
#include "selection.h"
#include "world_trials.h"
#include "worlds/make_world.h"
#include "worlds/motion_recorder.h"

namespace bielle::worlds {
namespace {

using bielle::testing::getBipetto;

std::unique_ptr<World> makeTestWorld(double time_step = 0) {
  BielleWorldOptions options;
  options.world.time_step = time_step;
  return makeBielleWorld(getBipetto(), options);
}

const testing::TrialTolerances kBielleTolerances{1e-3, 1e-6, 1e-10};

// A robot in the air that moves in all coordinates.
struct Flight {
  VectorXd q, v, u;
};
Flight makeFlight() {
  const Model& model = getBipetto();
  Workspace ws(model);
  Flight flight{makeStandingPosture(model), VectorXd(model.nv()), VectorXd(model.nu())};
  flight.q[2] += 3;
  for (int i = 0; i < model.nv(); ++i) flight.v[i] = 0.5 * std::sin(1.0 + 2.3 * i);
  flight.v = projectVelocity(model, ws, makeConstraintSet(model), flight.q, flight.v);
  for (int i = 0; i < model.nu(); ++i) flight.u[i] = 0.3 * std::cos(1.7 * i);
  return flight;
}

// A limp robot, dropped from 15 cm with a random velocity of its trunk of up to 2 m/s and rad/s, falls for a second.
struct Fall {
  double imbalance = 0;  // largest of the books, over the energy at the start
  std::string message;
  Vector3d place;  // of the trunk at the end, m
};
Fall dropLimp(const Model& model, double time_step, unsigned seed, double duration = 1) {
  BielleWorldOptions options;
  options.world.time_step = time_step;
  const auto world = makeBielleWorld(model, options);
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> velocity(-2, 2);
  VectorXd q = makeStandingPosture(model), v = VectorXd::Zero(model.nv());
  q[2] += 0.15;
  for (int i = 0; i < 6; ++i) v[i] = velocity(generator);
  v[2] = -std::abs(v[2]);
  world->reset(q, v);
  const Books start = world->books();
  Fall fall;
  for (int i = 0; i < std::lround(duration / 0.005) && world->advance(0.005); ++i) {
    const Books now = world->books();
    const double taken = now.motor_work + now.push_work - now.contact_loss - now.stop_loss - now.other_loss;
    fall.imbalance =
        std::max(fall.imbalance, std::abs(now.energy() - start.energy() - taken) / std::abs(start.energy()));
  }
  fall.message = world->message();
  fall.place = world->configuration().head<3>();
  return fall;
}

}  // namespace

TEST_CASE("bielle world: the books of limp robots that fall balance, at any step") {
  bielle::testing::Selection selection(1);
  for (double h : {2e-3, 1e-3, 2.5e-4})
    for (unsigned seed : {7u, 10u, 14u}) {
      if (selection.isLeftOut()) continue;
      const Fall fall = dropLimp(getBipetto(), h, seed);
      CAPTURE(h, seed);
      CHECK(fall.message == "");
      CHECK(fall.imbalance < 0.01);
    }
}

// The heel rod of spring_biped, which has no stops, ends the way of its knee 0.13 rad before the leg is straight: what moved the shin
// moves the light leaf at the heel then, whose speed doubles to 200 rad/s within 0.1 ms.
TEST_CASE("bielle world: the books of limp legs balance that their own rods stop") {
  const Model model = bielle::testing::loadOwn("spring_biped").model;
  bielle::testing::Selection selection(1);
  for (const auto& [h, seed] : {std::pair(1e-3, 1u), {1e-3, 8u}, {2.5e-4, 3u}}) {
    if (selection.isLeftOut()) continue;
    const Fall fall = dropLimp(model, h, seed);
    CAPTURE(h, seed);
    CHECK(fall.message == "");
    CHECK(fall.imbalance < 0.01);
  }
}

TEST_CASE("bielle world: a limp robot that lands is where it is after fine steps") {
  bielle::testing::Selection selection(1);
  for (unsigned seed : {1u, 2u, 3u, 7u, 9u}) {
    if (selection.isLeftOut()) continue;
    const auto drop = [&](double h) { return dropLimp(getBipetto(), h, seed, 0.16).place; };
    const Vector3d fine = drop(5e-5);
    CAPTURE(seed);
    CHECK((drop(2.5e-4) - fine).norm() < 0.006);
    CHECK((drop(1e-3) - fine).norm() < 0.03);  // MuJoCo's world: 0.034
  }
}

TEST_CASE("bielle world: the books of several robots that fall balance, or it is said when and why not", "[long]") {
  int falls = 0, flagged = 0;
  for (const char* robot : {"bipetto", "cleobot", "rsu_biped", "leg_biped"}) {
    const Model model = bielle::testing::loadOwn(robot).model;
    for (double h : {2.5e-4, 1e-3, 2e-3})
      for (unsigned seed = 0; seed < 8; ++seed) {
        const Fall fall = dropLimp(model, h, seed);
        CAPTURE(robot, h, seed, fall.message);
        CHECK(fall.imbalance < 0.01);
        ++falls;
        flagged += !fall.message.empty();
      }
  }
  CAPTURE(falls);
  CHECK(flagged <= falls / 100);
}

TEST_CASE("bielle world: one that breaks off says when, in what step and by how much, and leaves others alone") {
  const Model& model = getBipetto();
  const auto advance = [&](World& world) {
    for (int i = 0; i < 40; ++i) world.advance(1e-3);
  };
  VectorXd q = makeStandingPosture(model);
  q[2] += 0.01;
  const VectorXd v = VectorXd::Zero(model.nv());
  const auto alone = makeTestWorld();
  alone->reset(q, v);
  advance(*alone);
  std::vector<std::unique_ptr<World>> worlds;
  for (int i = 0; i < 3; ++i) worlds.push_back(makeTestWorld()), worlds.back()->reset(q, v);
  for (int i = 0; i < 40; ++i)
    for (size_t w = 0; w < worlds.size(); ++w) {
      if (w == 1 && i == 20) worlds[w]->setPush(Vector3d(1e13, 0, 0));
      worlds[w]->advance(1e-3);
    }
  CAPTURE(worlds[1]->message());
  CHECK_THAT(worlds[1]->message(),
             Catch::StartsWith("after 0.0200") && Catch::Contains(" s, in a step of 2.44e-07 s: "));
  // Which of both is noticed first is a matter of rounding.
  CHECK_THAT(worlds[1]->message(), Catch::EndsWith("m or rad are left open") || Catch::EndsWith(" J"));
  CHECK(worlds[1]->time() == Approx(0.02));
  CHECK(worlds[1]->configuration().allFinite());
  CHECK(worlds[1]->velocity().allFinite());
  for (int w : {0, 2}) {
    CHECK(worlds[w]->message().empty());
    CHECK(worlds[w]->configuration() == alone->configuration());
    CHECK(worlds[w]->velocity() == alone->velocity());
  }
}

TEST_CASE("bielle world: a robot stands without creeping") {
  testing::checkStanding(*makeTestWorld(), getBipetto(), kBielleTolerances);
}

TEST_CASE("bielle world: a robot is dropped, and the books balance") {
  testing::checkDropped(*makeTestWorld(), getBipetto(), kBielleTolerances);
}

TEST_CASE("bielle world: a robot is pushed, and the work of the push is booked") {
  testing::checkPushed(*makeTestWorld(), getBipetto(), kBielleTolerances);
}

TEST_CASE("bielle world: soles and edges rest on the sides and corners of steps", "[sweep]") {
  testing::checkOverhangs([](const Model& model, const WorldOptions& options) {
    return makeBielleWorld(model, {options, {}});
  });
}

TEST_CASE("bielle world: a sole bears the same moment about its normal on level ground and on steps") {
  testing::checkTwists([](const Model& model, const WorldOptions& options) {
    return makeBielleWorld(model, {options, {}});
  });
}

TEST_CASE("bielle world: a sole stops at the side of a step") {
  testing::checkRisers([](const Model& model, const WorldOptions& options) {
    return makeBielleWorld(model, {options, {}});
  });
}

TEST_CASE("bielle world: how far a loaded foot turns and sinks is recorded, and told") {
  const Model model = testing::makeBlock(ContactKind::Surface6D, {0, 0, 0.05});
  const auto world = makeBielleWorld(model);
  const auto observe = [&](double pitch, double depth) {
    VectorXd q = model.makeNeutral();
    q.head<7>() << 0, 0, 0.05 * std::sin(pitch) - depth, 0, std::sin(pitch / 2), 0, std::cos(pitch / 2);
    world->reset(q, VectorXd::Zero(model.nv()));
    MotionRecorder recorder(*world, 1);
    recorder.addNode();
    REQUIRE(world->advance(2.5e-4));
    recorder.noteAdvance(0);
    CHECK(recorder.happened.largest_tilt.value == Approx(pitch).margin(2e-3));
    CHECK(recorder.happened.largest_depth.value == Approx(depth).epsilon(0.1));
    return describeFeet(model, recorder.happened);
  };
  CHECK(observe(0.1, 1e-3).empty());
  CHECK(observe(0.3, 1e-3).find("contact foot was turned from the ground by 0.30 rad") == 0);
  CHECK(observe(0.1, 8e-3).find("contact foot sank into the ground by 0.008 m") == 0);
}

TEST_CASE("bielle world: a push of another body than the trunk moves it as steps of controlled error do") {
  const Model model = bielle::testing::loadOwn("fivebar").model;
  const VectorXd q = findClosedConfiguration(model).q, v = VectorXd::Zero(model.nv());
  const auto push = [&](double tolerance, int body) {
    WorldOptions options;
    options.tolerance = tolerance;
    options.pushed_body = body;
    const std::unique_ptr<World> world = makeWorld("bielle", model, options);
    world->reset(q, v);
    world->setPush(Vector3d(3, 0, 1));
    REQUIRE(world->advance(0.1));
    const Books books = world->books();
    CHECK(books.push_work != 0);
    return world->configuration();
  };
  const VectorXd fixed = push(0, 2), controlled = push(1e-9, 2);
  CHECK((fixed - controlled).cwiseAbs().maxCoeff() < 1e-5);
  CHECK((push(0, 1) - controlled).cwiseAbs().maxCoeff() > 1e-3);
}

TEST_CASE("bielle world: a stop holds a joint, and takes energy") {
  testing::checkStopped(*makeTestWorld(), getBipetto(), kBielleTolerances);
}

TEST_CASE("bielle world: springs and dampers between points move a linkage, and are booked") {
  const Model model = testing::makeSprungFivebar();
  BielleWorldOptions options;
  options.world.time_step = 1e-4;
  CHECK(testing::checkSprung(*makeBielleWorld(model, options), model, 1e-3) < 1e-4);
}

TEST_CASE("bielle world: accelerations in the air are those of the full system") {
  const Model& model = getBipetto();
  const Flight flight = makeFlight();
  Workspace ws(model);
  ConstrainedWorkspace cws;
  REQUIRE(updateConstrainedDynamics(model, ws, cws, makeConstraintSet(model), flight.q, flight.v,
                                    calcMotorForces(model, flight.u)) == NumericalStatus::Ok);
  const auto world = makeTestWorld();
  world->reset(flight.q, flight.v);
  world->setTorques(flight.u);
  constexpr double h = 1e-5;
  REQUIRE(world->advance(h));
  const VectorXd a = (world->velocity() - flight.v) / h;
  CHECK((a - cws.a).norm() < 1e-3 * cws.a.norm());
  // The torque of one motor, a thousandth different, must be noticed as often.
  VectorXd other = flight.u;
  other[3] *= 1.05;
  world->reset(flight.q, flight.v);
  world->setTorques(other);
  REQUIRE(world->advance(h));
  CHECK(((world->velocity() - flight.v) / h - cws.a).norm() > 1e-3 * cws.a.norm());
}

TEST_CASE("bielle world: steps are of second order, in the air and on the ground") {
  const Model& model = getBipetto();
  const Flight flight = makeFlight();
  const PostureHold posture(model);
  for (bool flies : {true, false}) {
    std::vector<VectorXd> ends;
    for (double h : {5e-4, 2.5e-4, 1.25e-4}) {
      const auto world = makeTestWorld(h);
      if (flies) {
        world->reset(flight.q, flight.v);
        world->setTorques(flight.u);
        REQUIRE(world->advance(0.1));
      } else {
        VectorXd q = posture.posture();
        q[2] -= 6e-5;  // all soles stay on the ground
        world->reset(q, VectorXd::Zero(model.nv()));
        world->setTorques(posture.calcTorques(*world));
        REQUIRE(world->advance(0.05));
      }
      ends.push_back(world->configuration());
    }
    const double coarse = model.difference(ends[0], ends[1]).norm(), fine = model.difference(ends[1], ends[2]).norm();
    CAPTURE(flies, coarse, fine);
    CHECK(coarse > 3 * fine);
    CHECK(coarse < 1e-3);
  }
}

TEST_CASE("bielle world: torques are cut at the limits of the motors") {
  const auto world = makeTestWorld();
  const Model& model = getBipetto();
  const PostureHold posture(model);
  world->reset(posture.posture(), VectorXd::Zero(model.nv()));
  const VectorXd u = VectorXd::Constant(model.nu(), -1e9);
  world->setTorques(u);
  for (int m = 0; m < model.nu(); ++m) {
    const double limit = model.motors()[m].effort_limit;
    CHECK(world->torques()[m] == std::max(-limit, -1e9));
  }
}

TEST_CASE("bielle world: it advances without allocation") {
  const Model& model = getBipetto();
  const PostureHold posture(model);
  const auto world = makeTestWorld();
  VectorXd q = posture.posture();
  q[2] += 0.001;
  world->reset(q, VectorXd::Zero(model.nv()));
  const VectorXd u = posture.calcTorques(*world);
  const Vector3d push(5, 0, 0);
  const long before = num_allocations;
  bool advanced = true;
  for (int i = 0; i < 50; ++i) {
    world->setTorques(u);
    world->setPush(push);
    advanced = advanced && world->advance(1e-3);
  }
  const long allocations = num_allocations - before;
  CHECK(advanced);
  CHECK(allocations == 0);
}

TEST_CASE("worlds: an interrupt ends a period of many steps, and the world can go on") {
  const Model& model = getBipetto();
  const PostureHold posture(model);
  std::atomic<bool> interrupt{true};
  for (const std::string& name : listWorlds()) {
    CAPTURE(name);
    const auto world = makeWorld(name, model, {Ground(), name == "simbody" ? 0 : 1e-12, &interrupt});
    world->reset(posture.posture(), VectorXd::Zero(model.nv()));
    CHECK_FALSE(world->advance(0.1));
    CHECK(world->message().empty());
    CHECK(world->time() > 0);
    CHECK(world->time() < 0.1);
    CHECK(world->configuration().allFinite());
  }
  const auto world = makeWorld("bielle", model, {Ground(), 1e-4, &interrupt});
  world->reset(posture.posture(), VectorXd::Zero(model.nv()));
  CHECK_FALSE(world->advance(1e-3));
  CHECK(world->time() == Approx(1e-4));
  interrupt = false;
  CHECK(world->advance(9e-4));
  CHECK(world->time() == Approx(1e-3));
}

TEST_CASE("worlds: an unknown one is refused by name") {
  CHECK_THROWS_WITH(makeWorld("moon", getBipetto()), Catch::Contains("world 'moon'") && Catch::Contains("bielle"));
}

TEST_CASE("bielle world: an angle that has grown for long changes nothing, at fixed steps and controlled ones") {
  const Model model = bielle::testing::loadOwn("fourbar").model;
  const VectorXd q = findClosedConfiguration(model).q, v = VectorXd::Zero(model.nv());
  for (double tolerance : {0.0, 1e-9}) {
    const auto move = [&](double turned) {
      WorldOptions options;
      options.tolerance = tolerance;
      const std::unique_ptr<World> world = makeWorld("bielle", model, options);
      VectorXd far = q;
      far[0] += turned;
      world->reset(far, v);
      for (int i = 0; i < 20; ++i) REQUIRE(world->advance(0.01));
      CHECK(world->integration().shortest_step > 1e-5);
      VectorXd end = world->configuration();
      end[0] -= turned;
      return end;
    };
    const VectorXd near = move(0);
    CHECK((near - q).norm() > 0.1);
    for (double turns : {2e3, 2e5, 2e7}) {
      CAPTURE(tolerance, turns);
      CHECK((move(2 * M_PI * turns) - near).norm() < 1e-6);  // 2e7 turns are rounded to 1.5e-8 rad
    }
  }
}

TEST_CASE("worlds: speeds at which nothing can go on end with a message, in every world") {
  const Model model = bielle::testing::loadOwn("fourbar").model;
  const VectorXd q = findClosedConfiguration(model).q;
  Workspace ws(model);
  const VectorXd v = projectVelocity(model, ws, makeConstraintSet(model), q, VectorXd::Ones(model.nv()));
  for (const std::string& name : listWorlds())
    for (const double tolerance : {0.0, 1e-9})
      for (const double speed : {1e12, 1e200}) {
        if (tolerance > 0 && name != "bielle") continue;
        CAPTURE(name, tolerance, speed);
        WorldOptions options;
        options.tolerance = tolerance;
        const auto world = makeWorld(name, model, options);
        world->reset(q, speed * v);
        CHECK_FALSE(world->advance(0.01));
        CHECK(world->message().size() > 10);
        CHECK(world->message().find('\n') == std::string::npos);
        CHECK(world->configuration().allFinite());
        world->books();
        world->reset(q, v);
        CHECK(world->advance(0.01));  // it can be used again
      }
}

TEST_CASE("bielle world: loops that are open where it is reset are told, as is that it was not reset") {
  const Model model = bielle::testing::loadOwn("fourbar").model;
  const VectorXd q = findClosedConfiguration(model).q, v = VectorXd::Zero(model.nv());
  for (const double tolerance : {0.0, 1e-9}) {
    CAPTURE(tolerance);
    WorldOptions options;
    options.tolerance = tolerance;
    const auto world = makeOwnWorld(model, options);
    CHECK_FALSE(world->advance(0.01));
    CHECK(world->message() == "it has not been reset");
    VectorXd open = q;
    open[0] += 1e-3;
    world->reset(open, v);
    CHECK_THAT(world->message(),
               Catch::StartsWith("its loops are open by ") && Catch::EndsWith("a closed configuration"));
    CHECK_FALSE(world->advance(0.01));
    CHECK((world->time() == 0 && world->configuration() == open));
    open[0] = q[0] + 1e-9;
    world->reset(open, v);
    CHECK(world->advance(0.01));
  }
}

TEST_CASE("bielle world: angles of joints of all kinds may have grown for long") {
  std::mt19937 generator(2);
  for (const JointKind kind : {JointKind::Revolute, JointKind::Universal, JointKind::Planar}) {
    const auto [model, q] = bielle::testing::makeRandomMechanism(generator, kind, ClosureKind::Ball3D,
                                                                 bielle::testing::MechanismBase::Fixed);
    VectorXd turned = VectorXd::Zero(model.nq());
    for (const Joint& joint : model.joints())
      if (joint.kind == kind)
        turned.segment(joint.idx_q, joint.nq).tail(kind == JointKind::Universal ? 2 : 1).setOnes();
    for (double tolerance : {0.0, 1e-9}) {
      WorldOptions options;
      options.tolerance = tolerance;
      const std::unique_ptr<World> world = makeWorld("bielle", model, options);
      const auto move = [&](const VectorXd& from) {
        world->reset(from, VectorXd::Zero(model.nv()));
        REQUIRE(world->advance(0.02));
        return std::make_pair(world->configuration(), world->integration().shortest_step);
      };
      CAPTURE(getName(kind), tolerance);
      const VectorXd turns = 2 * M_PI * 1e6 * turned, far = q + turns;
      const auto [near_end, near_step] = move(far - turns);  // rounded as the other is
      const auto [far_end, far_step] = move(far);
      CHECK((near_end - q).norm() > 1e-3);
      // Steps of controlled error get so short here that rounding parts both.
      if (tolerance == 0) CHECK((far_end - turns - near_end).norm() < 1e-6);
      CHECK(far_step > 0.1 * near_step);
    }
  }
}

}  // namespace bielle::worlds
