#pragma once
// An analytic derivative against differences, for Catch2 tests.
#include <algorithm>
#include <catch2/catch.hpp>
#include <string>

#include "mechanisms.h"

namespace bielle::testing {

constexpr double kDerivativeTolerance = 1e-6;

/// Passes when close, and when adding a thousandth of the largest entry anywhere would be seen.
inline void checkDerivative(const MatrixXd& analytic, const MatrixXd& numeric, const std::string& name = "") {
  CAPTURE(name);
  REQUIRE(analytic.rows() == numeric.rows());
  REQUIRE(analytic.cols() == numeric.cols());
  if (numeric.size() == 0) return;
  CHECK(calcRelativeError(analytic, numeric) < kDerivativeTolerance);
  MatrixXd poisoned = analytic;
  poisoned(poisoned.rows() / 2, poisoned.cols() / 2) += 1e-3 * std::max(1e-6, numeric.cwiseAbs().maxCoeff());
  CHECK(calcRelativeError(poisoned, numeric) > kDerivativeTolerance);
}

}  // namespace bielle::testing
