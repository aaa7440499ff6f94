#pragma once
/// \file Convex quadratic program on a box, by projected Newton.
///
///     min  1/2 d.H d + g.d    s.t.  lower <= d <= upper                                                      (1)
///
/// (Tassa, Mansard, Todorov, "Control-Limited Differential Dynamic Programming", ICRA 2014, section III.) At a point d
/// of the box with gradient r = g + H d, the components at a bound whose gradient pushes outwards are clamped:
///     c = { i : d_i = lower_i and r_i > 0,  or  d_i = upper_i and r_i < 0,  or  lower_i = upper_i },   f the others.
///     (2)
/// The Newton step of the free ones, s_f = -H_ff^{-1} r_f, s_c = 0, is projected back on the box and shortened until
///     q(d) - q(P(d + t s)) >= 0.1 r.(d - P(d + t s)).                                                        (3)
/// d solves (1) where r_f = 0.
#include <vector>

#include "bielle/math/types.h"

namespace bielle {

/// Workspace and solution of (1). No allocation after the first solve() of the largest size.
class BoxQp {
 public:
  /// H (n x n; the lower triangle is read), g, lower <= upper (n, infinite if there is no bound).
  /// d (n): on entry the start (clamped first), on return the solution.
  /// \return Indefinite: a free block H_ff has no Cholesky factor; NotConverged: r_f did not vanish, the data are not
  /// finite or H is singular to rounding
  NumericalStatus solve(ConstMatrixRef H, ConstVectorRef g, ConstVectorRef lower, ConstVectorRef upper, VectorRef d);

  /// Number of free components, and their indices in increasing order in its first entries.
  int numFree() const { return num_free_; }
  int getFreeIndex(int i) const { return free_[i]; }
  /// Lower Cholesky factor of H_ff in its lower triangle (num_free x num_free).
  auto freeFactor() const { return factor_.topLeftCorner(num_free_, num_free_); }

 private:
  bool updateFreeSet(ConstVectorRef r, ConstVectorRef d, ConstVectorRef lower, ConstVectorRef upper);
  bool factorize(ConstMatrixRef H);
  void calcNewtonStep(ConstVectorRef r, VectorRef step);

  int num_free_ = 0;
  std::vector<int> free_;
  MatrixXd factor_;
  VectorXd free_step_;
  MatrixXd columns_;  // r, s, trial, move, H move
};

}  // namespace bielle
