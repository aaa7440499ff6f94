// Linkages that move only because their axes lie as they do: rounded, they are read as what was rounded. The ideal linkages
// themselves are the oracle.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/closure.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/robots/robot_loader.h"
#include "dynamics/rounded_linkages.h"
#include "loop_jacobian.h"
#include "math/decompositions.h"
#include "math/so3.h"
#include "published_robots.h"
#include "rounded_families.h"
#include "selection.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

// The posture next to q with the first joint at an angle, to 1e-11.
AssemblyResult turnTo(const Model& model, const VectorXd& q, double angle) {
  AssemblyProblem problem;
  problem.q_ref = q;
  problem.q_ref[0] = angle;
  problem.weights = VectorXd::Constant(model.nv(), 1e-6);
  problem.weights[0] = 1;
  return assemble(model, problem);
}

// Singular values, and the way that the linkage goes per way of its first joint.
struct Motion {
  VectorXd sigma, ratio;
};
Motion calcMotion(const Model& model, const VectorXd& q) {
  const Eigen::JacobiSVD<MatrixXd> svd(calcLoopJacobian(model, q), Eigen::ComputeFullU | Eigen::ComputeFullV);
  const VectorXd way = svd.matrixV().rightCols(1);
  return {svd.singularValues(), way / way[0]};
}

RoundingTolerance halfUnit(int decimals) {
  const double half = 0.5 * std::pow(10, -decimals);
  return {half, half, {}};
}

// Whether nothing of it is changed, to the last bit.
bool isUntouched(const Model& model, const RoundingTolerance& tolerance) {
  return findRoundedLinkages(model, tolerance).model.isCopyOf(model);
}

// A leg of Klann's kind with a crank of 27 mm in a plane that lies askew, its pivots moved in it (7 x 2), frames turned
// about their axes (7).
HingeNet makeKlann(const MatrixXd& moves, const VectorXd& turns) {
  const double pivots[7][2] = {{0, 0},
                               {0.020497770619224292, 0.01726503401797012},
                               {-0.0599, -0.0389},
                               {-0.045051414609165036, 0.002922289653856637},
                               {-0.10501553223335772, 0.0049970420612501232},
                               {-0.0599, 0.0599},
                               {-0.11745276338773984, 0.070384723479178291}};
  const int bodies[7][2] = {{0, 1}, {1, 2}, {0, 3}, {3, 2}, {2, 4}, {0, 5}, {5, 4}};
  const SE3 askew(exp3(Vector3d(0.4, -0.7, 1.1)), Vector3d(0.1, -0.2, 0.3));
  HingeNet net;
  net.bodies = 6;
  for (Eigen::Index i = 0; i < 7; ++i) {
    const Vector3d place(pivots[i][0] + moves(i, 0), pivots[i][1] + moves(i, 1), 0);
    net.hinges.push_back({bodies[i][0], bodies[i][1], askew * SE3(exp3(Vector3d(0, 0, turns[i])), place)});
  }
  return net;
}

