// Predictive control in Bielle's world: the same bytes for every number of threads; on the plan, when solves fail, and when they
// come late. Feet that do not do as planned: test_predictive_feet.cpp.
#include <catch2/catch.hpp>
#include <chrono>
#include <limits>
#include <thread>

#include "bielle/control/predictive_controller.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/model/error.h"
#include "bielle/motion/squat.h"
#include "bielle/worlds/bielle_world.h"
#include "count_allocations.h"
#include "own_robots.h"
#include "predictive_trials.h"
#include "worlds/execution.h"
#include "worlds/make_world.h"

namespace bielle::worlds {
namespace {

using bielle::testing::getBipetto;
using bielle::testing::kLeadTicks;
using bielle::testing::kStageTicks;

// A squat, its solution, and the policy of its gains.
struct Solved {
  Solution solution;
  std::unique_ptr<Policy> gains;
};
template <typename Options>
Solved solve(MotionPlan (*plan)(const Model&, const Options&, const StandingRobot&), const Options& options) {
  const Model& model = getBipetto();
  SolveOptions how;
  how.solver = FddpOptions();
  Solved out{solve(makeMotion(model, plan(model, options, makeStandingRobot(model)), ProblemOptions()), how), nullptr};
  REQUIRE(out.solution.converged());
  out.gains = std::make_unique<Policy>(makePolicy(out.solution));
  return out;
}

template <typename Options>
std::unique_ptr<PredictiveController> makeController(MotionPlan (*plan)(const Model&, const Options&,
                                                                        const StandingRobot&),
                                                     const Options& options, const Solved& solved,
                                                     const PredictiveOptions& predictive) {
  const Model& model = getBipetto();
  return std::make_unique<PredictiveController>(
      makePredictiveMotion(model, plan(model, options, makeStandingRobot(model)), ProblemOptions(), predictive),
      solved.solution.trajectory, predictive);
}

constexpr double kStage = 0.015;  // s

SquatOptions makeShortSquat() {
  SquatOptions options;
  options.depth = 0.93;
  options.duration = 0.5;
  options.time_step = kStage;
  return options;
}

PredictiveOptions makeShortWindow(int threads) {
  PredictiveOptions options;
  options.nodes = 30;
  options.threads = threads;
  return options;
}

// Waits for the solve that begins at an instant of control, if any: how fast the machine is under what load is not known.
class Patient : public Controller {
 public:
  explicit Patient(PredictiveController& inner) : inner_(inner) {}
  void update(const Measurement& measurement, VectorRef u) override {
    inner_.update(measurement, u);
    inner_.waitForSolve();
  }

