// Predictive control whose solves take time: in a thread of their own, ahead of their stages by a lead, several a stage, and late.
#include <catch2/catch.hpp>
#include <chrono>
#include <limits>
#include <thread>

#include "bielle/control/predictive_controller.h"
#include "count_allocations.h"
#include "own_robots.h"
#include "predictive_trials.h"

namespace bielle {
namespace {

using testing::getBipetto;
using testing::getShortSquat;
using testing::kLeadTicks;
using testing::kStage;
using testing::kStageTicks;
using testing::makeController;
using testing::makeShortSquat;
using testing::makeShortWindow;

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
    CHECK_THROWS_WITH(makeController(options), Catch::Contains("'lead': it is n"));
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

}  // namespace bielle
