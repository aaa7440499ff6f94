#pragma once
// Gragg's, Bulirsch's and Stoer's method with a fixed step and a fixed order, for motions without a closed form.
#include <functional>

#include "bielle/math/types.h"

namespace bielle::loops {

// y(h) of y' = f(y): the modified midpoint rule with 2, 4, .. 2 columns steps, extrapolated to none; of order 2 columns.
VectorXd extrapolate(const std::function<VectorXd(const VectorXd&)>& f, const VectorXd& y, double h, int columns = 8);

}  // namespace bielle::loops