 private:
  PredictiveController& inner_;
};

Execution carryOut(const Solved& solved, Controller& controller, const ExecutionOptions& options,
                   const PerceptionOptions& sensors = {}, const ContactSchedule& planned = {}) {
  const auto world = makeWorld("bielle", getBipetto());
  return carryOut(Plan{*solved.gains, planned}, controller, *world, sensors, options);
}

const Solved& getShortSquat() {
  static const Solved squat = solve(planSquat, makeShortSquat());
  return squat;
}

}  // namespace

TEST_CASE("predictive control: a squat stands to its end and beyond, to the same bytes for every number of threads") {
  ExecutionOptions options;
  options.duration = 60 * kStage;
  const auto one = makeController(planSquat, makeShortSquat(), getShortSquat(), makeShortWindow(1)),
             two = makeController(planSquat, makeShortSquat(), getShortSquat(), makeShortWindow(2));
  const Execution a = carryOut(getShortSquat(), *one, options), b = carryOut(getShortSquat(), *two, options);
  CHECK(a.outcome == Outcome::Stood);
  CHECK(a.largest_deviation < 5e-3);
  CHECK(one->counts().failed == 0);
  CHECK(one->counts().solves == 60);  // one for every stage
  CHECK(a.record.q == b.record.q);
  CHECK(a.record.u == b.record.u);
}

namespace {

// All numbers of a stage that a window changes or might change.
std::vector<VectorXd> listNumbers(const StageSpec& spec) {
  std::vector<VectorXd> out{Vector3d(spec.dt, spec.state.weight, spec.control.weight), spec.state.q_ref,
                            spec.state.v_ref, spec.state.weights, spec.control.reference};
  for (const Cost& cost : spec.costs)
    out.insert(out.end(), {VectorXd::Constant(1, cost.weight), cost.activation.weights});
  for (const PathConstraint& c : spec.path_constraints) out.insert(out.end(), {c.lower, c.upper, c.scale});
  for (const Closure& closure : spec.constraints.closures) out.push_back(Eigen::Vector2d(closure.kp, closure.kd));
  return out;
}

}  // namespace

TEST_CASE("predictive control: the motion that it is given stays as it is") {
  const Model& model = getBipetto();
  PredictiveOptions options = makeShortWindow(1);
  options.fine_nodes = 10;
  options.own_thread = GENERATE(false, true);
  const Motion motion = makePredictiveMotion(model, planSquat(model, makeShortSquat(), makeStandingRobot(model)),
                                             ProblemOptions(), options);
  std::vector<StageSpec> before;
  for (int k = 0; k <= motion.problem->numStages(); ++k) before.push_back(motion.problem->spec(k));
  PredictiveController controller(motion, getShortSquat().solution.trajectory, options);
  ExecutionOptions execution;
  execution.duration = 20 * kStage;
  Patient patient(controller);
  carryOut(getShortSquat(), patient, execution);
  CHECK(controller.counts().solves >= 19);  // in a thread of its own the last one is not received
  for (int k = 0; k <= motion.problem->numStages(); ++k) {
    CAPTURE(k);
    const StageSpec& after = motion.problem->spec(k);
    CHECK(listNumbers(after) == listNumbers(before[k]));
    for (size_t i = 0; i < after.costs.size(); ++i) CHECK(after.costs[i].residual == before[k].costs[i].residual);
  }
}

TEST_CASE("predictive control: on the plan its torques are those of the plan") {
  const Model& model = getBipetto();
  const Solved& squat = getShortSquat();
  const auto controller = makeController(planSquat, makeShortSquat(), squat, makeShortWindow(0));
  Measurement at{0, model.makeNeutral(), VectorXd::Zero(model.nv())};
  VectorXd u(model.nu()), planned(model.nu());
  for (int tick = 0; tick < 300; ++tick) {
    at.time = 1e-3 * tick;
    squat.gains->getReference(at.time, at.q, at.v);
    controller->update(at, u);
    squat.gains->update(at, planned);
    CHECK((u - planned).norm() < 0.05 * planned.norm());
  }
  at.q[0] += 0.01;  // off it they are others
  controller->update(at, u);
  CHECK((u - planned).norm() > 0.05 * planned.norm());
}

TEST_CASE("predictive control: states that cannot be solved from leave the last policy in force, and are counted") {
  const Model& model = getBipetto();
  const Solved& squat = getShortSquat();
  const auto controller = makeController(planSquat, makeShortSquat(), squat, makeShortWindow(0));
  Measurement at{0, model.makeNeutral(), VectorXd::Zero(model.nv())};
  squat.gains->getReference(0, at.q, at.v);
  VectorXd u(model.nu());
  controller->update(at, u);
  const Measurement good = at;
  at.time = kStage;
  at.v.setConstant(std::numeric_limits<double>::quiet_NaN());
  controller->update(at, u);
  CHECK(controller->counts().failed == 1);
  at.v = good.v;
  at.time = kStage + 1e-3;
  controller->update(at, u);
  CHECK(u.allFinite());
  at.time = 2 * kStage;
  controller->update(at, u);
  CHECK(u.allFinite());
  CHECK(controller->counts().failed == 1);
  CHECK(controller->counts().solves == 3);
}

TEST_CASE("predictive control: a walk by command is made on the way, to the same bytes for every number of threads") {
  const Model& model = getBipetto();
  const std::vector<TimedCommand> commands{{0, {0.4, 0, 0}}, {0.8, {}}};
  LocomotionOptions gait;
  gait.contact_kp = 0;
  gait.foothold_room = 0.4;
  gait.cone_margin = 0.2;
  const auto makeWalk = [&] {
    return CommandedWalk(
        model, gait, {}, [&](double time) { return findCommand(commands, time); }, makeStandingRobot(model));
  };
  ExecutionOptions options;
  options.duration = 1.5;
  PredictiveOptions predictive = makeShortWindow(1);
  predictive.nodes = 60;
  PredictiveController one(makeWalk(), predictive);
  predictive.threads = 2;
  PredictiveController two(makeWalk(), predictive);
  const Execution a = carryOut(getShortSquat(), one, options), b = carryOut(getShortSquat(), two, options);
  CHECK(a.outcome == Outcome::Stood);
  CHECK(a.distance > 0.1);
  CHECK(one.counts().failed == 0);
  CHECK(one.counts().solves == 125);
  CHECK(a.record.q == b.record.q);
  CHECK(a.record.u == b.record.u);
}

namespace {

// Hides the state of a walk from a controller at the instant of one solve in each swing, which therefore fails.
class Blinking : public Controller {
 public:
  explicit Blinking(PredictiveController& inner) : inner_(inner) {}
  void update(const Measurement& measurement, VectorRef u) override {
    const bool solves = static_cast<int>(std::lround(1e3 * measurement.time)) % kStageTicks == 0;
    const auto feet = std::count(measurement.contacts.begin(), measurement.contacts.end(), char(1));
    if (solves) swing_ = feet == 1 ? swing_ + 1 : 0;
    Measurement seen = measurement;
    const bool blinks_now = solves && swing_ == kMiddle;
    if (blinks_now) seen.v.setConstant(std::numeric_limits<double>::quiet_NaN());
    inner_.update(seen, u);
    if (blinks_now) u = last_;
    last_ = u;
    blinks += blinks_now;
  }
  int blinks = 0;

