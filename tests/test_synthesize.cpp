// Four-bars by their closed form, against differences and the mechanism itself; the search, and what the command writes.
#include <catch2/catch.hpp>
#include <filesystem>
#include <random>

#include "bielle/dynamics/assembly.h"
#include "bielle/robots/robot_loader.h"
#include "design/fourbar_drawing.h"
#include "design/robot_ratios.h"
#include "leg_biped.h"
#include "robot_directory.h"
#include "run_command.h"

using namespace bielle;
using namespace bielle::testing;
using Catch::Contains;

namespace {

FourBarSpace makeUsualSpace() {
  FourBarSpace space;
  space.lower.resize(FourBarDrawing::kCount), space.upper.resize(FourBarDrawing::kCount);
  space.lower << -0.1, 0.08, 0.02, -M_PI, 0.02, -M_PI;
  space.upper << 0.1, 0.25, 0.1, M_PI, 0.1, M_PI;
  return space;
}

}  // namespace

TEST_CASE("four-bars: ratios are differences of the crank's turn, and bars keep their lengths") {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> uniform(0, 1);
  const FourBarSpace space = makeUsualSpace();
  int count = 0;
  for (int trial = 0; trial < 400; ++trial) {
    VectorXd x(FourBarDrawing::kCount);
    for (double& share : x) share = uniform(random);
    const FourBarDrawing d = FourBarDrawing::fromVector(space.lower + x.cwiseProduct(space.upper - space.lower));
    const double turn = 0.6 * (uniform(random) - 0.5), h = 1e-5;
    const FourBarState ahead = calcFourBar(d, turn + h), behind = calcFourBar(d, turn - h), here = calcFourBar(d, turn);
    if (!ahead.closes || !behind.closes || here.sine < 0.1) continue;
    ++count;
    const double numeric = std::remainder(ahead.turn - behind.turn, 2 * M_PI) / (2 * h);
    const auto isClose = [&](double ratio) {
      return std::abs(ratio - numeric) < 1e-5 * std::max(1.0, std::abs(numeric));
    };
    CHECK(isClose(here.ratio));
    CHECK_FALSE(isClose(here.ratio + 1e-3 * std::max(1.0, std::abs(here.ratio))));
    const auto point = [](double radius, double angle) {
      return Eigen::Vector2d(radius * std::cos(angle), radius * std::sin(angle));
    };
    const auto calcRod = [&](double crank_turn, double joint_turn) {
      return (Eigen::Vector2d(d.motor_x, d.motor_z) + point(d.crank, d.crank_angle - crank_turn) -
              point(d.arm, d.arm_angle - joint_turn))
          .norm();
    };
    CHECK(calcRod(here.turn, turn) == Approx(calcRod(0, 0)).epsilon(1e-9));
    CHECK(calcFourBar(d, 0).turn == Approx(0).margin(1e-9));
  }
  CHECK(count > 100);
}

TEST_CASE("four-bars: what a motor must bear is by the ratio, limits are kept") {
  FourBarDrawing d{0, 0.2, 0.05, M_PI, 0.05, M_PI};  // a parallelogram
  JointDemand demand;
  demand.angles = VectorXd::LinSpaced(5, -0.5, 0.5);
  demand.torques = Eigen::VectorXd::LinSpaced(5, 10, 30);
  demand.speeds = VectorXd::Constant(5, 3);
  FourBarSpace space = makeUsualSpace();
  const auto rate = [&] { return rateLinkage(makeFourBars(space, demand), d.toVector(), demand); };
  const FoundLinkage found = rate();
  CHECK(found.value == Approx(demand.torques.norm() / std::sqrt(5)));
  CHECK(found.peak_torque == Approx(30));
  CHECK(found.peak_speed == Approx(3));
  CHECK(found.margin == Approx(std::cos(0.5)));
  demand.largest_speed = 2.9;
  CHECK(std::isinf(rate().value));
  demand.largest_speed = 0;
  space.margin = 0.9;
  CHECK(std::isinf(rate().value));
  space.margin = 0.3, space.clearance = 0.06;  // the rod is 0.05 m beside the joint
  CHECK(std::isinf(rate().value));
}

