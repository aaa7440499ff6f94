// Walks by command: files of commands, and the stages that are made as the commands say.
#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "bielle/motion/commanded_walk.h"
#include "count_allocations.h"
#include "dynamics/linkage_workspace.h"
#include "get_error.h"
#include "own_robots.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

CommandedWalk makeCommandedWalk(const std::vector<TimedCommand>& commands) {
  return {getBipetto(),
          {},
          {},
          [commands](double time) { return findCommand(commands, time); },
          makeStandingRobot(getBipetto())};
}

// A placement of the middle of the feet over time, and the stages.
struct Walked {
  std::vector<CommandedWalk::Stage> stages;
  std::vector<SE3> middles;  // at double supports
};
Walked walk(const std::vector<TimedCommand>& commands, double duration) {
  CommandedWalk walk = makeCommandedWalk(commands);
  Walked out;
  for (double time = 0; time < duration; time += walk.timeStep()) {
    out.stages.push_back(walk.makeNext());
    const std::vector<ContactTarget>& contacts = out.stages.back().contacts;
    if (contacts.size() == 2) out.middles.push_back(calcMiddle(contacts[0].X_WT, contacts[1].X_WT));
  }
  return out;
}

}  // namespace

TEST_CASE("commands: each holds until the next one, and before the first there is rest") {
  const std::vector<TimedCommand> commands{{0.5, {0.4, 0, 0}}, {2, {0.3, 0.4, 0.2}}, {3, {}}};
  CHECK(findCommand(commands, 0.4).isRest());
  CHECK(findCommand(commands, 0.5).forward == 0.4);
  CHECK(findCommand(commands, 2.9).turning == 0.2);
  CHECK(findCommand(commands, 1e6).isRest());
  CHECK(calcMeanSpeed(commands, 4) == Approx((1.5 * 0.4 + 0.5) / 4));
  CHECK(calcMeanSpeed(commands, 1) == Approx(0.5 * 0.4));
}

TEST_CASE("commands: a file is read, and errors name file, entry and remedy") {
  const std::string path = (std::filesystem::temp_directory_path() / "bielle_commands.yaml").string();
  const auto read = [&](const std::string& text) {
    std::ofstream(path) << text;
    return readCommands(path);
  };
  const std::vector<TimedCommand> commands =
      read("commands:\n  - {time: 0.5, forward: 0.4}\n  - {time: 2, sideways: -0.1, turning: 0.3}\n");
  REQUIRE(commands.size() == 2);
  CHECK(commands[0].velocity.forward == 0.4);
  CHECK(commands[1].velocity.sideways == -0.1);
  CHECK(commands[1].velocity.turning == 0.3);
  const std::vector<std::pair<std::string, std::string>> bad{
      {"commands: []\n", "no command"},
      {"commands:\n  - {forward: 0.4}\n", "time"},
      {"commands:\n  - {time: -1}\n", "negative"},
      {"commands:\n  - {time: 1}\n  - {time: 1}\n", "order of time"},
      {"commands:\n  - {time: 1, forward: .nan}\n", "finite"},
      {"commands:\n  - {time: 1, up: 2}\n", "up"},
      {"velocities: 3\n", "velocities"}};
  for (const auto& [text, named] : bad) {
    const std::string error = getError([&, &text = text] { read(text); });
    CAPTURE(text, error);
    CHECK(error.find("bielle_commands.yaml") != std::string::npos);
    CHECK(error.find(named) != std::string::npos);
  }
  std::filesystem::remove(path);
}

TEST_CASE("commands: what legs cannot do is refused by name") {
  const StandingRobot standing = makeStandingRobot(getBipetto());
  checkCommand(getBipetto(), standing, {}, {0.4, 0.1, 0.3}, "command 1");
  CHECK(getError([&] {
          checkCommand(getBipetto(), standing, {}, {5, 0, 0}, "command 7");
        }).find("command 7") != std::string::npos);
  CHECK(getError([&] {
          checkCommand(getBipetto(), standing, {}, {0, 0, 6}, "command 8");
        }).find("command 8") != std::string::npos);
}

