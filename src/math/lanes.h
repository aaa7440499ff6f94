#pragma once
/// \file A scalar type for Eigen that holds one number per lane of a vector register.
///
/// Neighbouring nodes of a horizon differ only in their numbers, and their dynamics are short chains of dependent
/// operations on vectors of 3 to 14 numbers. With one node per lane, each operation of such a chain processes kLane
/// nodes in a full register. Lanes never mix: the result in one lane is bitwise independent of the contents of the
/// others, so that nodes can be grouped in any way.
#include <array>
#include <cmath>
#include <type_traits>

#include "math/lane_registers.h"

namespace bielle {

/// The result of a comparison in each lane; for double it is a bool.
struct LaneMask {
  LaneIntegers v;  // -1 or 0
  bool operator[](Eigen::Index lane) const { return v[lane] != 0; }
  void set(Eigen::Index lane, bool x) { setLane(v, lane, x ? -1 : 0); }
  friend LaneMask operator&&(const LaneMask& a, const LaneMask& b) { return {a.v & b.v}; }
  friend LaneMask operator||(const LaneMask& a, const LaneMask& b) { return {a.v | b.v}; }
  friend LaneMask operator!(const LaneMask& a) { return {~a.v}; }
};

/// kLane numbers.
struct alignas(kLane * sizeof(double)) Lanes {
  LaneReals v;

  Lanes() = default;
  Lanes(double x) : v(spread(x)) {}  // the same number in every lane
  explicit Lanes(const LaneReals& x) : v(x) {}
  double operator[](Eigen::Index lane) const { return v[lane]; }
  void set(Eigen::Index lane, double x) { setLane(v, lane, x); }

  Lanes& operator+=(const Lanes& o) { return v = v + o.v, *this; }
  Lanes& operator-=(const Lanes& o) { return v = v - o.v, *this; }
  Lanes& operator*=(const Lanes& o) { return v = v * o.v, *this; }
  Lanes& operator/=(const Lanes& o) { return v = v / o.v, *this; }

  friend Lanes sqrt(const Lanes& x) {
    Lanes out;
    for (Eigen::Index l = 0; l < kLane; ++l) out.set(l, std::sqrt(x[l]));
    return out;
  }
  friend Lanes abs(const Lanes& x) { return Lanes(blend(x.v < spread(0.0), -x.v, x.v)); }

