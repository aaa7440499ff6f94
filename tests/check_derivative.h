#pragma once
// Compares an analytic derivative with finite differences, for Catch2 tests.
#include <algorithm>
#include <catch2/catch.hpp>
#include <random>
#include <string>

#include "mechanisms.h"

namespace bielle::testing {

constexpr double kDerivativeTolerance = 1e-6;

/// Scale of the error of each entry: the largest entry of its row or of its column, whichever is less, so that a
/// block of small numbers is not hidden by one of large numbers (forces beside accelerations); never less than a
/// thousandth of the largest of all, where differences leave nothing but rounding, nor than 1e-6.
inline MatrixXd calcEntryScales(const MatrixXd& numeric) {
  const MatrixXd size = numeric.cwiseAbs();
  const VectorXd rows = size.rowwise().maxCoeff();
  const Eigen::RowVectorXd columns = size.colwise().maxCoeff();
  const double least = std::max(1e-6, 1e-3 * size.maxCoeff());
  return rows.replicate(1, size.cols()).cwiseMin(columns.replicate(size.rows(), 1)).cwiseMax(least);
}

/// Passes if every entry is close, and if a thousandth of its scale added to an entry would be noticed: one entry of
/// each row and of each column is tried, chosen at random (the same ones in every run).
inline void checkDerivative(const MatrixXd& analytic, const MatrixXd& numeric, const std::string& name = "") {
  CAPTURE(name);
  REQUIRE(analytic.rows() == numeric.rows());
  REQUIRE(analytic.cols() == numeric.cols());
  if (numeric.size() == 0) return;
  const MatrixXd scales = calcEntryScales(numeric);
  MatrixXd poisoned = analytic;
  const auto calcError = [&] {
    return (poisoned - numeric).cwiseQuotient(scales).cwiseAbs().maxCoeff<Eigen::PropagateNaN>();
  };
  CHECK(calcError() < kDerivativeTolerance);
  std::mt19937 random(static_cast<unsigned>(31 * numeric.rows() + numeric.cols()));
  const auto poison = [&](Eigen::Index row, Eigen::Index column) {
    CAPTURE(row, column);
    poisoned(row, column) += 1e-3 * scales(row, column);
    CHECK(calcError() > kDerivativeTolerance);
    poisoned(row, column) = analytic(row, column);
  };
  for (Eigen::Index row = 0; row < numeric.rows(); ++row) poison(row, random() % numeric.cols());
  for (Eigen::Index column = 0; column < numeric.cols(); ++column) poison(random() % numeric.rows(), column);
}

}  // namespace bielle::testing
