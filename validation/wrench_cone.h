#pragma once
/// \file The wrenches that the ground can exert on a rectangular sole.
///
/// The contact frame is in the middle of the sole, z along the normal, X and Y are half its length and width, mu is the
/// friction. A force f at a point of the sole, a mean of the corners with weights alpha_i, is equivalent to forces
/// alpha_i f at the corners: for any pressure under the sole, four corner forces f_i give the same wrench (f, n). With
/// a friction pyramid at each corner,
///     |f_ix| <= mu f_iz,    |f_iy| <= mu f_iz,                                                                    (1)
/// the sum of the four cones has a closed form. Let P+ and P- be the normal forces on the edges y = +Y and y = -Y, A+
/// and A- the forces along x there, Q+, Q-, B+ and B- the normal forces and those along y on the edges x = +X, x = -X:
///     P+ + P- = f_z,  Y (P+ - P-) = n_x,     |A| <= mu P on each edge,   A+ + A- = f_x,
///     Q+ + Q- = f_z,  X (Q+ - Q-) = -n_y,    |B| <= mu Q on each edge,   B+ + B- = f_y,                           (2)
///     n_z = -Y (A+ - A-) + X (B+ - B-).
/// All edge forces that satisfy (2) result from corner forces (f_iz = P Q / f_z; f_ix, f_iy in proportion to it), so
/// that the two terms of n_z are independent. The first one is largest when A- = mu P- or A+ = -mu P+, whichever is
/// reached first:
///     Y min(2 mu P- - f_x, 2 mu P+ + f_x) = mu Y f_z - |Y f_x + mu n_x|.
/// The largest and least values of both terms bound the torque about the normal, given the other five numbers:
///     |f_x| <= mu f_z,    |f_y| <= mu f_z,    f_z >= 0,                                                           (3)
///     |n_x| <= Y f_z,     |n_y| <= X f_z,                                                                         (4)
///     -mu (X + Y) f_z + |Y f_x - mu n_x| + |X f_y - mu n_y| <= n_z,
///     n_z <= mu (X + Y) f_z - |Y f_x + mu n_x| - |X f_y + mu n_y|.                                                (5)
/// (S. Caron, Q.-C. Pham, Y. Nakamura, "Stability of surface contacts for humanoid robots", ICRA 2015.)
///
/// The pyramid (1) encloses the round cone |f_i| <= mu f_iz of dry friction, whose sum has no closed form. So a wrench
/// outside (3) to (5) is impossible for any sole of that size and friction; one inside may still slip if forces point
/// between the axes, by up to sqrt(2). The pyramid inscribed in the round cone has mu / sqrt(2).
#include "bielle/math/se3.h"

namespace bielle::validation {

struct ConeMargin {
  /// Least slack of (3) to (5), over f_z, m: (3) is multiplied by X + Y, the lever arm of friction in the torque of
  /// (5). Negative outside, NaN if the wrench has a NaN.
  double value = 0;
  const char* limit = "";  ///< the nearest one: "torque", "pressure", "friction" or "pull"
};

/// \param wrench (f, n) of the ground on the foot in the contact's frame, N and N m
/// \param half_length, half_width X and Y, m; a sole without size bears no moment
/// \param least_load positive, N: a smaller f_z is replaced by it, since the ratio of two tiny numbers is meaningless;
///   a negative f_z is outside in any case
ConeMargin calcConeMargin(const Vector6d& wrench, double half_length, double half_width, double friction,
                          double least_load);

}  // namespace bielle::validation
