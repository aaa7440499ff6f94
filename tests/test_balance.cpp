// Whether a robot keeps standing: the capture point against the soles, on a robot whose motion is given, and what is carried
// out until that is decided.
#include <catch2/catch.hpp>
#include <cmath>

#include "bielle/dynamics/kinematics.h"
#include "bielle/model/builder.h"
#include "bielle/motion/motion.h"
#include "bielle/robots/robot_loader.h"
#include "own_robots.h"
#include "worlds/balance.h"
#include "worlds/carried_goals.h"
#include "worlds/execution.h"
#include "worlds/make_world.h"

namespace bielle::worlds {
namespace {

using bielle::testing::getBipetto;
using Catch::Contains;

// The robot moves as it is told, and its soles touch the ground or not.
class Puppet : public World {
 public:
  explicit Puppet(const Model& model) : World(model, {}) {
    reset(makeStandingPosture(model), VectorXd::Zero(model.nv()));
  }
  void touch(const std::vector<bool>& soles) {
    soles_ = soles;
    report();
  }
  // All of it is shifted by x at a speed, m and m/s along x, and sinks, m/s.
  void move(double x, double speed, double sinking = 0) {
    q_ = makeStandingPosture(model_);
    q_[0] += x;
    v_.setZero();
    v_[0] = speed;
    v_[2] = -sinking;
    report();
  }
  double fails_at = 1e9;  // s

 protected:
  void start() override { touch({true, true}); }
  bool step(double duration) override {
    time_ += duration;
    return time_ < fails_at || fail("closure 'knee' does not close");
  }

