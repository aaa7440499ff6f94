#include "identify/estimate.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "bielle/model/wear.h"
#include "identify/least_squares.h"
#include "math/decompositions.h"

namespace bielle {
namespace {

constexpr int kMostRounds = 4;      // of finding out what is seen
constexpr double kRounding = 1e-7;  // of the noise

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

double calcNoise(long told, const VectorXd& r, int seen) {
  const double left = static_cast<double>(told - seen);
  return left > 0 ? std::sqrt(r.squaredNorm() / left) : 1;
}

// Eq. (4), of all unknowns: by scale, squared.
VectorXd calcStretchVariances(const Sight& sight, const MatrixXd& J, const VectorXd& d, const VectorXd& r) {
  VectorXd sum = VectorXd::Zero(d.size());
  const MatrixXd V = sight.V.leftCols(sight.seen);
  const VectorXd inverse = sight.s.head(sight.seen).cwiseAbs2().cwiseInverse();
  const Eigen::Index count = std::min<Eigen::Index>(kStretches, r.size());
  for (Eigen::Index b = 0; b < count; ++b) {
    const Eigen::Index first = b * r.size() / count, size = (b + 1) * r.size() / count - first;
    const VectorXd g = d.cwiseProduct(J.middleRows(first, size).transpose() * r.segment(first, size));
    sum += VectorXd(V * inverse.cwiseProduct(V.transpose() * g)).cwiseAbs2();
  }
  return sum;
}

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

EstimateProblem makeProblem(LogFit& fit, const std::vector<bool>& fixed) {
  EstimateProblem problem;
  double size = 0;
  for (const GeometryNumber& number : fit.geometry()) size = std::max(size, std::abs(number.value));
  std::vector<double> scales;
  for (const GeometryNumber& number : fit.geometry()) {
    const bool is_place = number.name.find('.') != std::string::npos;
    problem.unknowns.push_back({number.name, "length", "m", number.value});
    scales.push_back(kShareOfLength * (is_place ? std::max(size, 0.1) : number.value));
  }
  for (size_t s = 0; s < fit.sensors().size(); ++s) {
    const LinkageSensor& sensor = fit.sensors()[s];
    problem.unknowns.push_back({sensor.name, "offset", sensor.is_length ? "m" : "rad"});
    scales.push_back(s < fixed.size() && fixed[s] ? 0 : sensor.is_length ? kLengthOffset : kAngleOffset);
  }
  for (const LinkagePlay& play : fit.plays()) {
    const bool is_length = play.sensor < 0 || fit.sensors()[static_cast<size_t>(play.sensor)].is_length;
    problem.unknowns.push_back({getPlayName(play.name), "play", is_length ? "m" : "rad", play.size});
    scales.push_back(is_length ? kLengthOffset : kAngleOffset);
  }
  problem.scales = VectorXd::Map(scales.data(), static_cast<Eigen::Index>(scales.size()));
  problem.evaluate = [&fit](const VectorXd& x, VectorXd& r, MatrixXd* J) {
    return fit.numRows() > 0 && fit.evaluate(x, r, J);
  };
  problem.countTold = [&fit] { return fit.numTold(); };
  problem.calcMisfit = [&fit](const VectorXd& r) {
    const MatrixXd left = fit.calcLeft(r);
    return left.norm() / std::sqrt(static_cast<double>(left.size()));
  };
  return problem;
}

EstimateProblem makeProblem(const TorqueFit& fit) {
  EstimateProblem problem;
  const auto n = static_cast<Eigen::Index>(fit.numbers().size());
  problem.scales.resize(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const LoadNumber& number = fit.numbers()[static_cast<size_t>(i)];
    problem.unknowns.push_back({number.name, getName(number.kind), number.unit, number.value});
    problem.scales[i] = fit.scales()[i];
  }
  problem.evaluate = [&fit](const VectorXd& x, VectorXd& r, MatrixXd* J) {
    fit.evaluate(x, r, J);
    return true;
  };
  problem.countTold = [&fit] { return fit.numRows(); };
  problem.calcMisfit = [&fit](const VectorXd& r) { return fit.calcShare(r); };
  return problem;
}

Estimate estimate(const EstimateProblem& problem, const EstimateOptions& options) {
  Estimate out;
  const VectorXd& d = problem.scales;
  out.x = VectorXd::Zero(d.size());
  VectorXd r;
  MatrixXd J;
  if (!problem.evaluate(out.x, r, &J)) {
    out.message = "there is nothing to compare with at the start";
    return out;
  }
  out.r_before = out.r_after = r;
  out.misfit_before = out.misfit_after = problem.calcMisfit(r);
  Sight sight = look(J, d, 1);
  for (int round = 0, before = -1; round < kMostRounds && sight.seen != before; ++round) {
    before = sight.seen;
    const MatrixXd along = d.asDiagonal() * sight.V.leftCols(sight.seen);
    LeastSquares search;
    search.size = sight.seen;
    search.residuals = static_cast<int>(r.size());
    search.iterations = options.iterations;
    search.enough = 0.5 * kRounding * kRounding * static_cast<double>(r.size());
    search.evaluate = [&](const VectorXd& c, VectorXd& residuals, MatrixXd* jacobian) {
      MatrixXd all;
      if (!problem.evaluate(along * c, residuals, jacobian ? &all : nullptr)) return false;
      if (jacobian) *jacobian = all * along;
      return true;
    };
    search.progress = [&](int iteration, double cost) {
      // The noise of all residuals is alike, or the misfit is about this.
      const double size = out.r_before.norm();
      const double share = size > 0 ? std::sqrt(2 * cost) / size : 0;
      return !options.progress || options.progress(iteration, share * out.misfit_before);
    };
    const LeastSquaresEnd end = minimize(search);
    out.iterations += end.iterations;
    out.converged = end.converged, out.interrupted = end.interrupted, out.message = end.message;
    out.x = along * end.x;
    if (!problem.evaluate(out.x, r, &J)) {  // a last step that was refused
      out.converged = false;
      break;
    }
    out.r_after = r;
    out.misfit_after = problem.calcMisfit(r);
    sight = look(J, d, calcNoise(problem.countTold(), r, sight.seen));
    if (out.interrupted) break;
  }
  out.noise = sight.noise;
  out.unknowns = problem.unknowns;
  const VectorXd stretches = calcStretchVariances(sight, J, d, r);
  for (Eigen::Index i = 0; i < d.size(); ++i) {
    Unknown& unknown = out.unknowns[static_cast<size_t>(i)];
    unknown.after = unknown.before + out.x[i];
    const Eigen::Index unseen = d.size() - sight.seen;
    const double part = sight.V.row(i).tail(unseen).squaredNorm();
    unknown.is_seen = part <= kLeastPart * kLeastPart;
    double variance = 0;
    for (int j = 0; j < sight.seen; ++j) variance += std::pow(sight.noise * sight.V(i, j) / sight.s[j], 2);
    variance = std::max(variance, stretches[i]) + part;
    unknown.deviation = unknown.is_seen ? d[i] * std::sqrt(variance) : std::numeric_limits<double>::infinity();
    if (d[i] == 0) unknown.is_seen = true, unknown.deviation = 0;
  }
  out.unseen = listUnseen(sight, d, out.unknowns);
  return out;
}

}  // namespace bielle
