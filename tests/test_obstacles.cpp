// Uneven footholds, a box and a gap: feet on the ground they were given, and nowhere else.
#include <catch2/catch.hpp>

#include "bielle/model/error.h"
#include "change_option.h"
#include "measure_steps.h"
#include "motion/footholds.h"
#include "motion/obstacles.h"
#include "own_robots.h"
#include "robot_directory.h"
#include "solve_in_place.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

StepMeasures solveAndMeasure(Motion& motion) {
  FddpOptions solver;
  solver.initial_regularization = kGuessRegularization;
  solver.max_iterations = 150;
  const FddpSummary summary = test::solveInPlace(*motion.problem, motion.guess, solver);
  CAPTURE(summary.message, summary.iterations);
  CHECK(summary.termination == FddpTermination::Converged);
  return StepMeter(motion, motion.guess).measure();
}

// Every standing sole lies on the ground, corners and middle.
void checkGround(const Motion& motion) {
  for (const ContactPhase& phase : motion.schedule.phases)
    for (const ContactTarget& foot : phase.contacts) {
      const ContactFrame& sole = getBipetto().contacts()[foot.contact];
      for (double x : {-1, 0, 1})
        for (double y : {-1, 0, 1}) {
          const Vector3d p = foot.X_WT.act(Vector3d(x * sole.half_length, y * sole.half_width, 0));
          CHECK(motion.ground.calcHeight(p.x(), p.y()) == Approx(p.z()).margin(1e-9));
        }
    }
}

std::string read(const std::string& text) {
  const RobotDirectory directory;
  return readFootholds(directory.write("footholds_under_test.yaml", text));
}

constexpr const char* kStones = R"(footholds:
  - {foot: right, x: 0.15, y: -0.1, z: 0.03}
  - {foot: left, x: 0.3, y: 0.12, z: 0.05, yaw: 0.15, roll: 0.1}
  - {foot: right, x: 0.45, y: -0.06, z: 0.02, pitch: -0.1}
  - {foot: left, x: 0.6, y: 0.13, z: -0.02}
)";

}  // namespace

TEST_CASE("footholds: Bipetto walks over inclined stones of a file", "[long]") {
  FootholdsOptions options;
  options.footholds = read(kStones);
  Motion motion = makeFootholds(getBipetto(), options);
  checkGround(motion);
  REQUIRE(motion.goals.size() == 1);
  REQUIRE(motion.goals[0].footholds.size() == 5);  // the last step brings the right foot beside the left one
  const Vector3d last = motion.goals[0].footholds[3].position, beside = motion.goals[0].footholds[4].position;
  CHECK(beside.x() == Approx(last.x()));
  CHECK(beside.z() == Approx(last.z()));
  CHECK(motion.ground.height < last.z() - 0.04);  // stones go down below the start, so that it has a platform
  const StepMeasures m = solveAndMeasure(motion);
  checkFeet(m);
  CHECK(m.tilt < 0.15);
  CHECK(m.bend > 0.3);
  CHECK(m.end.z() - m.start.z() == Approx(-0.02).margin(0.01));
}

TEST_CASE("footholds: the height of an inclined stone is that of its plane") {
  const double pitch = 0.2, roll = -0.3, yaw = 0.5;
  const GroundStep stone{Vector3d(1, 2, 0.3), 1, 1, yaw, pitch, roll};
  const Matrix3d R = makeAxisRotation(Vector3d::UnitZ(), yaw) * makeAxisRotation(Vector3d::UnitY(), pitch) *
                     makeAxisRotation(Vector3d::UnitX(), roll);
  for (const Vector3d& local : {Vector3d(0.1, 0, 0), Vector3d(0, 0.1, 0), Vector3d(-0.1, 0.2, 0)}) {
    const Vector3d p = stone.top + R * local;
    CHECK(stone.calcHeight(p.x(), p.y()) == Approx(p.z()).margin(1e-12));
  }
}

