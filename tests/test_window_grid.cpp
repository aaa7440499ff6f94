// The nodes of a window of predictive control that stand for several stages.
#include <catch2/catch.hpp>
#include <cmath>
#include <functional>

#include "bielle/motion/jump.h"
#include "bielle/motion/squat.h"
#include "bielle/robots/robot_loader.h"
#include "control/window_grid.h"
#include "own_robots.h"

namespace bielle {
namespace {

using bielle::testing::getBipetto;
using Node = WindowGrid::Node;
using Origin = WindowGrid::Origin;

// A window over a walk by command, and what every window must be.
struct Walk {
  explicit Walk(int fine_nodes) {
    options.fine_nodes = fine_nodes;
    LocomotionOptions gait;
    gait.foothold_room = 0.4;
    gait.contact_kp = 0;
    const CommandSource source = [](double) { return VelocityCommand{0.4, 0, 0}; };
    CommandedWalk walk(getBipetto(), gait, {}, source, makeStandingRobot(getBipetto()));
    CommandedWalk plan = walk;
    for (int k = 0; k < 400; ++k) planned.push_back(plan.makeNext());
    horizon = makeWalkHorizon(std::move(walk), options);
    grid.emplace(*horizon, options);
  }
  void move(int first, int changed = 0, int changed_end = 0) {
    horizon->prepare(first);
    grid->move(first, changed, changed_end);
    check(first);
  }
  const StageSpec& getSpec(size_t k) const { return horizon->getProblem().spec(grid->stages()[k]); }

  void check(int first) const {
    const std::vector<Node>& nodes = grid->nodes();
    REQUIRE(static_cast<int>(nodes.size()) == options.nodes);
    REQUIRE(grid->begin() == first);
    CHECK(grid->end() - first <= countMostStages(options, planned[0].spec.dt));
    for (size_t k = 0; k < nodes.size(); ++k) {
      const Node& node = nodes[k];
      const int distance = node.begin - first;
      CAPTURE(first, k, node.begin, node.length);
      if (k > 0) REQUIRE(node.begin == nodes[k - 1].end());
      REQUIRE(node.length >= 1);
      REQUIRE(node.length <= (distance < options.fine_nodes ? 1 : distance < 3 * options.fine_nodes ? 2 : 4));
      // It is its first stage but for its length, and feet stand or swing through all of it.
      const CommandedWalk::Stage& stage = planned[node.begin];
      CHECK(getSpec(k).dt == Approx(node.length * stage.spec.dt));
      CHECK(getSpec(k).costs.size() == stage.spec.costs.size());
      CHECK(getSpec(k).path_constraints.size() == stage.spec.path_constraints.size());
      for (int s = node.begin; s < node.end(); ++s) {
        CHECK(planned[s].spec.constraints.contacts == stage.spec.constraints.contacts);
        CHECK(planned[s].spec.costs.size() == stage.spec.costs.size());
      }
      for (const Closure& closure : getSpec(k).constraints.closures) CHECK(closure.kd * getSpec(k).dt <= 1 + 1e-12);
    }
  }
  // Each node takes over what it was, or a part of that.
  void checkSources(const std::vector<Node>& before) const {
    const std::vector<NodeSource>& sources = grid->sources();
    REQUIRE(sources.size() == grid->nodes().size() + 1);
    CHECK_FALSE(sources.front().same);
    CHECK_FALSE(sources.back().same);
    CHECK(sources.back().node == options.nodes);
    for (size_t k = 0; k + 1 < sources.size(); ++k) {
      const Node& node = grid->nodes()[k];
      if (node.origin == Origin::Appended || node.origin == Origin::Earlier) continue;
      const Node& source = before[sources[k].node];
      CHECK(source.begin <= node.begin);
      CHECK(node.end() <= source.end());
      CHECK((node.origin == Origin::Kept) == (node.begin == source.begin));
      CHECK(sources[k].share == Approx(std::sqrt(static_cast<double>(node.length) / source.length)));
      CHECK(sources[k].same == (k > 0 && node.begin == source.begin && node.length == source.length));
    }
  }

