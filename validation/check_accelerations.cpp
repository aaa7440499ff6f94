#include "check_accelerations.h"

#include <cmath>
#include <vector>

#include "math/decompositions.h"

namespace bielle::validation {
namespace {

// The x in [0, 1]^k, k small, that brings A x nearest to b, by trying all combinations of free and bounded entries.
VectorXd fitWithinBounds(const MatrixXd& A, const VectorXd& b) {
  constexpr double kRounding = 1e-9;
  const int k = static_cast<int>(A.cols());
  VectorXd best = VectorXd::Zero(k);
  double least = b.squaredNorm();
  for (int way = 1, ways = static_cast<int>(std::pow(3, k)); way < ways; ++way) {
    VectorXd x = VectorXd::Zero(k);
    std::vector<int> free;
    for (int i = 0, rest = way; i < k; ++i, rest /= 3) {
      if (rest % 3 == 1) x[i] = 1;
      if (rest % 3 == 2) free.push_back(i);
    }
    if (!free.empty()) {
      MatrixXd columns(A.rows(), free.size());
      for (size_t i = 0; i < free.size(); ++i) columns.col(i) = A.col(free[i]);
      const VectorXd y = columns.colPivHouseholderQr().solve(b - A * x);
      if (y.minCoeff() < -kRounding || y.maxCoeff() > 1 + kRounding) continue;
      for (size_t i = 0; i < free.size(); ++i) x[free[i]] = y[i];
    }
    const double distance = (b - A * x).squaredNorm();
    if (distance < least) least = distance, best = x;
  }
  return best;
}

}  // namespace

double calcInertialNorm(const MatrixXd& M, const VectorXd& a) {
  const double square = a.dot(M * a);
  return square < 0 ? 0 : std::sqrt(square);  // rounding; NaN is kept
}

ClosureErrors calcClosureErrors(const SimbodyBridge& simbody, const VectorXd& v) {
  const ClosureRows rows = simbody.calcClosureRows();
  return {rows.residual, rows.J * v};
}

AccelerationTrace traceAccelerations(const SimbodyBridge& simbody, const MatrixXd& M, const ClosureErrors& errors,
                                     const VectorXd& recorded, double h, bool stabilised_loops) {
  AccelerationTrace out;
  out.a = simbody.solveWithArmature(Precision::Double).a;
  const ClosureRows rows = simbody.calcClosureRows();
  if (rows.J.rows() > 0) {
    const int loops = rows.num_loop_rows, feet = static_cast<int>(rows.J.rows()) - loops;
    std::vector<std::pair<int, int>> groups;  // first row, count
    if (stabilised_loops && loops > 0) groups.emplace_back(0, loops);
    if (feet > 0) groups.emplace_back(loops, feet);
    MatrixXd targets = MatrixXd::Zero(rows.J.rows(), 2 * groups.size());
    for (size_t g = 0; g < groups.size(); ++g) {
      const auto [first, count] = groups[g];
      targets.col(2 * g).segment(first, count) = -errors.velocity.segment(first, count) / h;
      targets.col(2 * g + 1).segment(first, count) = errors.residual.segment(first, count) / (h * h);
    }
    const MatrixXd response = simbody.calcResponse(rows.J, targets);
    const Eigen::LLT<MatrixXd> llt(M);
    out.a += response * fitWithinBounds(llt.matrixU() * response, llt.matrixU() * (recorded - out.a));
  }
  out.size = calcInertialNorm(M, out.a);
  out.error = calcInertialNorm(M, recorded - out.a);
  return out;
}

}  // namespace bielle::validation