TEST_CASE("footholds: a file's errors name the entry, impossible steps their number") {
  for (const auto& [entry, word] :
       std::vector<std::pair<std::string, std::string>>{{"{foot: middle, x: 0.1, y: 0}", "left or right"},
                                                        {"{foot: left, y: 0.1}", "'x'"},
                                                        {"{foot: left, x: 0.1, y: here}", "not a number"},
                                                        {"{foot: left, x: .nan, y: 0.1}", "finite"},
                                                        {"{foot: left, x: 0.1, y: 0.1, pitch: 1}", "steeper"},
                                                        {"{foot: left, x: 0.1, y: 0.1, height: 1}", "height"}}) {
    CAPTURE(entry);
    CHECK_THROWS_AS(read("footholds:\n  - " + entry + "\n"), InputError);
    CHECK_THROWS_WITH(read("footholds:\n  - " + entry + "\n"), Catch::Contains("footholds_under_test.yaml") &&
                                                                   Catch::Contains("line 2") && Catch::Contains(word));
  }
  CHECK_THROWS_WITH(read("footholds: []\n"), Catch::Contains("no foothold"));
  CHECK_THROWS_AS(readFootholds("no_such_file.yaml"), InputError);
  for (const auto& [text, word] : std::vector<std::pair<std::string, std::string>>{
           {"- {foot: right, x: 0.2, y: -0.1, pitch: 0.1}", "level"},
           {"- {foot: right, x: 0.2, y: -0.1}\n- {foot: right, x: 0.3, y: -0.1}", "alternately"},
           {"- {foot: right, x: 0.9, y: -0.1}", "reach"},
           {"- {foot: right, x: 0.2, y: -0.1, z: 0.05}\n- {foot: left, x: 0.2, y: 0.0}", "in the stone of step 1"}}) {
    CAPTURE(text);
    FootholdsOptions options;
    options.footholds = read("footholds:\n" + text + "\n");
    CHECK_THROWS_WITH(makeFootholds(getBipetto(), options), Catch::Contains(word));
  }
  CHECK_THROWS_WITH(makeFootholds(getBipetto(), {}), Catch::Contains("--footholds"));
}

TEST_CASE("box: Bipetto steps onto it and down again", "[long]") {
  BoxOptions options;
  options.down = true;
  Motion motion = makeBox(getBipetto(), options);
  checkGround(motion);
  const Goal& height = motion.goals.at(0);
  CHECK(height.requested == options.height);
  const StepMeasures m = solveAndMeasure(motion);
  checkFeet(m);
  CHECK(m.tilt < 0.2);
  CHECK(m.bend > 0.2);
  CHECK(m.end.z() == Approx(m.start.z()).margin(0.01));
  // With both feet on the box the centre of mass is about as much higher.
  CHECK(m.touchdown_coms.at(1).z() - m.start.z() == Approx(options.height).margin(0.03));
}

TEST_CASE("gap: the ground is missing where it was requested, and no foot stands there", "[long]") {
  GapOptions options;
  options.width = 0.2;
  Motion motion = makeGap(getBipetto(), options);
  checkGround(motion);
  const double level = motion.schedule.phases.front().contacts.front().X_WT.p.z();
  double before = 1e9, after = -1e9;  // edges of the gap, by looking
  for (double x = -0.3; x < 0.8; x += 1e-3)
    if (motion.ground.calcHeight(x, 0) < level - 0.1) before = std::min(before, x), after = std::max(after, x);
  CHECK(after - before == Approx(options.width).margin(3e-3));
  const StepMeasures m = solveAndMeasure(motion);
  checkFeet(m);
  CHECK(m.tilt < 0.15);
  CHECK(m.end.x() - m.start.x() == Approx(0.2 + 2 * (0.05 + options.distance)).margin(0.01));
}

TEST_CASE("box, gap: what cannot be done is refused by name") {
  const auto make = [](bool box, const std::string& option, double value) {
    box ? makeBox(getBipetto(), changeOption(BoxOptions(), option, value))
        : makeGap(getBipetto(), changeOption(GapOptions(), option, value));
  };
  for (const auto& [box, option, value, word] :
       std::vector<std::tuple<bool, std::string, double, std::string>>{{true, "height", 0.6, "reach"},
                                                                       {true, "height", -0.1, "height"},
                                                                       {true, "length", 0.05, "length"},
                                                                       {true, "width", 0.1, "width"},
                                                                       {true, "distance", -1, "distance"},
                                                                       {true, "down", 0.5, "down"},
                                                                       {true, "swing_leave", 0, "swing"},
                                                                       {false, "width", 0.8, "reach"},
                                                                       {false, "width", 0, "width"},
                                                                       {false, "depth", 0, "depth"}}) {
    CAPTURE(box, option, value);
    CHECK_THROWS_AS(make(box, option, value), InputError);
    CHECK_THROWS_WITH(make(box, option, value), Catch::Contains(word));
  }
}
