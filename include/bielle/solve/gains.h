#pragma once
/// \file Feedback of one stage, as a sweep of FDDP finds it.
#include "bielle/math/types.h"

namespace bielle {

/// About node state xs_k and control us_k:  u = us_k + k + K dx,  dx = difference(xs_k, x). K is added: where it resists a
/// deviation, its sign is that of a negative feedback. At an optimum k vanishes. Rows of controls at their bounds are zero.
struct Gains {
  VectorXd k;     ///< nu_k, the unit of the control
  RowMatrixXd K;  ///< nu_k x ndx_k, in the tangent space of the problem at xs_k
};

}  // namespace bielle
