// How near linkages that are read from rounded numbers are to those that were rounded, over their whole travel: the table of
// docs/results/rounding.py, which asks for more of them than a test does.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <vector>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/closure.h"
#include "bielle/dynamics/kinematics.h"
#include "dynamics/rounded_linkages.h"
#include "loop_jacobian.h"
#include "math/decompositions.h"
#include "rounded_families.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

constexpr double kStep = 0.02;      // rad
constexpr int kSteps = 314;         // a turn, either way
constexpr int kCompared = 5;        // steps from one posture that is compared to the next
constexpr double kNear = 0.1;       // rad of dead points
constexpr double kSingular = 0.03;  // share of the smallest singular value at the start

// The posture next to q with the first joint at an angle; false where there is none.
bool goTo(const Model& model, double angle, VectorXd& q) {
  AssemblyProblem problem;
  problem.q_ref = q;
  problem.q_ref[0] = angle;
  problem.weights = VectorXd::Constant(model.nv(), 1e-6);
  problem.weights[0] = 1;
  const AssemblyResult at = assemble(model, problem);
  if (at.status != NumericalStatus::Ok || std::abs(at.q[0] - angle) > 1e-9) return false;
  if (model.difference(q, at.q).cwiseAbs().maxCoeff() > 0.5) return false;  // another branch
  q = at.q;
  return true;
}

// The smallest singular value but one of the loops, and the way that the linkage goes per way of its first joint.
struct Going {
  double sigma = 0;
  VectorXd ratio;
};
Going calcGoing(const Model& model, const VectorXd& q) {
  const Eigen::JacobiSVD<MatrixXd> svd(calcLoopJacobian(model, q), Eigen::ComputeFullU | Eigen::ComputeFullV);
  const VectorXd way = svd.matrixV().rightCols(1);
  return {svd.singularValues()[model.nv() - 2], way / way[0]};
}

// Largest differences from the exact linkage away from its dead points.
struct Difference {
  double angle = 0, ratio = 0;
  bool is_lost = false;  // where the exact one goes on
};

Difference compare(const Model& ideal, const Model& other) {
  Difference out;
  const double regular = calcGoing(ideal, ideal.makeNeutral()).sigma;
  for (const double way : {kStep, -kStep}) {
    VectorXd q = ideal.makeNeutral(), q_other = q;
    struct Posture {
      double at, angle, ratio;
    };
    std::vector<Posture> postures;
    std::vector<double> dead;
    for (int step = 1; step <= kSteps; ++step) {
      const double x = way * step;
      if (!goTo(ideal, x, q)) {
        dead.push_back(x);
        break;
      }
      const Going going = calcGoing(ideal, q);
      if (going.sigma < kSingular * regular) {  // a dead point, or where the linkage folds
        dead.push_back(x);
        break;
      }
      if (!goTo(other, x, q_other)) {
        postures.push_back({x, HUGE_VAL, HUGE_VAL});
        break;
      }
      if (step % kCompared == 0)
        postures.push_back({x, ideal.difference(q, q_other).cwiseAbs().maxCoeff(),
                            (going.ratio - calcGoing(other, q_other).ratio).cwiseAbs().maxCoeff()});
    }
    for (const Posture& posture : postures) {
      if (std::any_of(dead.begin(), dead.end(), [&](double x) { return std::abs(posture.at - x) < kNear; })) continue;
      out.is_lost |= std::isinf(posture.angle);
      if (std::isinf(posture.angle)) continue;
      out.angle = std::max(out.angle, posture.angle);
      out.ratio = std::max(out.ratio, posture.ratio);
    }
  }
  return out;
}

// The exact linkage with its pivots moved in their planes by up to half a unit: a file tells no more than that.
Model movePivots(HingeNet net, double half, std::mt19937& rng) {
  std::uniform_real_distribution<double> uniform(-half, half);
  for (HingeNet::Hinge& hinge : net.hinges) hinge.X_W.p += hinge.X_W.R * Vector3d(uniform(rng), uniform(rng), 0);
  return makeModel(net, {});
}

double take(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  return values[std::min(values.size() - 1, static_cast<size_t>(share * static_cast<double>(values.size())))];
}

// Of one family and number of decimals, in units of the last one.
struct Row {
  int count = 0, meant = 0, lost = 0;
  std::vector<double> angles, ratios, moved;
};

}  // namespace

TEST_CASE("linkages of three to nine decimals beside the exact ones") {
  constexpr int kFirst = 3, kLast = 9, kSure = 5;
  const char* asked = std::getenv("BIELLE_ROUNDED");
  const int count = asked ? std::atoi(asked) : 2 * (kLast - kFirst + 1);
  for (const Family family : kFamilies) {
    std::mt19937 rng(777 + static_cast<int>(family));
    std::map<int, Row> rows;
    const bool is_plane = family != Family::Spherical && family != Family::Bennett;
    for (int i = 0; i < count; ++i) {
      const HingeNet net = makeHingeNet(family, rng);
      const int decimals = kFirst + i % (kLast - kFirst + 1);
      const double unit = std::pow(10, -decimals);
      const RoundedLinkages read = findRoundedLinkages(makeModel(net, decimals), {unit / 2, unit / 2, false, {}});
      CAPTURE(getName(family), i, decimals);
      Row& row = rows[decimals];
      ++row.count;
      if (read.mended.size() != 1 || read.mended[0].meant != 1) {
        CHECK(decimals < kSure);
        continue;
      }
      ++row.meant;
      const Model ideal = makeModel(net, {});
      const Difference mended = compare(ideal, read.model);
      row.lost += mended.is_lost;
      row.angles.push_back(mended.angle / unit), row.ratios.push_back(mended.ratio / unit);
      if (is_plane) row.moved.push_back(compare(ideal, movePivots(net, unit / 2, rng)).ratio / unit);
    }
    for (const auto& [decimals, row] : rows) {
      if (asked)
        std::printf("%s,%d,%d,%d,%d,%.1f,%.1f,%.1f,%.1f,%.1f,%.1f\n", getName(family), decimals, row.count, row.meant,
                    row.lost, take(row.angles, 0.5), take(row.angles, 0.9), take(row.ratios, 0.5),
                    take(row.ratios, 0.9), take(row.moved, 0.5), take(row.moved, 0.9));
      CHECK(row.count > 0);
      if (decimals < kSure) continue;
      CHECK(row.lost <= row.count / 100);
      CHECK(take(row.angles, 0.5) < (row.count < 20 ? 250 : 50));  // of two, it is the larger one
    }
  }
}
