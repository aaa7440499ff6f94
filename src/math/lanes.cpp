#include "math/lanes.h"

#include <algorithm>
#include <utility>

namespace bielle {
namespace {

// x = n pi/2 + r with |r| <= pi/4, pi/2 in three parts of which the first two have 33 bits (Cody and Waite); beyond
// kLargest their products with n are no longer exact.
constexpr double kHalfPi1 = 1.57079632673412561417e+00, kHalfPi2 = 6.07710050630396597660e-11,
                 kHalfPi3 = 2.02226624879595063154e-21, kTwoOverPi = 6.36619772367581382433e-01;
constexpr double kLargest = 1e5;
constexpr double kRound = 6755399441055744.0;  // 1.5 * 2^52: adding and subtracting it rounds to an integer

using Vector = Lanes::Vector;
typedef double Anywhere __attribute__((vector_size(kLane * sizeof(double)), aligned(sizeof(double)), may_alias));

// Exchanges entries across the diagonal between rows at this distance. Entry I of the upper row stays where I & distance
// is 0, and that of the lower row where it is not; the others come from the other row, whose entries count from kLane on.
template <int distance, int... I>
void exchange(std::array<Vector, kLane>& rows, std::integer_sequence<int, I...>) {
#pragma GCC unroll 8
  for (int i = 0; i < kLane; ++i) {
    if (i & distance) continue;
    const Vector a = rows[i], b = rows[i + distance];
    rows[i] = __builtin_shufflevector(a, b, (I & distance ? I - distance + kLane : I)...);
    rows[i + distance] = __builtin_shufflevector(a, b, (I & distance ? I + kLane : I + distance)...);
  }
}

// Rows become columns.
void transpose(std::array<Vector, kLane>& rows) {
  constexpr std::make_integer_sequence<int, kLane> entries;
  exchange<1>(rows, entries);
  exchange<2>(rows, entries);
  exchange<4>(rows, entries);
}

}  // namespace

// Processes kLane numbers of each lane at a time; the last block overlaps the one before.
void packLanes(const std::array<const double*, kLane>& in, Eigen::Index size, Lanes* out) {
  if (size < kLane) {
    for (Eigen::Index i = 0; i < size; ++i)
      for (Eigen::Index l = 0; l < kLane; ++l) out[i].v[l] = in[l][i];
    return;
  }
  for (Eigen::Index k = 0; k < size; k += kLane) {
    const Eigen::Index i = std::min(k, size - kLane);
    std::array<Vector, kLane> rows;
#pragma GCC unroll 8
    for (Eigen::Index l = 0; l < kLane; ++l) rows[l] = *reinterpret_cast<const Anywhere*>(in[l] + i);
    transpose(rows);
#pragma GCC unroll 8
    for (Eigen::Index l = 0; l < kLane; ++l) out[i + l].v = rows[l];
  }
}

void unpackLanes(const Lanes* in, Eigen::Index size, const std::array<double*, kLane>& out, Eigen::Index stride) {
  if (size < kLane) {
    for (Eigen::Index l = 0; l < kLane; ++l)
      for (Eigen::Index i = 0; i < size && out[l]; ++i) out[l][i] = in[i * stride].v[l];
    return;
  }
  for (Eigen::Index k = 0; k < size; k += kLane) {
    const Eigen::Index i = std::min(k, size - kLane);
    std::array<Vector, kLane> rows;
#pragma GCC unroll 8
    for (Eigen::Index l = 0; l < kLane; ++l) rows[l] = in[(i + l) * stride].v;
    transpose(rows);
#pragma GCC unroll 8
    for (Eigen::Index l = 0; l < kLane; ++l)
      if (out[l]) *reinterpret_cast<Anywhere*>(out[l] + i) = rows[l];
  }
}

// Minimax polynomials of FreeBSD's libm (k_sin.c, k_cos.c), whose errors are below 2^-58.
void calcSineCosine(const Lanes& x, Lanes& sine, Lanes& cosine) {
  const Lanes shifted = x * kTwoOverPi + kRound, n = shifted - kRound;
  const Lanes r = (x - n * kHalfPi1 - n * kHalfPi2) - n * kHalfPi3, z = r * r;
  const Lanes s = r + r * z *
                          (-1.66666666666666324348e-01 +
                           z * (8.33333333332248946124e-03 +
                                z * (-1.98412698298579493134e-04 +
                                     z * (2.75573137070700676789e-06 +
                                          z * (-2.50507602534068634195e-08 + z * 1.58969099521155010221e-10)))));
  const Lanes c = 1 - 0.5 * z +
                  z * z *
                      (4.16666666666666019037e-02 +
                       z * (-1.38888888888741095749e-03 +
                            z * (2.48015872894767294178e-05 +
                                 z * (-2.75573143513906633035e-07 +
                                      z * (2.08757232129817482790e-09 + z * -1.13596475577881948265e-11)))));
  const LaneMask::Vector quadrant = reinterpret_cast<LaneMask::Vector>(shifted.v) & 3;
  const LaneMask odd{(quadrant & 1) == 1}, negative_sine{quadrant >= 2}, negative_cosine{((quadrant + 1) & 2) == 2};
  sine = select(odd, c, s);
  cosine = select(odd, s, c);
  sine = select(negative_sine, -sine, sine);
  cosine = select(negative_cosine, -cosine, cosine);
  if (!any(!(abs(x) < kLargest))) return;
  for (Eigen::Index l = 0; l < kLane; ++l) {
    if (std::abs(x[l]) < kLargest) continue;
    sine.set(l, std::sin(x[l]));
    cosine.set(l, std::cos(x[l]));
  }
}

}  // namespace bielle