TEST_CASE("four-bars: the search is the same on any number of threads, and its best is no worse than its samples") {
  JointDemand demand;
  demand.angles = VectorXd::LinSpaced(25, 0, 1.6);
  demand.ratios = VectorXd::Constant(25, 0.9);
  const FourBarSpace space = makeUsualSpace();
  const LinkageFamily family = makeFourBars(space, demand);
  LinkageSearchOptions options;
  options.samples = 60000, options.count = 5;
  const std::vector<FoundLinkage> one = searchLinkages(family, demand, options);
  options.threads = 3;
  const std::vector<FoundLinkage> three = searchLinkages(family, demand, options);
  REQUIRE(one.size() == 5);
  REQUIRE(three.size() == 5);
  for (size_t i = 0; i < one.size(); ++i) {
    CHECK(one[i].x == three[i].x);
    if (i > 0) CHECK(one[i].value >= one[i - 1].value);
    CHECK(one[i].margin >= 0.3);
    CHECK(rateLinkage(family, one[i].x, demand).value == one[i].value);
  }
  CHECK(one[0].value < 0.06);
}

TEST_CASE("synthesize: the mechanism of a drawing has the ratios of the closed form, and its dead points") {
  JointDemand demand;
  demand.angles = VectorXd::LinSpaced(9, 0.5, 1.5);
  demand.ratios = VectorXd::LinSpaced(9, 0.6, 0.9);  // no parallelogram
  LinkageSearchOptions options;
  options.samples = 20000, options.count = 3, options.refined = 5;
  const LinkageFamily drawings = makeFourBars(makeUsualSpace(), demand);
  for (const FoundLinkage& found : searchLinkages(drawings, demand, options)) {
    const FourBarDrawing d = FourBarDrawing::fromVector(found.x);
    const OptionValues numbers = {{"knee", std::string("drawn")},      {"knee_motor_x", d.motor_x},
                                  {"knee_motor_z", d.motor_z},         {"knee_drawn_crank", d.crank},
                                  {"knee_crank_angle", d.crank_angle}, {"knee_drawn_arm", d.arm},
                                  {"knee_arm_angle", d.arm_angle},     {"knee_drawn_at", demand.middle()}};
    CAPTURE(found.x.transpose());
    const JointRatios ratios = calcJointRatios(makeLegBiped(numbers), "knee_left", demand.angles);
    VectorXd expected(demand.angles.size());
    double sine = 0;
    REQUIRE(drawings.calcRatios(found.x, expected, sine));
    CHECK((ratios.ratios - expected).norm() < 1e-6 * expected.norm());
    // Steps from either end of the range, ever shorter, until the closed form is at a dead point.
    double way = 10;
    for (const double direction : {-1, 1}) {
      const double end = direction < 0 ? demand.angles[0] : demand.angles[8];
      const FourBarState from = calcFourBar(d, end - demand.middle());
      FourBarState here = from;
      double angle = end, turned = 0;
      for (double step = 1e-3; step > 1e-9 && std::abs(angle - end) < 3;) {
        const FourBarState next = calcFourBar(d, angle + direction * step - demand.middle());
        if (!next.closes || next.ratio * here.ratio < 0) {
          step /= 10;
          continue;
        }
        turned += std::remainder(next.turn - here.turn, 2 * M_PI);
        angle += direction * step;
        here = next;
      }
      if (here.sine < 1e-3) way = std::min(way, std::max(std::abs(angle - end), std::abs(turned)));
    }
    CAPTURE(ratios.distance, way);
    CHECK(ratios.distance == Approx(way).margin(1e-3));
  }
}

TEST_CASE("synthesize: lengths of any generated robot, as robots within their ranges") {
  const RobotDirectory directory;
  const std::string out = directory.path() + "/found";
  const auto search = [&](std::vector<std::string> more) {
    std::vector<std::string> command = {BIELLE_COMMAND, "synthesize", "leg_biped", "--joint", "knee_left",
                                        "--range",      "0.8:1.6",    "--ratio",   "1.1",     "--samples",
                                        "60",           "--count",    "2",         "-o",      out};
    command.insert(command.end(), more.begin(), more.end());
    return runCommand(command);
  };
  const CommandResult result = search({"--parameter", "knee_crank=0.03:0.08", "--parameter", "knee_arm"});
  INFO(result.out << result.err);
  REQUIRE(result.status == 0);
  const VectorXd angles = VectorXd::LinSpaced(25, 0.8, 1.6);
  const JointRatios found = calcJointRatios(loadRobot(out + "/leg_1").model, "knee_left", angles),
                    usual = calcJointRatios(loadRobot("leg_biped").model, "knee_left", angles);
  const auto calc_deviation = [](const JointRatios& r) { return (r.ratios.array() / 1.1 - 1).abs().maxCoeff(); };
  CHECK(calc_deviation(found) < 0.7 * calc_deviation(usual));
  CHECK(found.distance >= 0.2);
  // With the digits of the search itself.
  CHECK_THAT(readFile(out + "/leg_1/leg_1.yaml"), Catch::Matches("[^]*knee_crank: 0\\.\\d{14,}\n[^]*"));
  CHECK_THAT(search({"--parameter", "knee_length"}).err, Contains("knee_crank"));
  CHECK_THAT(search({"--parameter", "knee_crank=0.1:0.2"}).err, Contains("is not in the range"));
}