TEST_CASE("commanded walk: the feet go as far and turn as much as commanded, then stand together") {
  const GaitTiming timing = LocomotionOptions().timing;
  const Walked ahead = walk({{0.5, {0.4, 0, 0}}, {4.5, {}}}, 7);
  const double steps = std::floor(ahead.middles.back().p.x() / (0.4 * timing.stepDuration()) + 0.5);
  CHECK(ahead.middles.back().p.x() - ahead.middles.front().p.x() ==
        Approx(steps * 0.4 * timing.stepDuration()).margin(1e-9));
  CHECK(std::abs(steps - 4 / timing.stepDuration()) < 2.5);  // the first begins after a double support
  const Walked turning = walk({{0, {0, 0, 0.4}}, {3, {}}}, 5);
  const double yaw = calcHeading(turning.middles.back()), of_step = 0.4 * timing.stepDuration();
  CHECK(yaw / of_step == Approx(std::round(yaw / of_step)).margin(1e-9));
  CHECK(yaw == Approx(0.4 * 3).margin(1.5 * of_step));
  const Walked sideways = walk({{0, {0, 0.2, 0}}, {3, {}}}, 5);
  CHECK(sideways.middles.back().p.y() - sideways.middles.front().p.y() == Approx(0.2 * 3).margin(0.2));
  for (const Walked* walked : {&ahead, &turning, &sideways}) {
    const std::vector<ContactTarget>&first = walked->stages.front().contacts, &last = walked->stages.back().contacts;
    REQUIRE(last.size() == 2);
    const SE3 before = first[0].X_WT.inverseTimes(first[1].X_WT), after = last[0].X_WT.inverseTimes(last[1].X_WT);
    CHECK((before.p - after.p).norm() < 1e-9);
    CHECK((before.R - after.R).norm() < 1e-9);
    CHECK(walked->stages.back().x.tail(getBipetto().nv()).norm() < 1e-2);  // at rest
  }
}

TEST_CASE("commanded walk: from step to step its path has no jumps") {
  // From rest the pendulum of gait.h starts at once; on the way and to rest it changes its velocity steadily.
  const Walked walked = walk({{0, {0.4, 0, 0}}, {2.5, {0.2, 0.1, 0.4}}, {5, {}}}, 8);
  const Model& model = getBipetto();
  const double h = makeCommandedWalk({}).timeStep();
  for (size_t k = 0; k + 1 < walked.stages.size(); ++k) {
    const CommandedWalk::Stage &now = walked.stages[k], &next = walked.stages[k + 1];
    const VectorXd v = model.difference(now.x.head(model.nq()), next.x.head(model.nq())) / h;
    CAPTURE(k);
    REQUIRE((v - now.x.tail(model.nv())).norm() < 1e-6);
    REQUIRE(v.head<3>().norm() < 0.8);
    REQUIRE((next.x.tail(model.nv()) - now.x.tail(model.nv())).head<3>().norm() < 0.12);  // 1 g
    REQUIRE((next.phase == now.phase) == (next.contacts.size() == now.contacts.size()));
    REQUIRE(now.spec.dt == h);
  }
}

TEST_CASE("commanded walk: all its steps share the memory of their linkages") {
  const Walked walked = walk({{0, {0.4, 0, 0}}}, 2);
  const Model& model = getBipetto();
  Workspace ws(model);
  ws.q = makeStandingPosture(model);
  const ConstraintSet none;
  const VectorXd nothing;
  LinkageWorkspaces memory;
  NodeView node{model, ws, none, nothing, nothing};
  node.linkages = &memory;
  const auto calc = [&](const CommandedWalk::Stage& stage) {
    int linkages = 0;
    for (const PathConstraint& constraint : stage.spec.path_constraints) {
      if (constraint.name.rfind("dead points", 0) != 0) continue;
      VectorXd transmission(1);
      constraint.residual->calc(node, transmission);
      CHECK(transmission[0] == Approx(1));
      ++linkages;
    }
    return linkages;
  };
  const long before = num_allocations_here;
  CHECK(calc(walked.stages.front()) == 4);
  const long made = num_allocations_here;
  CHECK(calc(walked.stages.back()) == 4);
  const long with_memory = num_allocations_here - made;
  calc(walked.stages.back());
  CHECK(num_allocations_here - made == 2 * with_memory);
  CHECK(made - before > 2 * with_memory);
}
