// Oracle: four forces at the corners of the sole. A wrench is inside where non-negative least squares over the edges of
// their friction pyramids reach it.
#include <Eigen/QR>
#include <catch2/catch.hpp>
#include <random>

#include "bielle/dynamics/kinematics.h"
#include "bielle/motion/motion.h"
#include "bielle/ocp/cost.h"
#include "bielle/robots/robot_loader.h"
#include "wrench_cone.h"

using namespace bielle;
using namespace bielle::validation;

namespace {

struct Sole {
  double X, Y, mu;
};
const Sole kSoles[] = {{0.05, 0.05, 0.7}, {0.1, 0.04, 0.3}, {0.03, 0.12, 1.0}};

using Rays = Eigen::Matrix<double, 6, 16>;

Vector6d calcCornerWrench(const Sole& sole, int corner, const Vector3d& force) {
  const Vector3d place(corner & 1 ? sole.X : -sole.X, corner & 2 ? sole.Y : -sole.Y, 0);
  Vector6d wrench;
  wrench << force, place.cross(force);
  return wrench;
}

Rays makeRays(const Sole& sole) {
  Rays rays;
  for (int i = 0; i < 16; ++i)
    rays.col(i) = calcCornerWrench(sole, i / 4, Vector3d(i & 1 ? sole.mu : -sole.mu, i & 2 ? sole.mu : -sole.mu, 1));
  return rays;
}

// Least |A x - b| over x >= 0, by the active sets of Lawson and Hanson (Solving Least Squares Problems, chapter 23).
double calcDistance(const Eigen::MatrixXd& A, const Eigen::VectorXd& b) {
  const int n = static_cast<int>(A.cols());
  Eigen::VectorXd x = Eigen::VectorXd::Zero(n);
  std::vector<int> active;
  for (int iteration = 0; iteration < 500; ++iteration) {
    Eigen::VectorXd slope = A.transpose() * (b - A * x);
    for (int i : active) slope[i] = -1;
    int best;
    if (slope.maxCoeff(&best) < 1e-12) break;
    active.push_back(best);
    while (true) {
      Eigen::MatrixXd columns(A.rows(), active.size());
      for (size_t i = 0; i < active.size(); ++i) columns.col(i) = A.col(active[i]);
      const Eigen::VectorXd z = columns.colPivHouseholderQr().solve(b);
      double step = 1;
      for (size_t i = 0; i < active.size(); ++i)
        if (z[i] <= 0) step = std::min(step, x[active[i]] / (x[active[i]] - z[i]));
      for (size_t i = 0; i < active.size(); ++i) x[active[i]] += step * (z[i] - x[active[i]]);
      if (step == 1) break;
      std::vector<int> left;
      for (int i : active) {
        if (x[i] > 1e-14)
          left.push_back(i);
        else
          x[i] = 0;
      }
      active = left;
    }
  }
  return (A * x - b).norm();
}

double calcDistance(const Sole& sole, const Vector6d& wrench) {
  Vector6d scale;
  scale << 1, 1, 1, Vector3d::Constant(1 / (sole.X + sole.Y));  // moments as forces at the corners
  return calcDistance(scale.asDiagonal() * makeRays(sole), scale.cwiseProduct(wrench));
}

double calcMargin(const Sole& sole, const Vector6d& wrench) {
  return calcConeMargin(wrench, sole.X, sole.Y, sole.mu, 1e-9).value;
}

class Random {
 public:
  double draw(double scale) { return scale * uniform_(generator_); }
  // Somewhat more of each number than the sole can bear.
  Vector6d drawWrench(const Sole& s) {
    Vector6d wrench;
    wrench << draw(1.1 * s.mu), draw(1.1 * s.mu), 1, draw(1.1 * s.Y), draw(1.1 * s.X), draw(0.8 * s.mu * (s.X + s.Y));
    return wrench;
  }

 private:
  std::mt19937 generator_{7};
  std::uniform_real_distribution<double> uniform_{-1, 1};
};

}  // namespace

TEST_CASE("wrench cone: the closed form tells inside from outside as corner forces do") {
  Random random;
  for (const Sole& sole : kSoles) {
    int inside = 0, outside = 0;
    for (int i = 0; i < 4000; ++i) {
      const Vector6d wrench = random.drawWrench(sole);
      const double margin = calcMargin(sole, wrench), distance = calcDistance(sole, wrench);
      INFO(wrench.transpose() << ", margin " << margin << ", distance " << distance);
      if (std::abs(margin) < 1e-6) continue;
      REQUIRE((margin > 0) == (distance < 1e-9));
      ++(margin > 0 ? inside : outside);
    }
    CHECK(inside > 200);
    CHECK(outside > 200);
  }
}

