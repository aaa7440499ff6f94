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

// Exchanges entries across the diagonal between rows at this distance. Entry I of the upper row stays where I & distance
// is 0, and that of the lower row where it is not; the others come from the other row, whose entries count from kRegister on.
template <int distance, int... I>
void exchange(std::array<Register, kRegister>& rows, std::integer_sequence<int, I...>) {
#pragma GCC unroll 8
  for (int i = 0; i < kRegister; ++i) {
    if (i & distance) continue;
    const Register a = rows[i], b = rows[i + distance];
    rows[i] = __builtin_shufflevector(a, b, (I & distance ? I - distance + static_cast<int>(kRegister) : I)...);
    rows[i + distance] =
        __builtin_shufflevector(a, b, (I & distance ? I + static_cast<int>(kRegister) : I + distance)...);
  }
}

// Rows become columns.
void transpose(std::array<Register, kRegister>& rows) {
  constexpr std::make_integer_sequence<int, kRegister> entries;
  exchange<1>(rows, entries);
  if constexpr (kRegister > 2) exchange<2>(rows, entries);
  if constexpr (kRegister > 4) exchange<4>(rows, entries);
}

Register load(const double* from) { return *reinterpret_cast<const RegisterAnywhere*>(from); }
void store(const Register& x, double* to) { *reinterpret_cast<RegisterAnywhere*>(to) = x; }

}  // namespace

// Processes kRegister numbers of as many lanes at a time; the last block overlaps the one before.
void packLanes(const std::array<const double*, kLane>& in, Eigen::Index size, Lanes* out) {
  if (size < kRegister) {
    for (Eigen::Index i = 0; i < size; ++i)
      for (Eigen::Index l = 0; l < kLane; ++l) out[i].set(l, in[l][i]);
    return;
  }
  double* to = reinterpret_cast<double*>(out);
  for (Eigen::Index k = 0; k < size; k += kRegister) {
    const Eigen::Index i = std::min(k, size - kRegister);
    for (Eigen::Index first = 0; first < kLane; first += kRegister) {
      std::array<Register, kRegister> rows;
#pragma GCC unroll 8
      for (Eigen::Index l = 0; l < kRegister; ++l) rows[l] = load(in[first + l] + i);
      transpose(rows);
#pragma GCC unroll 8
      for (Eigen::Index l = 0; l < kRegister; ++l) store(rows[l], to + (i + l) * kLane + first);
    }
  }
}

void unpackLanes(const Lanes* in, Eigen::Index size, const std::array<double*, kLane>& out, Eigen::Index stride) {
  if (size < kRegister) {
    for (Eigen::Index l = 0; l < kLane; ++l)
      for (Eigen::Index i = 0; i < size && out[l]; ++i) out[l][i] = in[i * stride][l];
    return;
  }
  const double* from = reinterpret_cast<const double*>(in);
  for (Eigen::Index k = 0; k < size; k += kRegister) {
    const Eigen::Index i = std::min(k, size - kRegister);
    for (Eigen::Index first = 0; first < kLane; first += kRegister) {
      std::array<Register, kRegister> rows;
#pragma GCC unroll 8
      for (Eigen::Index l = 0; l < kRegister; ++l) rows[l] = load(from + (i + l) * stride * kLane + first);
      transpose(rows);
#pragma GCC unroll 8
      for (Eigen::Index l = 0; l < kRegister; ++l)
        if (out[first + l]) store(rows[l], out[first + l] + i);
    }
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
  const LaneIntegers one = spread(1LL), two = spread(2LL), quadrant = getBits(shifted.v) & spread(3LL);
  const LaneMask odd{(quadrant & one) == one}, negative_sine{quadrant >= two},
      negative_cosine{((quadrant + one) & two) == two};
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
