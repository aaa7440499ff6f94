#pragma once
/// \file Small linear programs, by the simplex method.
#include <optional>

#include "bielle/math/types.h"

namespace bielle {

/// min c.x  subject to  A x = b, x >= 0: G. B. Dantzig's method on a dense tableau, in two phases, with the pivots of R. G. Bland
/// ("New finite pivoting rules for the simplex method", 1977), which do not cycle where many vertices coincide.
/// \param A  m x n, whose entries that matter are about 1 in size; rows may depend on others
/// \returns x (n); nothing where no x comes nearer to A x = b than 1e-9 of 1 + sum |b|, or where c.x has no least value
std::optional<VectorXd> solveLinearProgram(ConstMatrixRef A, ConstVectorRef b, ConstVectorRef c);

}  // namespace bielle
