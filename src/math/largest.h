#pragma once
// Maxima and minima that keep a NaN: std::max(x, NaN) is x, and a failed computation would pass for a small one.
#include <Eigen/Core>
#include <cmath>

namespace bielle {

inline double getLarger(double a, double b) { return std::isnan(a) || b < a ? a : b; }
inline double getSmaller(double a, double b) { return std::isnan(a) || a < b ? a : b; }

// Largest |entry|, 0 if there is none, NaN if any entry is NaN; optionally its position.
template <typename Derived>
double calcLargest(const Eigen::MatrixBase<Derived>& x) {
  return x.size() == 0 ? 0 : x.cwiseAbs().template maxCoeff<Eigen::PropagateNaN>();
}
template <typename Derived>
double calcLargest(const Eigen::MatrixBase<Derived>& x, Eigen::Index* place) {
  return x.cwiseAbs().template maxCoeff<Eigen::PropagateNaN>(place);
}

}  // namespace bielle