 private:
  static constexpr int kMiddle = 18;  // stages since the foot was in the air
  PredictiveController& inner_;
  int swing_ = 0;
  VectorXd last_;
};

}  // namespace

TEST_CASE("predictive control: after a solve that fails in the middle of a swing the next one succeeds") {
  const Model& model = getBipetto();
  LocomotionOptions gait;
  gait.contact_kp = 0;
  gait.foothold_room = 0.4;
  gait.cone_margin = 0.2;
  const CommandSource source = [](double time) { return VelocityCommand{time < 2 ? 0.4 : 0, 0, 0}; };
  PredictiveOptions predictive;
  predictive.threads = 1;
  PredictiveController controller(CommandedWalk(model, gait, {}, source, makeStandingRobot(model)), predictive);
  Blinking blinking(controller);
  ExecutionOptions options;
  options.duration = 3;
  const Execution execution = carryOut(getShortSquat(), blinking, options);
  CHECK(execution.outcome == Outcome::Stood);
  CHECK(blinking.blinks >= 3);
  CHECK(controller.counts().failed == blinking.blinks);
}

namespace {

// Keeps whoever comes through while it is closed, but not for ever.
class Gate {
 public:
  void close() { closed_ = true; }
  void open() { closed_ = false; }
  void pass() {
    ++passes_;
    for (int i = 0; closed_; ++i, std::this_thread::sleep_for(std::chrono::milliseconds(1))) {
      holds_ = true;
      if (i > 60000) return;
    }
    holds_ = false;
  }
  bool holds() const { return holds_; }
  int passes() const { return passes_; }

 private:
  std::atomic<bool> closed_{false}, holds_{false};
  std::atomic<int> passes_{0};
};

// A robot that stands until it is commanded otherwise, by a command that comes through a gate.
struct Standing {
  explicit Standing(bool own_thread, int solve_ticks = 0, int lead_ticks = kStageTicks)
      : q(makeStandingPosture(getBipetto())) {
    PredictiveOptions options = makeShortWindow(1);
    options.own_thread = own_thread;
    options.solve_time = 1e-3 * solve_ticks;
    options.lead = 1e-3 * lead_ticks;
    const CommandSource source = [this](double) {
      gate.pass();
      return VelocityCommand{};
    };
    controller = std::make_unique<PredictiveController>(
        CommandedWalk(getBipetto(), {}, {}, source, makeStandingRobot(getBipetto())), options);
    u.setZero(getBipetto().nu());
    at = {0, q, VectorXd::Zero(getBipetto().nv())};
    at.q[0] += 0.002;  // not on the plan
  }
  ~Standing() { gate.open(); }
  void update(int tick) {
    at.time = 1e-3 * tick;
    controller->update(at, u);
  }