// Away from dead points angles and ratios are those of the ideal linkage to some units of the last decimal: links are 5 cm to 1 m long, so
// that half a unit on each pivot is up to 40 units of an angle where the linkage does not multiply it. Moving the pivots of ideal
// linkages in their planes by half a unit does as much.
void checkFamily(Family family, int count, int first_decimals, int last_decimals, ClosureKind kind) {
  constexpr double kAngles = 250, kRatios = 200;  // units; of nine ratios in ten
  constexpr double kExact = 1e-11;
  int postures = 0, far = 0;
  std::mt19937 rng(11 + static_cast<int>(family));
  for (int i = 0; i < count; ++i) {
    const HingeNet net = makeHingeNet(family, rng);
    const Model ideal = makeModel(net, {}, kind);
    const int decimals = first_decimals + i % (last_decimals - first_decimals + 1);
    const double unit = std::pow(10, -decimals);
    const Model rounded = makeModel(net, decimals, kind);
    const RoundedLinkages read = findRoundedLinkages(rounded, halfUnit(decimals));
    CAPTURE(getName(family), i, decimals);
    // With twelve decimals some move as they are written, to 1e-13.
    REQUIRE(read.mended.size() == (decimals < 12 ? 1 : read.mended.size()));
    for (const RoundedLinkage& mended : read.mended) {
      CHECK(mended.meant == 1);
      CHECK(mended.angle <= 4 * std::max(unit / 2, kLeastRounding));
      const bool is_other = family == Family::Bennett || family == Family::Bricard;
      CHECK(mended.shape == (is_other                      ? LinkageShape::Other
                             : family == Family::Spherical ? LinkageShape::Spherical
                                                           : LinkageShape::Plane));
    }
    const int rank = ideal.nv() - 1;
    const double regular = calcMotion(ideal, ideal.makeNeutral()).sigma[rank - 1];
    double apart = 0;  // ratios
    for (double way : {1.0, -1.0}) {
      VectorXd q = ideal.makeNeutral(), q_read = q;
      for (int step = 1; step <= 20; ++step) {
        const AssemblyResult at = turnTo(ideal, q, 0.1 * way * step),
                             at_read = turnTo(read.model, q_read, 0.1 * way * step);
        if (at.status != NumericalStatus::Ok || std::abs(at.q[0] - 0.1 * way * step) > 1e-9) break;
        const Motion motion = calcMotion(ideal, at.q);
        if (motion.sigma[rank - 1] < 0.3 * regular || motion.ratio.cwiseAbs().maxCoeff() > 5)
          break;  // near a dead point
        REQUIRE(at_read.status == NumericalStatus::Ok);
        q = at.q, q_read = at_read.q;
        const Motion motion_read = calcMotion(read.model, q_read);
        CHECK(motion_read.sigma[rank] < 1e-11);
        CHECK((q - q_read).cwiseAbs().maxCoeff() < kAngles * std::max(unit, kExact));
        apart = std::max(apart, (motion.ratio - motion_read.ratio).cwiseAbs().maxCoeff());
        ++postures;
      }
    }
    far += apart > kRatios * std::max(unit, kExact);
  }
  CAPTURE(getName(family));
  CHECK(far <= std::max(1, count / 10));
  CHECK(postures > 5 * count);
}

}  // namespace

TEST_CASE("rounded linkages have the mobility of the ideal ones, their angles and ratios") {
  for (Family family : kFamilies) checkFamily(family, 6, 4, 9, ClosureKind::Hinge5D);
  for (Family family : {Family::PlaneFourBar, Family::SixBar, Family::Parallelogram, Family::PlaneInSpace})
    checkFamily(family, 3, 5, 7, ClosureKind::Ball3D);
}

TEST_CASE("many rounded linkages of each family", "[long]") {
  for (Family family : kFamilies) checkFamily(family, 200, 5, 12, ClosureKind::Hinge5D);
}

TEST_CASE("what closes in the postures that a linkage was mended by closes in all others, too") {
  // Bricard's of threefold symmetry: with twelve postures within 1.2 rad, others opened by 1e-12 and more.
  checkFamily(Family::Bricard, 15, 5, 9, ClosureKind::Hinge5D);
}

TEST_CASE("what half a unit on the pivots of a linkage amounts to, mending cannot know") {
  constexpr double kUnit = 1e-5;
  constexpr int kTrials = 101;
  std::mt19937 rng(2);
  const auto draw = [&rng](Eigen::Index rows, Eigen::Index cols, double size) {
    std::uniform_real_distribution<double> uniform(-size, size);
    return MatrixXd(MatrixXd::NullaryExpr(rows, cols, [&](Eigen::Index) { return uniform(rng); }));
  };
  const auto calcRatio = [](const Model& model, const VectorXd& q) { return 1 / calcMotion(model, q).ratio[2]; };
  const auto calcMoved = [&](const MatrixXd& moves) {
    const Model model = makeModel(makeKlann(moves, VectorXd::Zero(7)), {});
    return calcRatio(model, model.makeNeutral());
  };
  const MatrixXd still = MatrixXd::Zero(7, 2);
  const double ratio = calcMoved(still);
  double most = 0;  // by which half a unit on every coordinate can move it
  for (Eigen::Index i = 0; i < still.size(); ++i) {
    MatrixXd moves = still;
    moves.reshaped()[i] = kUnit / 2;
    most += std::abs(calcMoved(moves) - ratio) / kUnit;
  }
  std::vector<double> moved, mended;
  for (int i = 0; i < kTrials; ++i) {
    moved.push_back(std::abs(calcMoved(draw(7, 2, kUnit / 2)) - ratio) / kUnit);
    const RoundedLinkages read = findRoundedLinkages(makeModel(makeKlann(still, draw(7, 1, 3)), 5), halfUnit(5));
    REQUIRE(read.mended.size() == 1);
    const AssemblyResult closed = turnTo(read.model, read.model.makeNeutral(), 0);
    REQUIRE(closed.status == NumericalStatus::Ok);
    mended.push_back(std::abs(calcRatio(read.model, closed.q) - ratio) / kUnit);
  }
  std::sort(moved.begin(), moved.end());
  std::sort(mended.begin(), mended.end());
  CAPTURE(ratio, most, moved[kTrials / 2], moved.back(), mended[kTrials / 2], mended.back());
  CHECK(moved[kTrials / 2] > 50);
  CHECK(mended[kTrials / 2] < 1.5 * moved[kTrials / 2]);
  CHECK(mended.back() < most);
  CHECK(most == Approx(315).epsilon(0.01));
}

