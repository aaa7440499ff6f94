#include "loops/extrapolation.h"

#include <vector>

namespace bielle::loops {
namespace {

VectorXd goByMidpoints(const std::function<VectorXd(const VectorXd&)>& f, const VectorXd& y, const VectorXd& slope,
                       double h, int steps) {
  const double step = h / steps;
  VectorXd before = y, now = y + step * slope;
  for (int i = 1; i < steps; ++i) {
    before += 2 * step * f(now);
    before.swap(now);
  }
  return 0.5 * (before + now + step * f(now));
}

}  // namespace

VectorXd extrapolate(const std::function<VectorXd(const VectorXd&)>& f, const VectorXd& y, double h, int columns) {
  const VectorXd slope = f(y);
  std::vector<VectorXd> row;  // of Aitken's and Neville's scheme in the square of the step
  for (int j = 0; j < columns; ++j) {
    VectorXd value = goByMidpoints(f, y, slope, h, 2 * (j + 1));
    for (int k = 0; k < j; ++k) {
      const double ratio = (j + 1.0) / (j - k);
      const VectorXd next = value + (value - row[k]) / (ratio * ratio - 1);
      row[k].swap(value);
      value = next;
    }
    row.push_back(value);
  }
  return row.back();
}

}  // namespace bielle::loops