  // Operators are friends alone: what is found by name is tried on every sum and product of matrices as well, which takes the
  // compiler a good part of its time.
  friend Lanes operator+(const Lanes& a, const Lanes& b) { return Lanes(a.v + b.v); }
  friend Lanes operator-(const Lanes& a, const Lanes& b) { return Lanes(a.v - b.v); }
  friend Lanes operator*(const Lanes& a, const Lanes& b) { return Lanes(a.v * b.v); }
  friend Lanes operator/(const Lanes& a, const Lanes& b) { return Lanes(a.v / b.v); }
  friend Lanes operator-(const Lanes& a) { return Lanes(-a.v); }
  friend LaneMask operator<(const Lanes& a, const Lanes& b) { return {a.v < b.v}; }
  friend LaneMask operator<=(const Lanes& a, const Lanes& b) { return {a.v <= b.v}; }
  friend LaneMask operator>(const Lanes& a, const Lanes& b) { return {a.v > b.v}; }
};

inline bool any(const LaneMask& a) { return isAny(a.v); }
inline bool any(bool a) { return a; }
inline double getLane(const Lanes& x, Eigen::Index lane) { return x[lane]; }
inline bool getLane(const LaneMask& x, Eigen::Index lane) { return x[lane]; }
inline double getLane(double x, Eigen::Index) { return x; }
inline bool getLane(bool x, Eigen::Index) { return x; }
inline Lanes select(const LaneMask& mask, const Lanes& a, const Lanes& b) { return Lanes(blend(mask.v, a.v, b.v)); }
inline double select(bool mask, double a, double b) { return mask ? a : b; }

/// sin and cos of every lane, to rounding.
void calcSineCosine(const Lanes& x, Lanes& sine, Lanes& cosine);
inline void calcSineCosine(double x, double& sine, double& cosine) {
  sine = std::sin(x);
  cosine = std::cos(x);
}

/// An index for each lane.
struct LaneIndex {
  LaneIntegers v;
  int operator[](Eigen::Index lane) const { return static_cast<int>(v[lane]); }
  void set(Eigen::Index lane, int i) { setLane(v, lane, i); }
  friend bool operator!=(const LaneIndex& a, const LaneIndex& b) { return any(LaneMask{a.v != b.v}); }
};

/// A bool and an index for each lane.
template <typename T>
struct LogicOf {
  using Mask = bool;
  using Index = int;
};
template <>
struct LogicOf<Lanes> {
  using Mask = LaneMask;
  using Index = LaneIndex;
};
/// The same index in every lane.
template <typename T>
typename LogicOf<T>::Index makeIndex(int i) {
  if constexpr (std::is_same_v<T, double>)
    return i;
  else
    return {spread(static_cast<long long>(i))};
}
inline int select(bool mask, int a, int b) { return mask ? a : b; }
inline LaneIndex select(const LaneMask& mask, const LaneIndex& a, const LaneIndex& b) {
  return {blend(mask.v, a.v, b.v)};
}
inline LaneIndex select(const LaneMask& mask, int a, const LaneIndex& b) {
  return select(mask, makeIndex<Lanes>(a), b);
}
inline double getEntry(const double* x, int i) { return x[i]; }
// Whether all lanes name the same entry. Neighbouring nodes mostly do, and then whole registers are moved.
inline bool isUniform(const LaneIndex& i) { return !(i != makeIndex<Lanes>(i[0])); }
inline Lanes getEntry(const Lanes* x, const LaneIndex& i) {
  if (isUniform(i)) return x[i[0]];
  Lanes out;
  for (Eigen::Index l = 0; l < kLane; ++l) out.set(l, x[i[l]][l]);
  return out;
}
inline void setEntry(double* x, int i, double value) { x[i] = value; }
inline void setEntry(Lanes* x, const LaneIndex& i, const Lanes& value) {
  if (isUniform(i)) {
    x[i[0]] = value;
    return;
  }
  for (Eigen::Index l = 0; l < kLane; ++l) x[i[l]].set(l, value[l]);
}

/// f applied to each lane separately, for functions that branch. double: f(x).
template <typename F>
inline auto applyLanes(const Lanes& x, const F& f) {
  Lanes out;
  for (Eigen::Index l = 0; l < kLane; ++l) out.set(l, f(x[l]));
  return out;
}

/// Sets each lane of out[i] to in[lane][i], i < size.
void packLanes(const std::array<const double*, kLane>& in, Eigen::Index size, Lanes* out);
/// The inverse: sets out[lane][i] to that lane of in[i * stride]; lanes whose pointer is null are skipped.
void unpackLanes(const Lanes* in, Eigen::Index size, const std::array<double*, kLane>& out, Eigen::Index stride = 1);
/// The same for one lane alone: a cache line per number.
inline void unpackLane(const Lanes* in, Eigen::Index lane, Eigen::Index size, double* out) {
  const double* from = reinterpret_cast<const double*>(in) + lane;
  for (Eigen::Index i = 0; i < size; ++i) out[i] = from[i * kLane];
}

}  // namespace bielle

namespace Eigen {
template <>
struct NumTraits<bielle::Lanes> : GenericNumTraits<double> {
  using Real = bielle::Lanes;
  using NonInteger = bielle::Lanes;
  using Nested = bielle::Lanes;
  using Literal = double;
  enum { RequireInitialization = 0 };
};
template <typename Op>
struct ScalarBinaryOpTraits<bielle::Lanes, double, Op> {
  using ReturnType = bielle::Lanes;
};
template <typename Op>
struct ScalarBinaryOpTraits<double, bielle::Lanes, Op> {
  using ReturnType = bielle::Lanes;
};
}  // namespace Eigen
