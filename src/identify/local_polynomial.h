#pragma once
/// \file Samples made smooth, with their derivatives: polynomials through a window (Savitzky and Golay, Analytical Chemistry 36, 1964),
/// also for instants that are not evenly spaced.
#include <vector>

#include "bielle/math/types.h"

namespace bielle {

inline constexpr int kPolynomialDegree = 4, kLeastSamples = 7;

struct Smoothed {
  MatrixXd value, rate, acceleration;  ///< instants x columns
};

/// The instants [s] at which to take polynomials: half a window apart, so that each shares half of its samples with the next, and
/// only where a window has kLeastSamples. \param time  K, s, not falling   \param window  s; it becomes longer if so few samples need it
std::vector<double> listCentres(const VectorXd& time, double& window);

/// At each instant the polynomial of kPolynomialDegree in time that is nearest to the samples within half a window of it. It does not
/// delay, and is exact for motions that are such polynomials. Where a window has less than kLeastSamples, it takes those that are next
/// to it.
/// \param samples  K x columns, at the instants `time`
Smoothed smooth(const VectorXd& time, const MatrixXd& samples, const std::vector<double>& centres, double window);

}  // namespace bielle
