// Predictive control of a walk by command, told of feet that land early or late.
#include <catch2/catch.hpp>

#include "bielle/control/predictive_controller.h"
#include "bielle/dynamics/kinematics.h"
#include "own_robots.h"
#include "predictive_trials.h"

namespace bielle {
namespace {

using bielle::testing::getBipetto;
using bielle::testing::kStageTicks;

// Lets a walk by command follow its own policy, while the contacts that it is told are scripted.
struct Walking {
  explicit Walking(double look_ahead = 0, double foothold_room = 0.4) {
    LocomotionOptions gait;
    gait.contact_kp = 0;
    gait.foothold_room = foothold_room;
    gait.cone_margin = 0.2;
    const CommandSource source = [](double) { return VelocityCommand{0.4, 0, 0}; };
    PredictiveOptions options;
    options.threads = 1;
    options.look_ahead = look_ahead;
    const VectorXd q = makeStandingPosture(model);
    CommandedWalk walk(model, gait, {}, source, makeStandingRobot(model));
    CommandedWalk plan = walk;
    for (int k = 0; k < 200; ++k) planned.push_back(plan.makeNext().spec.constraints.contacts);
    controller = std::make_unique<PredictiveController>(std::move(walk), options);
    at = {0, q, VectorXd::Zero(model.nv())};
    u.setZero(model.nu());
  }
  bool stands(int stage, int foot) const {
    return std::find(planned[stage].begin(), planned[stage].end(), foot) != planned[stage].end();
  }
  // The first stage in which a foot stands again, or a swing of the foot begins.
  int findChange(int foot, bool lands) const {
    int stage = 1;
    while (stands(stage - 1, foot) == lands || stands(stage, foot) != lands) ++stage;
    return stage;
  }
  // One stage, with the contacts that are given.
  void update(const std::vector<char>& contacts) {
    at.contacts = contacts;
    for (int i = 0; i < kStageTicks; ++i, ++tick) {
      at.time = 1e-3 * tick;
      controller->policy().getReference(at.time, at.q, at.v);
      controller->update(at, u);
    }
  }
  void updateAsPlanned(int stage) { update({char(stands(stage, 0)), char(stands(stage, 1))}); }
  double getHeight(int foot) {
    updatePlacements(model, ws, at.q);
    const ContactFrame& contact = model.contacts()[foot];
    return getPlacement(ws, contact.body, contact.X_BF).p.z();
  }
  // How far the motion is behind its plan, in stages.
  double lag() const { return (at.time - controller->getPlanTime(at.time)) / (1e-3 * kStageTicks); }