TEST_CASE("four-bars: Bipetto's knee is found again by its ratios, and the biped that is written has them") {
  const RobotDirectory directory;
  const std::string out = directory.path() + "/found";
  const CommandResult result = runCommand({BIELLE_COMMAND, "synthesize", "--range", "0.1:1.1", "--like", "bipetto",
                                           "--joint", "knee_right", "--samples", "200000", "--count", "2", "-o", out});
  INFO(result.out << result.err);
  REQUIRE(result.status == 0);
  const Model model = loadRobot(out + "/leg_1").model;
  const auto coordinate = [&](VectorXd& q, const char* joint) -> double& {
    return q[model.joints()[static_cast<size_t>(model.findJoint(joint))].idx_q];
  };
  VectorXd q = model.makeNeutral();
  coordinate(q, "knee_left") = coordinate(q, "knee_right") = 0.6;  // as it is drawn
  q = closeConfiguration(model, q).q;
  // Motor and knee along the loop, which closes from neighbour to neighbour.
  std::vector<std::pair<double, double>> curve;
  for (int step = 0; step < 200 && coordinate(q, "knee_left") > 0.12; ++step) {
    coordinate(q, "knee_left") -= 0.02;
    const AssemblyResult closed = closeConfiguration(model, q);
    REQUIRE(closed.status == NumericalStatus::Ok);
    q = closed.q;
    curve.emplace_back(coordinate(q, "knee_left"), coordinate(q, "motor_knee_left"));
  }
  int compared = 0;
  for (size_t i = 1; i + 1 < curve.size(); ++i) {
    const double knee = curve[i].first;
    if (knee > 1.05 || knee < 0.2) continue;
    ++compared;
    const double ratio =
        std::abs((curve[i + 1].second - curve[i - 1].second) / (curve[i + 1].first - curve[i - 1].first));
    CHECK(ratio > 1.33);
    CHECK(ratio < 1.55);  // Bipetto's: 1.34 to 1.52
  }
  CHECK(compared > 20);
  CHECK_THAT(readFile(out + "/leg_1/leg_1.yaml"), Contains("--like bipetto"));
  CHECK_THAT(result.out, Contains("leg_2"));

  const CommandResult refused =
      runCommand({BIELLE_COMMAND, "synthesize", "--range", "0:1", "--margin", "1", "-o", out});
  CHECK(refused.status == 1);
  CHECK_THAT(refused.err, Contains("lower --margin"));
  CHECK(runCommand({BIELLE_COMMAND, "synthesize", "-o", out}).status == 2);
  for (const auto& [options, told] : std::vector<std::pair<std::vector<std::string>, std::string>>{
           {{"--range", "0:90"}, "give radians"},
           {{"--range", "0:1", "--crank", "0:0.1"}, "--crank: a length is not positive"},
           {{"--range", "0:1", "--arm", "0.1:0.02"}, "--arm: its bounds are in the wrong order"},
           {{"leg_biped", "--range", "0:1", "--joint", "knee_left", "--parameter", "knee_crank", "--margin", "0.2"},
            "--margin excludes --parameter"}}) {
    const std::string nothing = out + "/nothing";
    std::vector<std::string> command = {BIELLE_COMMAND, "synthesize", "-o", nothing};
    command.insert(command.end(), options.begin(), options.end());
    const CommandResult wrong = runCommand(command);
    CHECK(wrong.status == 2);
    CHECK_THAT(wrong.err, Contains(told));
    CHECK_FALSE(std::filesystem::exists(nothing));
  }
}