 private:
  void report() {
    clearFootForces();
    for (int c = 0; c < 2; ++c)
      if (soles_[c]) addFootForce(c, Vector3d::Zero(), Vector3d::UnitZ());
    reportFeet([this](int body) {
      updatePlacements(model_, ws_, q_);
      return ws_.X_WB[body];
    });
  }
  std::vector<bool> soles_{true, true};
};

// Of a world at rest: the centre of mass over the soles, ahead of their middle and up to the toes, and its time constant.
struct Stand {
  double toes = 0, tau = 0;  // m, s
};
Stand measure(const Model& model) {
  Workspace ws(model);
  updatePositions(model, ws, makeStandingPosture(model));
  const Vector3d com = calcCom(model, ws);
  const ContactFrame& foot = model.contacts()[0];
  const SE3 sole = getPlacement(ws, foot.body, foot.X_BF);
  return {sole.p.x() + foot.half_length - com.x(), std::sqrt((com.z() - sole.p.z()) / model.gravity().norm())};
}

// Holds a posture; of it nothing matters here.
struct Idle : Controller {
  void update(const Measurement&, VectorRef u) override { u.setZero(); }
};

Plan makePlan(const Model& model) {
  Policy::Stage stage;
  stage.duration = 1;
  stage.q = makeStandingPosture(model);
  stage.v = stage.q_change = stage.v_next = VectorXd::Zero(model.nv());
  stage.u = VectorXd::Zero(model.nu());
  return Plan{Policy(model, {stage}, stage.u)};
}

Model makeOnMoon() {
  ModelParts parts = takeParts(getBipetto());
  parts.gravity = Vector3d(0, 0, -1.62);
  return ModelBuilder::restore(std::move(parts));
}

}  // namespace

TEST_CASE("balance: the capture point is c + v sqrt(z/g) by the robot's own gravity, up to the edge of its soles") {
  for (const Model& model : {getBipetto(), makeOnMoon()}) {
    const Stand stand = measure(model);
    REQUIRE(stand.toes > 0.01);
    for (const double share : {0.5, 0.99, 1.01, 2.0})
      for (const double part : {0.0, 0.5, 1.0}) {  // of the way that the centre of mass is already ahead
        CAPTURE(model.gravity().z(), share, part);
        Puppet world(model);
        Balance balance(world, {});
        // The soles go along, so that only the speed counts.
        world.move(part, share * stand.toes / stand.tau);
        balance.update(0, {}, false);
        CHECK(balance.falls() == (share > 1));
        CHECK(balance.stands() == (share < 1));
      }
  }
}

TEST_CASE(
    "balance: the next foothold of a foot in the air counts, one that is not to come does not; in flight nothing is "
    "decided") {
  const Model& model = getBipetto();
  const Stand stand = measure(model);
  Puppet world(model);
  ContactSchedule planned;
  SE3 ahead;
  ahead.p.x() = 3 * stand.toes;
  planned.phases = {{"left", 10, 0.01, {{0, {}, 0, 0}}}, {"both", 10, 0.01, {{0, {}, 0, 0}, {1, ahead, 0, 0}}}};
  world.move(0, 2 * stand.toes / stand.tau);
  world.touch({true, false});
  Balance walks(world, planned), stays(world, {}), foresees(world, {});
  walks.update(0.05, {}, false);
  CHECK_FALSE(walks.falls());
  walks.update(0.11, {}, false);  // it may land a little late
  CHECK_FALSE(walks.falls());
  walks.update(0.15, {}, false);  // by the plan it stands already
  CHECK(walks.falls());
  stays.update(0.05, {}, false);
  CHECK(stays.falls());
  foresees.update(0.05, {{1, 0.1, ahead}}, false);
  CHECK_FALSE(foresees.falls());

  world.touch({false, false});
  ContactSchedule flight;
  flight.phases = {{"flight", 10, 0.01, {}}};
  Balance jumps(world, flight), loses(world, {});
  jumps.update(0.05, {}, false);
  CHECK_FALSE(jumps.stands());
  CHECK_FALSE(jumps.falls());
  loses.update(0.05, {}, false);
  CHECK(loses.falls());
}

TEST_CASE("balance: after a push or an excursion three time constants have to pass") {
  const Model& model = getBipetto();
  const Stand stand = measure(model);
  for (const bool pushed : {false, true}) {
    Puppet world(model);
    Balance balance(world, {});
    balance.update(0, {}, false);
    CHECK(balance.stands());
    world.move(0, pushed ? 0 : 2 * stand.toes / stand.tau);
    balance.update(0, {}, pushed);
    world.move(0, 0);
    for (const double share : {0.5, 0.98, 1.02}) {
      world.advance(3 * share * stand.tau - world.time());
      balance.update(0, {}, false);
      CAPTURE(pushed, share);
      CHECK(balance.stands() == (share > 1));
    }
  }
}

TEST_CASE("balance: a robot whose legs give way does not stand, though its capture point stays over its soles") {
  for (const Model& model : {getBipetto(), makeOnMoon()}) {
    const double tau = measure(model).tau, height = tau * tau * model.gravity().norm();
    for (const double share : {-1.0, 0.29, 0.31, 1.0}) {
      CAPTURE(model.gravity().z(), share);
      Puppet world(model);
      Balance balance(world, {});
      world.move(0, 0, share * height / tau);
      balance.update(0, {}, false);
      CHECK(balance.stands() == (share < 0.3));
      world.move(0, 0);
      world.advance(2.9 * tau);
      balance.update(0, {}, false);
      CHECK(balance.stands() == (share < 0.3));
      world.advance(0.2 * tau);
      balance.update(0, {}, false);
      CHECK(balance.stands());
    }
  }
}

TEST_CASE("carried out: a robot that is pushed on and on is looked at for 5 s more, and then not decided") {
  const Model& model = getBipetto();
  Puppet world(model);
  Idle idle;
  ExecutionOptions options;
  options.duration = 0.1;
  options.control_period = options.record_period = 0.01;
  Execution e = carryOut(makePlan(model), idle, world, {}, options);
  CHECK(e.outcome == Outcome::Stood);
  CHECK(e.extension == 0);
  CHECK(e.duration == Approx(0.1));
  options.pushes = {{0.05, 10, 0, 100}};
  e = carryOut(makePlan(model), idle, world, {}, options);
  CHECK(e.outcome == Outcome::Undecided);
  CHECK(std::string(getName(e.outcome)) == "not decided");
  CHECK(e.extension == Approx(5));
  CHECK(e.duration == Approx(5.1));
  CHECK(e.record.time[e.record.time.size() - 1] == Approx(5.1));
  options.pushes = {{0.05, 10, 0, 0.04}};
  e = carryOut(makePlan(model), idle, world, {}, options);
  CHECK(e.outcome == Outcome::Stood);
  CHECK(e.duration == Approx(0.08 + 3 * measure(model).tau).margin(0.021));
}

TEST_CASE(
    "carried out: a loop that does not close is a fall where the robot falls, which is said first, else a failure") {
  const Model& model = getBipetto();
  struct Tipping : Puppet {
    using Puppet::Puppet;
    double speed = 0;
    bool step(double duration) override {
      move(0, speed);
      return Puppet::step(duration);
    }
  } world(model);
  world.fails_at = 0.045;
  Idle idle;
  ExecutionOptions options;
  options.duration = 0.1;
  options.control_period = options.record_period = 0.01;
  Execution e = carryOut(makePlan(model), idle, world, {}, options);
  CHECK(e.outcome == Outcome::BrokeOff);
  CHECK_THAT(e.message, Catch::StartsWith("closure 'knee' does not close"));
  world.speed = 1;
  e = carryOut(makePlan(model), idle, world, {}, options);
  CHECK(e.outcome == Outcome::Fell);
  CHECK_THAT(e.message, Catch::StartsWith("its capture point is ") && Contains(" m beyond its soles") &&
                            Contains("closure 'knee' does not close"));
}

TEST_CASE(
    "what happened is told where it differs from the plan by more than a twentieth, or from 0 by more than the "
    "tolerance") {
  const auto list = [](GoalKind kind, double requested, double planned, double carried) {
    Goal goal;
    goal.kind = kind;
    goal.name = "it";
    goal.requested = requested;
    goal.tolerance = 0.01;
    return listDifferences({{goal, planned}}, {{goal, carried}});
  };
  CHECK(list(GoalKind::Speed, 0.4, 0.39, 0.375).empty());
  CHECK(list(GoalKind::Speed, 0.4, 0.39, 0.365) ==
        std::vector<std::string>{"it: 0.365 m/s where 0.39 m/s was planned"});
  CHECK(list(GoalKind::Speed, -0.4, -0.39, -0.365).size() == 1);
  // A jump on the spot ends where it began, but for rounding in the plan and less than a millimetre in a world.
  CHECK(list(GoalKind::Displacement, 0, -4e-11, 4e-5).empty());
  CHECK(list(GoalKind::Displacement, 0, -4e-11, 0.02).size() == 1);
  CHECK(list(GoalKind::Footholds, 0, 1e-13, 9e-3).empty());
  CHECK(list(GoalKind::Footholds, 0, 1e-13, 0.02).size() == 1);
  CHECK(list(GoalKind::Speed, 0.4, 0.39, NAN).empty());
}

}  // namespace bielle::worlds
