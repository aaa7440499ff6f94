#pragma once
/// \file Moments of inertia beside the principal ones that a format has for them. Principal axes are rounded on the way out and found
/// anew on the way back, and are anything where two moments are nearly equal: read and written in turn, they would never stay.
#include <string>
#include <vector>

#include "bielle/math/types.h"

namespace bielle {

/// ixx iyy izz ixy ixz iyz
inline VectorXd listMoments(const Matrix3d& I) {
  VectorXd out(6);
  out << I.diagonal(), I(0, 1), I(0, 2), I(1, 2);
  return out;
}

/// Of six numbers.
inline Matrix3d makeMoments(const std::vector<double>& six) {
  Matrix3d I;
  I << six[0], six[3], six[4], six[3], six[1], six[5], six[4], six[5], six[2];
  return I;
}

/// Puts the exact moments in place of those of the principal axes; false where they are others, since a file was changed by hand.
inline bool takeExactMoments(const Matrix3d& exact, Matrix3d& I) {
  constexpr double kSame = 3e-7;  // float has 6e-8
  if (!((exact - I).norm() <= kSame * I.norm())) return false;
  I = exact;
  return true;
}

}  // namespace bielle
