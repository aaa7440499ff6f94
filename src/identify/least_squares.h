#pragma once
/// \file Nonlinear least squares: min |r(x)|^2 / 2 from x = 0, by Ceres' trust region of Levenberg and Marquardt.
#include <functional>
#include <string>

#include "bielle/math/types.h"

namespace bielle {

struct LeastSquares {
  int size = 0, residuals = 0;
  int iterations = 50;  ///< at most
  double enough = 0;    ///< |r|^2 / 2 below which nothing is left but rounding
  /// r, and J if it is asked for; false where there is none
  std::function<bool(const VectorXd& x, VectorXd& r, MatrixXd* J)> evaluate;
  /// Called at each step that is taken with |r|^2 / 2; false asks for the end
  std::function<bool(int iteration, double cost)> progress;
};

struct LeastSquaresEnd {
  VectorXd x;  ///< the best found
  int iterations = 0;
  bool converged = false, interrupted = false;
  std::string message;
};

LeastSquaresEnd minimize(const LeastSquares& problem);

}  // namespace bielle