  const Model& model = getBipetto();
  Workspace ws{model};
  std::vector<std::vector<int>> planned;  // feet that stand, per stage
  std::unique_ptr<PredictiveController> controller;
  Measurement at;
  VectorXd u;
  int tick = 0;
};

}  // namespace

TEST_CASE("predictive control: a foot that finds ground early stands from then on") {
  Walking walk;
  const int foot = walk.findChange(0, false) < walk.findChange(1, false) ? 0 : 1;
  const int begin = walk.findChange(foot, false), landing = walk.findChange(foot, true);
  const int touch = begin + 3 * (landing - begin) / 4;
  for (int stage = 0; stage < touch; ++stage) walk.updateAsPlanned(stage);
  CHECK(walk.getHeight(foot) > 5e-3);
  CHECK(walk.lag() == Approx(0).margin(1e-6));
  walk.update({1, 1});
  CHECK(walk.controller->counts().early == 1);
  CHECK(walk.lag() == Approx(touch + 1 - landing));
  walk.update({1, 1});
  const double height = walk.getHeight(foot);
  for (int i = 0; i < 2; ++i) walk.update({1, 1});
  CHECK(walk.getHeight(foot) == Approx(height).margin(2e-3));  // above the ground of the plan
  CHECK(walk.getHeight(foot) > 3e-3);
  CHECK(walk.controller->counts().failed == 0);
}

TEST_CASE("predictive control: footholds are foreseen where feet come to stand") {
  Walking walk;
  const int foot = walk.findChange(0, false) < walk.findChange(1, false) ? 0 : 1;
  const int begin = walk.findChange(foot, false), landing = walk.findChange(foot, true);
  const auto find = [&](int contact) {
    for (const PredictedFoothold& foothold : walk.controller->footholds())
      if (foothold.contact == contact) return foothold;
    FAIL("none is foreseen");
    return PredictedFoothold();
  };
  for (int stage = 0; stage < begin; ++stage) walk.updateAsPlanned(stage);
  const PredictedFoothold early = find(foot);
  CHECK(early.time == Approx(1e-3 * kStageTicks * landing));
  const auto getFoot = [&] {
    updatePlacements(walk.model, walk.ws, walk.at.q);
    const ContactFrame& contact = walk.model.contacts()[foot];
    return getPlacement(walk.ws, contact.body, contact.X_BF);
  };
  CHECK((early.X_WF.p - getFoot().p).norm() > 0.05);  // a step away
  for (int stage = begin; stage < landing - 1; ++stage) walk.updateAsPlanned(stage);
  const PredictedFoothold late = find(foot);
  for (int stage = landing - 1; stage < landing + 2; ++stage) walk.updateAsPlanned(stage);
  CHECK((late.X_WF.p - getFoot().p).norm() < 2e-3);
  CHECK((early.X_WF.p - getFoot().p).norm() < 0.02);
  // Then it is the other one's turn.
  int next = landing + 1;
  while (walk.stands(next, 1 - foot)) ++next;
  while (!walk.stands(next, 1 - foot)) ++next;
  CHECK(find(1 - foot).time == Approx(1e-3 * kStageTicks * next));
  CHECK(find(1 - foot).X_WF.p.x() > getFoot().p.x() + 0.05);
}

TEST_CASE("predictive control: a foot that touches early has landed where it may land, and not elsewhere") {
  for (double room : {0.4, 0.02}) {
    CAPTURE(room);
    Walking walk(0, room);
    const int foot = walk.findChange(0, false) < walk.findChange(1, false) ? 0 : 1;
    const int begin = walk.findChange(foot, false), landing = walk.findChange(foot, true);
    const int half = begin + 5 * (landing - begin) / 8;
    for (int stage = 0; stage < half; ++stage) walk.updateAsPlanned(stage);
    walk.update({1, 1});  // on an edge, several centimetres from its foothold
    CHECK(walk.controller->counts().early == (room > 0.1 ? 1 : 0));
    for (int stage = half + 1; stage < landing - 3; ++stage) walk.updateAsPlanned(stage);
    CHECK((walk.lag() < 0) == (room > 0.1));
    walk.update({1, 1});  // over it
    CHECK(walk.controller->counts().early == 1);
    CHECK(walk.controller->counts().failed == 0);
  }
}

TEST_CASE("predictive control: gains that look ahead are those of an earlier solution of the same phase") {
  constexpr int kStages = 3;
  Walking walk(kStages * 1e-3 * kStageTicks), nearby;
  const int foot = walk.findChange(0, false) < walk.findChange(1, false) ? 0 : 1;
  const int landing = walk.findChange(foot, true);
  const auto collect = [landing](Walking& by) {
    std::vector<RowMatrixXd> gains;
    for (int stage = 0; stage <= landing; ++stage) {
      by.updateAsPlanned(stage);
      gains.push_back(by.controller->policy().stages().front().K);
    }
    return gains;
  };
  const std::vector<RowMatrixXd> far = collect(walk), near = collect(nearby);
  for (int k : {landing - 2, landing - 1}) {
    CHECK(far[k] == far[landing - kStages]);
    CHECK(near[k] != near[landing - kStages]);
  }
  CHECK(far[landing - kStages] != far[landing - kStages - 1]);
  CHECK(far[landing] != far[landing - 1]);
}

TEST_CASE("predictive control: a foot that finds no ground is lowered until it does, and the motion waits for it") {
  Walking walk;
  const int foot = walk.findChange(0, false) < walk.findChange(1, false) ? 0 : 1, landing = walk.findChange(foot, true);
  for (int stage = 0; stage < landing; ++stage) walk.updateAsPlanned(stage);
  CHECK(std::abs(walk.getHeight(foot)) < 3e-3);
  std::vector<char> hangs{1, 1};
  hangs[foot] = 0;
  for (int i = 0; i < 6; ++i) walk.update(hangs);
  CHECK(walk.controller->counts().late == 1);
  CHECK(walk.lag() > 3);
  CHECK(walk.getHeight(foot) < -5e-3);
  for (int i = 0; i < 3; ++i) walk.update({1, 1});
  const double height = walk.getHeight(foot), lag = walk.lag();
  CHECK(height < -5e-3);
  // It stands there, in the middle of each stage: nothing here takes the speed at which it touched, which steps from middle to
  // middle turn round at every node.
  for (int i = 0; i < 4; ++i) walk.update({1, 1});
  CHECK(walk.getHeight(foot) == Approx(height).margin(1e-4));
  CHECK(walk.lag() == Approx(lag));
  CHECK(walk.controller->counts().late == 1);
  CHECK(walk.controller->counts().failed == 0);
}

TEST_CASE("predictive control: the motion does not wait for ever for ground that is not there") {
  Walking walk;
  const int foot = walk.findChange(0, false) < walk.findChange(1, false) ? 0 : 1, landing = walk.findChange(foot, true);
  for (int stage = 0; stage < landing; ++stage) walk.updateAsPlanned(stage);
  std::vector<char> hangs{1, 1};
  hangs[foot] = 0;
  for (int i = 0; i < 25; ++i) walk.update(hangs);
  const double lag = walk.lag();
  CHECK(lag > 5);
  for (int i = 0; i < 5; ++i) walk.update(hangs);
  CHECK(walk.lag() == Approx(lag));
  CHECK(walk.getHeight(foot) > -0.1);
  CHECK(walk.controller->counts().late == 1);
}

}  // namespace bielle