  PredictiveOptions options;
  std::vector<CommandedWalk::Stage> planned;
  std::unique_ptr<Horizon> horizon;
  std::optional<WindowGrid> grid;
};

}  // namespace

TEST_CASE("window grid: far nodes stand for several stages, and are cut in two as they come nearer") {
  Walk walk(16);
  walk.move(0);
  CHECK(walk.grid->end() > 80);
  int cut = 0, same = 0, moves = 0;
  for (int first = 1; first < 150; ++first, ++moves) {
    const std::vector<Node> before = walk.grid->nodes();
    walk.move(first);
    walk.checkSources(before);
    for (const Node& node : walk.grid->nodes()) cut += node.origin == Origin::Cut;
    for (const NodeSource& source : walk.grid->sources()) same += source.same;
  }
  CHECK(cut > moves / 2);
  CHECK(same > 40 * moves);  // of 48
}

namespace {

// The first window over a squat of stages that short; `moves` is called while it moves on.
void walkThrough(const Model& model, double time_step,
                 const std::function<void(const WindowGrid&, RobotProblem&)>& look) {
  SquatOptions squat;
  squat.time_step = time_step;
  const PredictiveOptions options;
  const Motion motion = makePredictiveMotion(model, planSquat(model, squat, makeStandingRobot(model)), {}, options);
  const int stages = motion.problem->numStages() - countMostStages(options, time_step);
  ShootingTrajectory solved = motion.guess;
  solved.xs.resize(stages + 1);
  solved.us.resize(stages);
  const auto horizon = makeMotionHorizon(motion, solved, options);
  WindowGrid grid(*horizon, options);
  for (int first = 0; first <= stages; ++first) {
    grid.move(first);
    look(grid, horizon->getProblem());
  }
}

}  // namespace

TEST_CASE("window grid: windows are not much shorter where stages are, and change little as they move on") {
  for (const double time_step : {0.015, 0.0075, 0.005}) {
    CAPTURE(time_step);
    std::optional<int> last;
    int most_cut = 0;
    walkThrough(getBipetto(), time_step, [&](const WindowGrid& grid, RobotProblem&) {
      const double duration = (grid.end() - grid.begin()) * time_step;
      CHECK(duration > 0.6);
      CHECK(duration < 1.1);
      CHECK(grid.nodes()[29].end() == grid.begin() + 30);
      int cut = 0;
      for (const Node& node : grid.nodes()) cut += node.origin == Origin::Cut;
      if (last) most_cut = std::max(most_cut, cut);
      last = grid.end();
    });
    CHECK(most_cut <= 4);
  }
}

TEST_CASE("window grid: nodes of several stages take springs implicitly, those of one as they are") {
  const Model model = loadRobot(BIELLE_SOURCE_DIR "/robots/spring_biped").model;
  int longest = 0;
  walkThrough(model, 0.005, [&](const WindowGrid& grid, RobotProblem& problem) {
    for (size_t k = 0; k < grid.nodes().size(); ++k) {
      const StageSpec& spec = problem.spec(grid.stages()[k]);
      const int length = grid.nodes()[k].length;
      longest = std::max(longest, length);
      REQUIRE(spec.dt == Approx(0.005 * length));
      REQUIRE(spec.armature.size() == (length > 1 ? model.nv() : 0));
      if (length == 1) continue;
      for (const JointForce& force : model.jointForces())
        REQUIRE(spec.armature[force.dof] == Approx(spec.dt * spec.dt * force.stiffness / 4));
    }
  });
  CHECK(longest == 8);
}

TEST_CASE("window grid: a window may leap ahead, through the middle of nodes, and move back") {
  Walk walk(12);
  int first = 0;
  walk.move(first);
  for (int step : {7, -2, 1, 15, -2, 31, 0, 22, 40}) {
    const std::vector<Node> before = walk.grid->nodes();
    CAPTURE(step);
    walk.move(first += step);
    walk.checkSources(before);
    const std::vector<Node>& nodes = walk.grid->nodes();
    for (int k = 0; k < -step; ++k) CHECK(nodes[k].origin == Origin::Earlier);
    // The state at the end, if that has come nearer.
    const Node* next = walk.grid->next();
    CHECK((next != nullptr) == (nodes.back().end() < before.back().end()));
    if (next) CHECK(next->begin == nodes.back().end());
  }
}

TEST_CASE("window grid: stages have their own length again when nodes no longer stand for them") {
  Walk walk(10);
  walk.move(0);
  for (int first : {3, 40, 90}) walk.move(first);
  walk.grid->clear();
  CHECK(walk.grid->nodes().empty());
  const RobotProblem& problem = walk.horizon->getProblem();
  for (int k = 0; k < problem.numStages(); ++k) CHECK(problem.spec(k).dt == walk.planned[0].spec.dt);
}

TEST_CASE("window grid: stages that were replaced are not the same") {
  Walk walk(16);
  walk.move(0);
  walk.move(5, 8, 11);
  const std::vector<NodeSource>& sources = walk.grid->sources();
  for (int k = 1; k < 11; ++k) CHECK(sources[k].same == (k + 5 < 8 || k + 5 >= 11));
}

TEST_CASE("window grid: with as many fine nodes as there are nodes, each is a stage") {
  Walk walk(48);
  for (int first : {0, 1, 2, 30}) {
    walk.move(first);
    CHECK(walk.grid->end() == first + 48);
  }
}

namespace {

// The nodes of the first window over a squat whose stages have been changed. \param change  of a stage, by its number
std::vector<Node> listNodes(const std::function<void(int, StageSpec&)>& change) {
  const Model& model = getBipetto();
  PredictiveOptions options;
  options.fine_nodes = 10;
  const Motion motion = makePredictiveMotion(model, planSquat(model, {}, makeStandingRobot(model)), {}, options);
  const int stages = motion.problem->numStages() - countMostStages(options, motion.problem->spec(0).dt);
  for (int k = 0; k < stages; ++k) {
    StageSpec spec = motion.problem->spec(k);
    change(k, spec);
    motion.problem->replaceStage(k, std::move(spec));
  }
  ShootingTrajectory solved = motion.guess;
  solved.xs.resize(stages + 1);
  solved.us.resize(stages);
  const auto horizon = makeMotionHorizon(motion, solved, options);
  WindowGrid grid(*horizon, options);
  grid.move(0);
  return grid.nodes();
}

}  // namespace

TEST_CASE("window grid: stages whose names are the same are not joined unless their weights and limits are, too") {
  constexpr int kOther = 44;  // in the middle of a node of four stages, unless it differs
  const auto standsAlone = [](const std::function<void(StageSpec&)>& change) {
    for (const Node& node : listNodes([&](int k, StageSpec&spec) {
           if (k == kOther) change(spec);
         }))
      if (node.begin <= kOther && kOther < node.end()) return node.length == 1;
    return false;
  };
  CHECK_FALSE(standsAlone([](StageSpec&) {}));
  CHECK(standsAlone([](StageSpec& spec) { spec.state.q_ref[8] += 0.1; }));
  CHECK(standsAlone([](StageSpec& spec) { spec.state.q_ref[2] -= 0.1; }));
  CHECK(standsAlone([](StageSpec& spec) { spec.state.v_ref[9] = 1; }));
  CHECK(standsAlone([](StageSpec& spec) { spec.state.weights[8] *= 2; }));
  CHECK(standsAlone([](StageSpec& spec) { spec.state.weight *= 2; }));
  CHECK(standsAlone([](StageSpec& spec) { spec.control.reference[2] = 1; }));
  CHECK(standsAlone([](StageSpec& spec) { spec.control.weights[2] *= 2; }));
  CHECK(standsAlone([](StageSpec& spec) { spec.effort_limits[0] = 1; }));
  // The heading turns while the robot walks.
  CHECK_FALSE(standsAlone([](StageSpec& spec) { spec.state.q_ref.segment<4>(3) << 0, 0, 0.1, std::sqrt(0.99); }));
}

TEST_CASE("window grid: terms without a name join stages only where they are the same") {
  const auto countStages = [](const std::function<void(int, StageSpec&)>& change) {
    return listNodes(change).back().end();
  };
  const int named = countStages([](int, StageSpec&) {}), nodes = PredictiveOptions().nodes;
  REQUIRE(named > nodes + 30);
  // Each stage has a height of its own.
  CHECK(countStages([](int, StageSpec& spec) {
          for (Cost& cost : spec.costs) cost.name.clear();
        }) == nodes);
  const std::shared_ptr<const Residual> shared = makeComVelocity(Vector3d::Zero());
  const auto takeTerms = [&](int k, double weight, double upper, StageSpec& spec) {
    for (Cost& cost : spec.costs) cost = {"", 1, Activation::makeQuadratic(weight * Vector3d::Ones()), shared};
    spec.path_constraints.resize(1);
    const Vector3d ones = Vector3d::Ones();
    if (k > 0) spec.path_constraints[0] = {"", shared, -ones, upper * ones, ones};
  };
  CHECK(countStages([&](int k, StageSpec& spec) { takeTerms(k, 1, 1, spec); }) == named);
  CHECK(countStages([&](int k, StageSpec& spec) { takeTerms(k, 1 + k, 1, spec); }) == nodes);
  CHECK(countStages([&](int k, StageSpec& spec) { takeTerms(k, 1, 1 + k, spec); }) == nodes);
}

TEST_CASE("window grid: a squat's bottom and a jump's impact are nodes of their own") {
  const Model& model = getBipetto();
  PredictiveOptions options;
  options.fine_nodes = 10;
  const StandingRobot standing = makeStandingRobot(model);
  for (MotionPlan plan : {planSquat(model, {}, standing), planJump(model, {}, standing)}) {
    const Motion motion = makePredictiveMotion(model, std::move(plan), {}, options);
    const int stages = motion.problem->numStages() - countMostStages(options, motion.problem->spec(0).dt);
    ShootingTrajectory solved = motion.guess;
    solved.xs.resize(stages + 1);
    solved.us.resize(stages);
    std::vector<StageSpec> specs;
    for (int k = 0; k < motion.problem->numStages(); ++k) specs.push_back(motion.problem->spec(k));
    const auto horizon = makeMotionHorizon(motion, solved, options);
    WindowGrid grid(*horizon, options);
    for (int first = 0; first <= stages; first += 5) {
      grid.move(first);
      CHECK(grid.end() <= static_cast<int>(specs.size()));
      for (const Node& node : grid.nodes()) {
        for (int s = node.begin + 1; s < node.end(); ++s) {
          CHECK(specs[s].kind == StageKind::Dynamics);
          CHECK(specs[s].costs.size() == specs[node.begin].costs.size());
          CHECK(specs[s].path_constraints.size() == specs[node.begin].path_constraints.size());
        }
      }
    }
  }
}

}  // namespace bielle