TEST_CASE("wrench cone: the margin of the torque is the distance to the edge") {
  Random random;
  int edges = 0;
  for (const Sole& sole : kSoles)
    for (int i = 0; i < 1000; ++i) {
      Vector6d wrench = random.drawWrench(sole);
      const ConeMargin margin = calcConeMargin(wrench, sole.X, sole.Y, sole.mu, 1e-9);
      if (margin.value < 0 || margin.limit != std::string("torque")) continue;
      // One of the two edges is that far away: there the margin is zero, and corner forces reach it just so.
      const double edge = calcMargin(sole, wrench + margin.value * Vector6d::Unit(5)) < 1e-12 ? 1 : -1;
      const auto move = [&](double distance) -> Vector6d { return wrench + edge * distance * Vector6d::Unit(5); };
      CHECK(calcDistance(sole, move(margin.value - 1e-7)) < 1e-9);
      CHECK(calcDistance(sole, move(margin.value + 1e-5)) > 1e-7);
      ++edges;
    }
  CHECK(edges > 100);
}

TEST_CASE("wrench cone: sums of corner forces are inside, those in round cones too; sizes of forces do not matter") {
  Random random;
  for (const Sole& sole : kSoles)
    for (int i = 0; i < 2000; ++i) {
      Vector6d pyramids = Vector6d::Zero(), cones = Vector6d::Zero();
      for (int corner = 0; corner < 4; ++corner) {
        const double load = 1 + random.draw(1), angle = random.draw(M_PI), sideways = sole.mu * load;
        pyramids +=
            calcCornerWrench(sole, corner, {random.draw(1) > 0 ? sideways : -sideways, random.draw(sideways), load});
        cones += calcCornerWrench(sole, corner, {sideways * std::cos(angle), sideways * std::sin(angle), load});
      }
      CHECK(calcMargin(sole, pyramids) > -1e-14);
      CHECK(calcMargin(sole, cones) > -1e-14);
      CHECK(calcMargin(sole, 300 * cones) == Approx(calcMargin(sole, cones)).margin(1e-14));
    }
}

// The check and the solver have the cone from sources of their own.
TEST_CASE("wrench cone: the rows that the solver keeps positive are the same cone") {
  Random random;
  const Model model = loadRobot(std::string(BIELLE_SOURCE_DIR) + "/robots/bipetto").model;
  const VectorXd q = makeStandingPosture(model), u = VectorXd::Zero(model.nu());
  const ConstraintSet set = makeConstraintSet(model, makeContactTargets(model, q, {1}, 0, 0));
  const int contact = set.num_loops;
  const Workspace ws(model);
  VectorXd lambda = VectorXd::Zero(set.rows);
  int inside = 0, outside = 0;
  for (const Sole& sole : kSoles) {
    const auto cone = makeWrenchCone(set, contact, sole.X, sole.Y, sole.mu);
    REQUIRE(cone->size() == 17);
    VectorXd rows(17);
    for (int i = 0; i < 4000; ++i) {
      const Vector6d wrench = random.drawWrench(sole);
      lambda.segment<6>(set.offsets[contact]) = wrench;
      cone->calc({model, ws, set, u, lambda}, rows);
      if (wrench[2] < 1e-3) {
        CHECK(rows[0] == Approx(wrench[2]));
        continue;
      }
      rows /= wrench[2];
      rows.segment<4>(1) *= sole.X + sole.Y;
      const double margin = calcMargin(sole, wrench);
      CHECK(rows.tail<16>().minCoeff() == Approx(margin).margin(1e-12));
      ++(margin > 0 ? inside : outside);
    }
  }
  CHECK(inside > 600);
  CHECK(outside > 600);
}

TEST_CASE("wrench cone: what is nearest, light feet, soles without size, numbers that are none") {
  const auto calc = [](double fx, double fz, double ny, double nz, double X = 0.05) {
    Vector6d wrench;
    wrench << fx, 0, fz, 0, ny, nz;
    return calcConeMargin(wrench, X, X, 0.7, 2.0);
  };
  const auto check = [](const ConeMargin& margin, double value, const std::string& limit) {
    CHECK(margin.value == Approx(value).margin(1e-12));
    CHECK(margin.limit == limit);
  };
  check(calc(0, 100, 0, 0), 0.05, "pressure");  // in the middle
  check(calc(0, 100, 0, 6), 0.01, "torque");    // 0.07 of the load
  check(calc(0, 100, 0, 8), -0.01, "torque");
  check(calc(0, 100, 5, 0), 0, "pressure");  // at the edge
  check(calc(0, 100, 6, 0), -0.01, "pressure");
  check(calc(75, 100, 0, 0), -0.0025 - 0.0025, "friction");
  check(calc(0, 0, 0, 0), 0.05, "pressure");  // in the air: counts as 2 N
  check(calc(0, -1, 0, 0), -0.05, "pull");
  check(calc(0, 100, 0, 0, 0), 0, "torque");  // a sole without size
  check(calc(0, 100, 0, 1e-3, 0), -1e-5, "torque");
  for (int i = 0; i < 6; ++i) {
    Vector6d wrench = 100 * Vector6d::Unit(2);
    wrench[i] = std::nan("");
    CHECK(std::isnan(calcConeMargin(wrench, 0.05, 0.05, 0.7, 2.0).value));
  }
}
