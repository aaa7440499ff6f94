#pragma once
// Smooth minimization by NLopt's SLSQP (Kraft, 1994). Only slsqp.cpp includes NLopt.
#include <functional>
#include <string>

#include "bielle/math/types.h"

namespace bielle {

struct SlsqpOptions {
  double tolerance = 1e-12;  // of every variable
  int max_evaluations = 100;
};

struct SlsqpResult {
  VectorXd x;
  double value = 0;
  int evaluations = 0;
};

// The objective writes its gradient if it is requested (not null).
using SlsqpObjective = std::function<double(const VectorXd& x, VectorXd* gradient)>;
// The best point found, however the search ends.
SlsqpResult minimizeBySlsqp(const VectorXd& start, const SlsqpObjective& objective, const SlsqpOptions& options = {});

}  // namespace bielle
