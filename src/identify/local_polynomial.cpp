#include "identify/local_polynomial.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace bielle {
namespace {

constexpr double kRounding = 1e-6;  // of a window: samples at its very ends belong to it

// Samples within half a window of an instant.
struct Range {
  Eigen::Index first = 0, count = 0;
};
Range findRange(const VectorXd& time, double centre, double window) {
  const double half = (0.5 + kRounding) * window;
  const double* const first = std::lower_bound(time.data(), time.data() + time.size(), centre - half);
  const double* const last = std::upper_bound(first, time.data() + time.size(), centre + half);
  return {first - time.data(), last - first};
}

}  // namespace

std::vector<double> listCentres(const VectorXd& time, double& window) {
  std::vector<double> centres, steps;
  for (Eigen::Index k = 1; k < time.size(); ++k) steps.push_back(time[k] - time[k - 1]);
  if (steps.empty()) return centres;
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  window = std::max(window, kLeastSamples * *middle);
  const double span = time[time.size() - 1] - time[0];
  const double count = std::floor((span / window - 1) * 2 + kRounding);
  for (int i = 0; i <= count; ++i) {
    const double centre = time[0] + 0.5 * (i + 1) * window;
    if (findRange(time, centre, window).count >= kLeastSamples) centres.push_back(centre);
  }
  return centres;
}

Smoothed smooth(const VectorXd& time, const MatrixXd& samples, const std::vector<double>& centres, double window) {
  using Powers = Eigen::Matrix<double, Eigen::Dynamic, kPolynomialDegree + 1>;
  const auto rows = static_cast<Eigen::Index>(centres.size());
  Smoothed out;
  for (MatrixXd* x : {&out.value, &out.rate, &out.acceleration}) x->resize(rows, samples.cols());
  const double half = 0.5 * window;
  for (Eigen::Index i = 0; i < rows; ++i) {
    const double centre = centres[static_cast<size_t>(i)];
    Range range = findRange(time, centre, window);
    if (range.count < kLeastSamples) {
      range.first = std::clamp<Eigen::Index>(range.first + (range.count - kLeastSamples) / 2, 0,
                                             std::max<Eigen::Index>(time.size() - kLeastSamples, 0));
      range.count = std::min<Eigen::Index>(kLeastSamples, time.size());
    }
    Powers V(range.count, kPolynomialDegree + 1);
    for (Eigen::Index k = 0; k < range.count; ++k) {
      const double s = (time[range.first + k] - centre) / half;
      V(k, 0) = 1;
      for (int p = 0; p < kPolynomialDegree; ++p) V(k, p + 1) = V(k, p) * s;
    }
    const Eigen::Matrix<double, kPolynomialDegree + 1, kPolynomialDegree + 1> G = V.transpose() * V;
    const MatrixXd C = G.llt().solve(V.transpose() * samples.middleRows(range.first, range.count));
    out.value.row(i) = C.row(0);
    out.rate.row(i) = C.row(1) / half;
    out.acceleration.row(i) = 2 * C.row(2) / (half * half);
  }
  return out;
}

}  // namespace bielle