  const VectorXd q;
  Gate gate;
  Measurement at;
  VectorXd u;
  std::unique_ptr<PredictiveController> controller;
};

}  // namespace

TEST_CASE("predictive control: solved in a thread of its own and waited for, policies are the same to the last bit") {
  Standing own(true), other(false);
  for (int tick = 0; tick < 20 * kStageTicks; ++tick) {
    own.update(tick);
    own.controller->waitForSolve();
    other.update(tick);
    REQUIRE(own.u == other.u);
  }
  CHECK(own.controller->counts().solves == 20);
  CHECK(own.controller->counts().missed == 0);
  CHECK(own.controller->counts().failed == 0);
}

TEST_CASE(
    "predictive control: while a solve is held the last policy acts, without waiting; missed stages are counted") {
  // The first stage after some whose solve, or the preparation of the next one after it, asks for a command.
  int asking = 5;
  {
    Standing trial(true);
    for (int tick = 0, passes = 0;; ++tick) {
      passes = trial.gate.passes();
      trial.update(tick);
      trial.controller->waitForSolve();
      asking = tick / kStageTicks;
      REQUIRE(asking < 50);
      if (asking >= 5 && trial.gate.passes() > passes) break;
    }
  }
  Standing standing(true);
  PredictiveController& controller = *standing.controller;
  int tick = 0;
  for (; tick < asking * kStageTicks; ++tick) {
    standing.update(tick);
    controller.waitForSolve();
  }
  standing.gate.close();
  const auto wait = [] { std::this_thread::sleep_for(std::chrono::milliseconds(1)); };
  for (int stages = 0; stages < 20 && !standing.gate.holds(); ++stages) {
    for (; tick <= (asking + stages) * kStageTicks; ++tick) standing.update(tick);
    const int solves = controller.counts().solves;
    for (int i = 0; i < 20000 && controller.counts().solves == solves && !standing.gate.holds(); ++i, wait())
      standing.update(tick - 1);
    for (int i = 0; i < 100 && !standing.gate.holds(); ++i) wait();  // while the next one is prepared
  }
  REQUIRE(standing.gate.holds());
  standing.update(tick++);  // takes a solution if that is ready, and the next one is held
  const int held = controller.counts().solves;
  for (; tick <= held * kStageTicks; ++tick) standing.update(tick);
  Policy last = controller.policy();
  VectorXd expected(standing.u.size());
  const long allocations = num_allocations_here;
  bool same = true;
  for (int late = 0; late < 3; ++late)
    for (int i = 0; i < kStageTicks; ++i, ++tick) {
      standing.update(tick);
      last.update(standing.at, expected);
      same = same && standing.u == expected;
    }
  CHECK(num_allocations_here == allocations);
  CHECK(same);
  CHECK(standing.gate.holds());  // all that time
  CHECK(controller.counts().solves == held);
  CHECK(controller.counts().missed == 2);  // the third one may still have a solve
  CHECK(controller.policy().stages().front().start == last.stages().front().start);

  standing.gate.open();
  controller.waitForSolve();
  standing.update(tick);  // it comes into force late, but does
  const double stage = 1e-3 * kStageTicks;
  CHECK(controller.policy().stages().front().start == Approx((held + 1) * stage));
  last.update(standing.at, expected);
  CHECK(standing.u != expected);
  const long before = num_allocations_here;
  for (; tick < (held + 8) * kStageTicks; ++tick) {
    standing.update(tick);
    controller.waitForSolve();
  }
  CHECK(num_allocations_here == before);  // to take solutions and ask for the next, none either
  CHECK(controller.counts().missed == 2);
  CHECK(controller.counts().solves == held + 6);  // the late one, and one for each stage from then on
  CHECK(controller.counts().stages == held + 8);
  const std::vector<PredictiveSolve>& solves = controller.counts().last;
  for (const PredictiveSolve& solve : solves)
    CHECK((solve.latency > 0) == (&solve != &solves.back()));  // not yet in force
  CHECK(controller.counts().failed == 0);
}

TEST_CASE(
    "predictive control: solves that are given a whole stage yield the same policies as those that are ready at once") {
  Standing given(false, kStageTicks), at_once(false);
  for (int tick = 0; tick < 20 * kStageTicks; ++tick) {
    given.update(tick);
    at_once.update(tick);
    REQUIRE(given.u == at_once.u);
  }
  CHECK(given.controller->counts().solves == 19);  // the last one is under way
  CHECK(given.controller->counts().missed == 0);
}

TEST_CASE("predictive control: a stage that leaves time has several solves, and the next one the policy of the last") {
  constexpr int kTicks = 5, kStages = 20;  // two solves a stage, and 2 ms are left
  static_assert(kStageTicks == 12, "a third solve would begin");
  for (const bool own_thread : {false, true}) {
    Standing standing(own_thread, kTicks), once(false);
    const auto update = [&](int tick) {
      for (Standing* one : {&standing, &once}) one->update(tick);
      // The thread's solve is ready as late as that which is said to take so long.
      if (tick % kStageTicks == kTicks - 1 || tick % kStageTicks == 2 * kTicks - 1) standing.controller->waitForSolve();
    };
    int tick = 0;
    for (; tick < kStages * kStageTicks; ++tick) update(tick);
    const PredictiveCounts& counts = standing.controller->counts();
    CAPTURE(own_thread);
    CHECK(counts.missed == 0);
    CHECK(counts.failed == 0);
    if (own_thread) continue;  // when it has ended depends on the machine
    CHECK(counts.solves == 2 * kStages);
    for (int i = 0; i < counts.solves; ++i) {
      CAPTURE(i);
      const double latency = i % 2 ? 1e-3 * (kStageTicks - kTicks) : -1;  // the first of each stage is replaced
      CHECK(counts.last[i].latency == Approx(i == counts.solves - 1 ? -1 : latency));
    }
    // What happens between the two solves of a stage is known to the policy that follows.
    for (; tick < kStages * kStageTicks + 2; ++tick) update(tick);
    for (Standing* one : {&standing, &once}) one->at.v[0] += 0.1;
    for (; tick <= (kStages + 1) * kStageTicks; ++tick) update(tick);
    const Policy::Stage &reacts = standing.controller->policy().stages().front(),
                        &knows_not = once.controller->policy().stages().front();
    CHECK(reacts.start == Approx(knows_not.start));
    CHECK(reacts.v[0] - knows_not.v[0] > 0.02);
  }
}

TEST_CASE("predictive control: solves that are given more than a stage come late, and stages without one are counted") {
  constexpr int kTicks = 30;
  Standing standing(false, kTicks);
  for (int tick = 0; tick < 20 * kStageTicks; ++tick) standing.update(tick);
  const PredictiveCounts& counts = standing.controller->counts();
  CHECK(counts.solves == 7);   // one begins at each 30th tick; the last is under way
  CHECK(counts.missed == 11);  // of 19 stages that are over
  CHECK(counts.failed == 0);
  for (const PredictiveSolve& solve : counts.last) CHECK(solve.latency == Approx(1e-3 * kTicks));
  CHECK_THROWS_WITH(Standing(false, -1), Catch::Contains("solve_time"));
}

TEST_CASE("predictive control: a solve begins its lead before its stage, and knows what has happened until then") {
  constexpr int kStages = 5;
  constexpr int lead = kLeadTicks;
  const int period = GENERATE(1, 5, 12);
  // The last instant of each stage at which the lead is left.
  const auto findInstant = [&](int stage) {
    int tick = 0;
    while (tick + period + lead <= (stage + 1) * kStageTicks) tick += period;
    return stage == 0 ? 0 : tick;  // at the first instant, the next one is not known
  };
  const bool known = GENERATE(false, true);
  CAPTURE(period, known);
  Standing pushed(false, 0, lead), other(false, 0, lead);
  const int last = findInstant(kStages - 1);
  for (int tick = 0; tick <= kStages * kStageTicks; tick += period) {
    if (tick == last + (known ? 0 : period)) pushed.at.v[0] += 0.1;
    for (Standing* one : {&pushed, &other}) one->update(tick);
  }
  const std::vector<PredictiveSolve>& solves = other.controller->counts().last;
  REQUIRE(solves.size() >= kStages);
  for (int stage = 0; stage < kStages; ++stage) CHECK(solves[stage].time == Approx(1e-3 * findInstant(stage)));
  const Policy::Stage &a = pushed.controller->policy().stages().front(),
                      &b = other.controller->policy().stages().front();
  CHECK(a.start == Approx(1e-3 * kStages * kStageTicks));
  if (known)
    CHECK(a.v[0] - b.v[0] > 0.02);
  else
    CHECK(a.v == b.v);
}

TEST_CASE("predictive control: a solve that ends before the next one begins is prepared for as if it were in time") {
  Standing own(true, 0, kLeadTicks), other(false, 0, kLeadTicks);
  for (int tick = 0; tick < 10 * kStageTicks; ++tick) {
    own.update(tick);
    own.controller->waitForSolve();
    other.update(tick);
    REQUIRE(own.u == other.u);
  }
  const PredictiveCounts& counts = own.controller->counts();
  CHECK(counts.solves == 10);
  CHECK(counts.missed == 0);
  for (size_t i = 1; i + 1 < counts.last.size(); ++i) CHECK(counts.last[i].latency == Approx(1e-3 * kLeadTicks));
  for (double lead : {-1e-3, std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()}) {
    PredictiveOptions options;
    options.lead = lead;
    CHECK_THROWS_WITH(makeController(planSquat, makeShortSquat(), getShortSquat(), options),
                      Catch::Contains("lead must be finite and not negative"));
  }
}

namespace {

// A cost without weight that asks at a gate for every evaluation of its node.
struct Gated : Residual {
  explicit Gated(Gate& asked) : gate(asked) {}
  int size() const override { return 1; }
  void calc(const NodeView&, VectorRef r) const override {
    gate.pass();
    r.setZero();
  }
  void calcJacobian(const NodeView&, ResidualRows) const override {}
  Gate& gate;
};

}  // namespace

TEST_CASE(
    "predictive control: a policy acts as soon as its sweep has ended, and that of the rolled out step replaces it") {
  const Model& model = getBipetto();
  const int ticks = static_cast<int>(std::lround(1e3 * kStage));
  Gate gate;
  MotionPlan plan = planSquat(model, makeShortSquat(), makeStandingRobot(model));
  plan.stages[20].costs.push_back(
      {"gate", 1, Activation::makeQuadratic(VectorXd::Ones(1)), std::make_shared<Gated>(gate)});
  const auto make = [&](bool own_thread) {
    PredictiveOptions options = makeShortWindow(1);
    options.own_thread = own_thread;
    options.lead = 1e-3 * kLeadTicks;
    return std::make_unique<PredictiveController>(makePredictiveMotion(model, plan, ProblemOptions(), options),
                                                  getShortSquat().solution.trajectory, options);
  };
  const auto own = make(true), other = make(false);
  Measurement at{0, model.makeNeutral(), VectorXd::Zero(model.nv())};
  VectorXd u(model.nu());
  const auto update = [&](PredictiveController& controller, int tick) {
    at.time = 1e-3 * tick;
    getShortSquat().gains->getReference(at.time, at.q, at.v);
    at.v[0] += 0.02;  // off the plan
    controller.update(at, u);
  };
  const PredictiveCounts& counts = own->counts();
  const auto open = [](Gate* closed) { closed->open(); };
  const std::unique_ptr<Gate, decltype(open)> opened(&gate, open);  // before the thread is waited for
  // A solve that is prepared is held in its rollout. After one that came late, as on a busy machine, none is.
  int tick = 0;
  bool drafted_in_time = false;
  for (int stage = 4; stage < 16 && !drafted_in_time; stage += 2) {
    gate.open();
    for (; tick < stage * ticks - kLeadTicks; ++tick) {
      own->waitForSolve();
      update(*own, tick);
    }
    own->waitForSolve();
    gate.close();
    for (; tick < stage * ticks; ++tick) update(*own, tick);
    for (int i = 0; i < 20000 && !gate.holds(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    REQUIRE(gate.holds());
    const long allocations = num_allocations_here;
    update(*own, tick);
    CHECK(num_allocations_here == allocations);
    CHECK(counts.solves == stage - 1);
    drafted_in_time = own->policy().stages().front().start == Approx(1e-3 * tick);
  }
  REQUIRE(drafted_in_time);
  const Policy draft = own->policy();
  CHECK(counts.last.back().latency == Approx(1e-3 * kLeadTicks));

  gate.open();
  own->waitForSolve();
  update(*own, ++tick);
  CHECK(counts.failed == 0);
  CHECK(counts.last.back().latency == Approx(1e-3 * kLeadTicks));
  CHECK(counts.last.back().step == 1);
  for (int t = 0; t <= tick; ++t) update(*other, t);
  const std::vector<Policy::Stage>&drafted = draft.stages(), &solved = own->policy().stages(),
        &waited = other->policy().stages();
  REQUIRE(drafted.size() == solved.size());
  CHECK(drafted[0].q == solved[0].q);
  CHECK(drafted[0].u == solved[0].u);  // nothing has been rolled out before
  for (size_t k = 0; k < waited.size(); ++k) {
    CHECK(solved[k].q == waited[k].q);
    CHECK(solved[k].u == waited[k].u);
    CHECK(solved[k].K == waited[k].K);
  }
  for (size_t k = 0; k < solved.size(); ++k) {
    CAPTURE(k);
    CHECK(drafted[k].start == solved[k].start);
    CHECK(drafted[k].K == solved[k].K);
    CHECK((drafted[k].u - solved[k].u).norm() < 1e-2 * solved[k].u.norm());
    CHECK((drafted[k].v - solved[k].v).norm() < 1e-2);
  }
  CHECK(drafted[2].u != solved[2].u);
}

namespace {

// Gains of a squat; a controller that is not beyond an instant of its plan.
class HeldBack : public Controller {
 public:
  explicit HeldBack(double longest) : policy_(*getShortSquat().gains), longest_(longest) {}
  void update(const Measurement& measurement, VectorRef u) override { policy_.update(measurement, u); }
  double getPlanTime(double time) const override { return std::min(time, longest_); }

 private:
  Policy policy_;
  const double longest_;
};

}  // namespace

TEST_CASE("estimator: contacts are expected where the controller is in its plan, whatever the time") {
  ExecutionOptions options;
  options.duration = 0.4;
  PerceptionOptions sensors;
  sensors.sensors = SensorOptions{};
  sensors.estimator.surprising_contact = 2;  // of the weight: only expected feet stand
  ContactSchedule planned;
  planned.phases = {{"double support", 10, 0.01, {{0, {}, 0, 0}, {1, {}, 0, 0}}}, {"flight", 30, 0.01, {}}};
  HeldBack held(0.05), on_time(1);
  CHECK(carryOut(getShortSquat(), held, options, sensors, planned).estimation.contact_errors < 0.05);
  CHECK(carryOut(getShortSquat(), on_time, options, sensors, planned).estimation.contact_errors > 0.5);
}

TEST_CASE("carried out: a world that cannot follow a torque names the motor") {
  struct Bursting : Controller {
    void update(const Measurement&, VectorRef u) override {
      u.setZero();
      u[2] = -1e8;
    }
  } bursting;
  const Execution execution = carryOut(getShortSquat(), bursting, {});
  CHECK(execution.outcome == Outcome::BrokeOff);
  CHECK_THAT(execution.message, Catch::Contains("; motor '" + getBipetto().motors()[2].name + "' was at 1e+08 N m"));
}

TEST_CASE("predictive control: it refuses a plan that is not one of its motion") {
  const Model& model = getBipetto();
  const PredictiveOptions options = makeShortWindow(1);
  ShootingTrajectory shorter = getShortSquat().solution.trajectory;
  shorter.xs.pop_back();
  shorter.us.pop_back();
  CHECK_THROWS_AS(
      PredictiveController(makePredictiveMotion(model, planSquat(model, makeShortSquat(), makeStandingRobot(model)),
                                                ProblemOptions(), options),
                           shorter, options),
      std::invalid_argument);
}

TEST_CASE("predictive control: windows, threads and iterations without sense are refused by name") {
  const Model& model = getBipetto();
  const MotionPlan plan = planSquat(model, makeShortSquat(), makeStandingRobot(model));
  const auto make = [&](const PredictiveOptions& options) {
    PredictiveController(makePredictiveMotion(model, plan, ProblemOptions(), options),
                         getShortSquat().solution.trajectory, options);
  };
  for (int nodes : {-1, 0, 9, 1001, 2000000000}) {
    PredictiveOptions options = makeShortWindow(1);
    options.nodes = nodes;
    CHECK_THROWS_WITH(make(options), Catch::Contains("nodes must lie between 10 and 1000"));
  }
  PredictiveOptions coarse = makeShortWindow(1);
  coarse.fine_nodes = 9;
  CHECK_THROWS_WITH(make(coarse), Catch::Contains("at least 10 fine_nodes"));
  for (int threads : {-1, 20000}) CHECK_THROWS_WITH(make(makeShortWindow(threads)), Catch::Contains("threads"));
  PredictiveOptions options = makeShortWindow(1);
  options.iterations = 0;
  CHECK_THROWS_WITH(make(options), Catch::Contains("iterations"));
  for (double time : {-1e-3, std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()}) {
    PredictiveOptions timed = makeShortWindow(1);
    timed.solve_time = time;
    CHECK_THROWS_WITH(make(timed), Catch::Contains("solve_time must be finite and not negative"));
  }
  CHECK_THROWS_AS(makePredictiveMotion(model, MotionPlan(), ProblemOptions(), makeShortWindow(1)), InputError);
}

}  // namespace bielle::worlds
