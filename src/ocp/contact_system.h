#pragma once
// The systems of the contacts, Eq. (b) of reduced_node.h, of several nodes at once, one in each lane: saddle_point.h Eqs. (1)
// and (2) where no row is redundant. With L L^T = M, W = D J_c N L^{-T} and G = W W^T,
//     z = L^{-1} f,   G y = -D gamma - W z,   lambda = D y,   y' = L^{-T} (z + W^T y).
#include "bielle/dynamics/saddle_point.h"
#include "bielle/math/lanes.h"

namespace bielle {

class ContactSystem {
 public:
  // \param rows  contact rows that a node may have
  ContactSystem(int size, int rows);

  // To be filled. A row that the node of a lane lacks is zero, and 1 in `absent`.
  MatrixX<Lanes> M, Jt;             // size x size; size x rows, (J_c N)^T
  VectorX<Lanes> f, gamma, absent;  // size, rows, rows

  // Tells where that went through: not where rows are redundant or M is singular, and what is left there is of no use.
  LaneMask solve();

  VectorX<Lanes> ydd, lambda;  // size, rows
  // As SaddlePointFactors.
  MatrixX<Lanes> L, Wt, Ginv;
  VectorX<Lanes> D;

 private:
  MatrixX<Lanes> G_, G_llt_;             // rows x rows
  VectorX<Lanes> y_, rhs_, correction_;  // rows
};

}  // namespace bielle
