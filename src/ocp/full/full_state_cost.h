#pragma once
// The state cost over all joints of the tree, by (q, v) and the tangent (dq, dv).
#include "bielle/ocp/cost.h"

namespace bielle {

// Its value, with the weight. \param difference  nv, memory
double calcStateCost(const Model& model, const StateCost& cost, ConstVectorRef q, ConstVectorRef v,
                     VectorXd& difference);

// Adds to gradient (2 nv) and Hessian (2 nv x 2 nv, of Gauss and Newton, of which the lower triangle counts) those of
// the cost times `scale`.
void addStateCost(const Model& model, const StateCost& cost, double scale, ConstVectorRef q, ConstVectorRef v,
                  VectorXd& difference, VectorRef gradient, MatrixRef hessian);

}  // namespace bielle
