#pragma once
/// \file The wrenches that the ground can give to a rectangular sole.
///
/// The contact frame is in the middle of the sole, z along the normal, X and Y are half its length and width, mu is the
/// friction. A force f at a point of the sole, a mean of the corners with weights alpha_i, does what forces alpha_i f
/// do at the corners: whatever the pressure under the sole, four corner forces f_i give the same wrench (f, n).
/// With a pyramid of friction at each corner,
///     |f_ix| <= mu f_iz,    |f_iy| <= mu f_iz,                                                                    (1)
/// the sum of the four cones has a closed form. Let P+ and P- be the normal forces on the edges y = +Y and y = -Y, A+
/// and A- the forces along x there, Q+, Q-, B+ and B- the normal forces and those along y on the edges x = +X, x = -X:
///     P+ + P- = f_z,  Y (P+ - P-) = n_x,     |A| <= mu P on each edge,   A+ + A- = f_x,
///     Q+ + Q- = f_z,  X (Q+ - Q-) = -n_y,    |B| <= mu Q on each edge,   B+ + B- = f_y,                           (2)
///     n_z = -Y (A+ - A-) + X (B+ - B-).
/// All edge forces that keep (2) come from corner forces (f_iz = P Q / f_z; f_ix, f_iy in proportion to it), so that
/// the two terms of n_z are free of each other. The first one is largest where A- = mu P- or A+ = -mu P+ comes first:
///     Y min(2 mu P- - f_x, 2 mu P+ + f_x) = mu Y f_z - |Y f_x + mu n_x|.
/// Both terms, and their least values, give the torque about the normal that is left beside the other five numbers:
///     |f_x| <= mu f_z,    |f_y| <= mu f_z,    f_z >= 0,                                                           (3)
///     |n_x| <= Y f_z,     |n_y| <= X f_z,                                                                         (4)
///     -mu (X + Y) f_z + |Y f_x - mu n_x| + |X f_y - mu n_y| <= n_z,
///     n_z <= mu (X + Y) f_z - |Y f_x + mu n_x| - |X f_y + mu n_y|.                                                (5)
/// (S. Caron, Q.-C. Pham, Y. Nakamura, "Stability of surface contacts for humanoid robots", ICRA 2015.)
///
/// The pyramid (1) stands around the round cone |f_i| <= mu f_iz of dry friction, which has no closed sum. So a wrench
/// outside of (3) to (5) is beyond every sole of that size and friction; one inside may still slip where forces point
/// between the axes, by up to sqrt(2). The pyramid inside of the round cone has mu / sqrt(2).
#include "bielle/math/se3.h"

namespace bielle::validation {

struct ConeMargin {
  /// Least of what is left of (3) to (5), over f_z, m: (4) and (5) as they are, (3) times X + Y, the arm by which
  /// friction becomes the torque of (5). Negative outside, NaN for a wrench that is not a number.
  double value = 0;
  const char* limit = "";  ///< what is nearest: "torque", "pressure", "friction" or "pull"
};

/// \param wrench (f, n) of the ground on the foot in the contact's frame, N and N m
/// \param half_length, half_width X and Y, m; a sole without size bears no moment
/// \param least_load positive, N: an f_z below it counts as so much, since a ratio of almost nothing by almost nothing
///     says little; a negative f_z is outside all the same
ConeMargin calcConeMargin(const Vector6d& wrench, double half_length, double half_width, double friction,
                          double least_load);

}  // namespace bielle::validation