TEST_CASE("what was rounded moves, written as it is, hardly or not at all") {
  // Else nothing above would have been to mend.
  for (Family family : kFamilies) {
    std::mt19937 rng(11);
    const Model rounded = makeModel(makeHingeNet(family, rng), 6);
    const VectorXd neutral = rounded.makeNeutral();
    const AssemblyResult turned = turnTo(rounded, neutral, 0.2);
    CHECK((turned.status != NumericalStatus::Ok || std::abs(turned.q[0] - 0.2) > 0.1));
  }
}

TEST_CASE("linkages that are ideal to the last bit, or to be taken as they are, stay as they are") {
  for (Family family : kFamilies) {
    std::mt19937 rng(3);
    for (int i = 0; i < 5; ++i) {
      const HingeNet net = makeHingeNet(family, rng);
      for (int decimals : {3, 6, 17}) CHECK(isUntouched(makeModel(net, {}), halfUnit(decimals)));
      CHECK(isUntouched(makeModel(net, 6), {0, 0}));
    }
  }
}

TEST_CASE("loops in general position stay as they are, however near to special ones they are written") {
  for (Family family : kFamilies) {
    std::mt19937 rng(5);
    for (double off : {1e-2, 1e-3, 1e-4, 1e-5}) {
      HingeNet net = makeHingeNet(family, rng);
      std::uniform_real_distribution<double> uniform(-off, off);
      for (HingeNet::Hinge& hinge : net.hinges)
        hinge.X_W = hinge.X_W * exp6(Vector6d(Vector6d::NullaryExpr([&](Eigen::Index) { return uniform(rng); })));
      CAPTURE(getName(family), off);
      CHECK(isUntouched(makeModel(net, {}), halfUnit(17)));
      if (off > 5e-5) CHECK(isUntouched(makeModel(net, 7), halfUnit(7)));
    }
  }
}

TEST_CASE("a linkage that is locked by more than rounding is told, with its axes") {
  std::mt19937 rng(8);
  HingeNet net = makeHingeNet(Family::PlaneFourBar, rng);
  net.hinges[2].X_W = net.hinges[2].X_W * SE3(exp3(Vector3d(8e-4, 0, 0)), Vector3d::Zero());
  const RoundedLinkages read = findRoundedLinkages(makeModel(net, 5, ClosureKind::Ball3D), halfUnit(5));
  CHECK(read.mended.empty());
  REQUIRE(read.locked.size() == 1);
  CHECK(read.locked[0].written == 0);
  CHECK(read.locked[0].meant == 1);
  CHECK(read.locked[0].apart == Approx(8e-4).epsilon(0.05));
  CHECK(read.locked[0].axes[1] == "joint 'hinge3'");
}

TEST_CASE("our robots, and published ones, are read as they are written") {
  const bool has_published = !findPublishedDirectory("battobot_6d").empty();
  int count = 0;
  for (const std::string& name : listRobots()) {
    if (!has_published && (name == "battobot" || name == "digit")) continue;  // which complete published ones
    CAPTURE(name);
    const LoadedRobot robot = loadRobot(name);
    ++count;
    for (const std::string& warning : robot.warnings) {
      CHECK(warning.find("rounded") == std::string::npos);
      CHECK(warning.find("is less than") == std::string::npos);
    }
    CHECK(isUntouched(robot.model, halfUnit(17)));
  }
  CHECK(count > 15);
}
