#include "identify/estimate.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "identify/least_squares.h"
#include "math/decompositions.h"

namespace bielle {
namespace {

constexpr int kMostRounds = 4;      // of finding out what is seen
constexpr double kRounding = 1e-7;  // of the noise

// d of Eq. (1); 0 of what is known.
VectorXd makeScales(const LogFit& fit, const EstimateOptions& options) {
  VectorXd d(fit.size());
  double size = 0;
  for (const GeometryNumber& number : fit.geometry()) size = std::max(size, std::abs(number.value));
  const auto n = static_cast<Eigen::Index>(fit.geometry().size());
  for (Eigen::Index i = 0; i < n; ++i) {
    const GeometryNumber& number = fit.geometry()[static_cast<size_t>(i)];
    const bool is_place = number.name.find('.') != std::string::npos;
    d[i] = kShareOfLength * (is_place ? std::max(size, 0.1) : number.value);
  }
  for (size_t s = 0; s < fit.sensors().size(); ++s) {
    const bool is_fixed = s < options.fixed.size() && options.fixed[s];
    d[n + static_cast<Eigen::Index>(s)] = is_fixed ? 0 : fit.sensors()[s].is_length ? kLengthOffset : kAngleOffset;
  }
  return d;
}

// Eq. (1).
struct Sight {
  VectorXd s;  // falling
  MatrixXd V;
  double noise = 1;  // sigma
  int seen = 0;      // of the combinations, the first ones
};

// \param noise  sigma; not a number: as assumed
Sight look(const MatrixXd& J, const VectorXd& d, double noise) {
  Sight sight;
  const Eigen::Index n = d.size();
  MatrixXd R = MatrixXd::Zero(n, n);
  const MatrixXd scaled = J * d.asDiagonal();
  if (scaled.rows() >= n) {
    const Eigen::HouseholderQR<MatrixXd> qr(scaled);
    R = qr.matrixQR().topRows(n).triangularView<Eigen::Upper>();
  } else {
    R.topRows(scaled.rows()) = scaled;
  }
  const Eigen::JacobiSVD<MatrixXd> svd(R, Eigen::ComputeFullU | Eigen::ComputeFullV);
  sight.s = svd.singularValues();
  sight.V = svd.matrixV();
  sight.noise = noise;
  while (sight.seen < n && sight.s[sight.seen] > kLeastSeen * sight.s[0] && noise < sight.s[sight.seen]) ++sight.seen;
  return sight;
}

double calcNoise(const LogFit& fit, const VectorXd& r, int seen) {
  const double left = static_cast<double>(fit.numTold() - seen);
  return left > 0 ? std::sqrt(r.squaredNorm() / left) : 1;
}

double calcMisfit(const MatrixXd& left) { return left.norm() / std::sqrt(static_cast<double>(left.size())); }

// The rows of a basis of what is not seen, each with as few unknowns as possible: reduced by elimination.
std::vector<Combination> listUnseen(const Sight& sight, const VectorXd& d, const std::vector<Unknown>& unknowns) {
  MatrixXd rows = sight.V.rightCols(sight.V.cols() - sight.seen).transpose();
  for (Eigen::Index i = 0; i < d.size(); ++i)
    if (d[i] == 0) rows.col(i).setZero();  // known
  std::vector<Combination> out;
  for (Eigen::Index p = 0; p < rows.rows(); ++p) {
    Eigen::Index row = 0, column = 0;
    if (!(rows.bottomRows(rows.rows() - p).cwiseAbs().maxCoeff(&row, &column) > kLeastPart)) {
      rows.conservativeResize(p, Eigen::NoChange);
      break;
    }
    rows.row(p).swap(rows.row(p + row));
    rows.row(p) /= rows(p, column);
    for (Eigen::Index k = 0; k < rows.rows(); ++k)
      if (k != p) rows.row(k) -= rows(k, column) * rows.row(p);
  }
  for (Eigen::Index p = 0; p < rows.rows(); ++p) {
    const VectorXd changes = rows.row(p).transpose().cwiseProduct(d);
    Eigen::Index largest = 0;
    changes.cwiseAbs().maxCoeff(&largest);
    Combination combination;
    for (Eigen::Index i = 0; i < d.size(); ++i)
      if (std::abs(rows(p, i)) > kLeastPart)
        combination.emplace_back(unknowns[static_cast<size_t>(i)].name, changes[i] / changes[largest]);
    out.push_back(std::move(combination));
  }
  return out;
}

}  // namespace

LinkageEstimate estimate(LogFit& fit, const EstimateOptions& options) {
  LinkageEstimate out;
  const VectorXd d = makeScales(fit, options);
  const auto n = static_cast<Eigen::Index>(fit.geometry().size());
  out.x = VectorXd::Zero(fit.size());
  VectorXd r;
  MatrixXd J;
  if (fit.numRows() == 0 || !fit.evaluate(out.x, r, &J)) {
    out.message = "no configuration of the linkage is near the readings";
    return out;
  }
  out.left_before = out.left_after = fit.calcLeft(r);
  out.misfit_before = out.misfit_after = calcMisfit(out.left_before);
  Sight sight = look(J, d, 1);
  for (int round = 0, before = -1; round < kMostRounds && sight.seen != before; ++round) {
    before = sight.seen;
    const MatrixXd along = d.asDiagonal() * sight.V.leftCols(sight.seen);
    LeastSquares problem;
    problem.size = sight.seen;
    problem.residuals = static_cast<int>(r.size());
    problem.iterations = options.iterations;
    problem.enough = 0.5 * kRounding * kRounding * static_cast<double>(r.size());
    problem.evaluate = [&](const VectorXd& c, VectorXd& residuals, MatrixXd* jacobian) {
      MatrixXd all;
      if (!fit.evaluate(along * c, residuals, jacobian ? &all : nullptr)) return false;
      if (jacobian) *jacobian = all * along;
      return true;
    };
    problem.progress = [&](int iteration, double cost) {
      // The noise of all sensors is alike, or the misfit is about this.
      const double share = r.squaredNorm() > 0 ? std::sqrt(2 * cost / r.squaredNorm()) : 0;
      return !options.progress || options.progress(iteration, share * out.misfit_before);
    };
    const VectorXd first = r;
    const LeastSquaresEnd end = minimize(problem);
    out.iterations += end.iterations;
    out.converged = end.converged, out.interrupted = end.interrupted, out.message = end.message;
    out.x = along * end.x;
    if (!fit.evaluate(out.x, r, &J)) {  // a last step that was refused
      out.converged = false;
      break;
    }
    out.left_after = fit.calcLeft(r);
    out.misfit_after = calcMisfit(out.left_after);
    sight = look(J, d, calcNoise(fit, r, sight.seen));
    r = first;
    if (out.interrupted) break;
  }
  out.noise = sight.noise;
  for (Eigen::Index i = 0; i < d.size(); ++i) {
    Unknown unknown;
    const auto k = static_cast<size_t>(i < n ? i : i - n);
    if (i < n) {
      unknown.name = fit.geometry()[k].name, unknown.unit = "m";
      unknown.before = fit.geometry()[k].value;
    } else {
      unknown.name = fit.sensors()[k].name, unknown.unit = fit.sensors()[k].is_length ? "m" : "rad";
      unknown.is_offset = true;
    }
    unknown.after = unknown.before + out.x[i];
    const Eigen::Index unseen = d.size() - sight.seen;
    const double part = sight.V.row(i).tail(unseen).squaredNorm();
    unknown.is_seen = part <= kLeastPart * kLeastPart;
    double variance = part;
    for (int j = 0; j < sight.seen; ++j) variance += std::pow(sight.noise * sight.V(i, j) / sight.s[j], 2);
    unknown.deviation = unknown.is_seen ? d[i] * std::sqrt(variance) : std::numeric_limits<double>::infinity();
    if (d[i] == 0) unknown.is_seen = true, unknown.deviation = 0;
    out.unknowns.push_back(std::move(unknown));
  }
  out.unseen = listUnseen(sight, d, out.unknowns);
  return out;
}

}  // namespace bielle
