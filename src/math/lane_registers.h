#pragma once
/// \file Eight numbers in as many registers of the processor as they need.
///
/// GCC 12 has vectors of any size, but those longer than a register it keeps in memory and takes apart number by number, which
/// costs most of what they gain. Hence one vector where there is AVX-512, else an array of vectors of the register's size.
#include <Eigen/Core>

namespace bielle {

/// Count of numbers that are processed together.
constexpr Eigen::Index kLane = 8;
/// Of these, in one register of the processor.
#if defined(__AVX512F__)
constexpr Eigen::Index kRegister = 8;
#elif defined(__AVX__)
constexpr Eigen::Index kRegister = 4;
#else
constexpr Eigen::Index kRegister = 2;
#endif

/// One register, and the same anywhere in memory.
typedef double Register __attribute__((vector_size(kRegister * sizeof(double))));
typedef double RegisterAnywhere
    __attribute__((vector_size(kRegister * sizeof(double)), aligned(sizeof(double)), may_alias));

#ifdef __AVX512F__

typedef double LaneReals __attribute__((vector_size(kLane * sizeof(double))));
typedef long long LaneIntegers __attribute__((vector_size(kLane * sizeof(double))));  // -1 for true, 0 for false

inline LaneReals spread(double x) { return x - LaneReals{}; }
inline LaneIntegers spread(long long x) { return x - LaneIntegers{}; }
template <typename Vector, typename Number>
void setLane(Vector& v, Eigen::Index lane, Number x) {
  v[lane] = x;
}
template <typename Vector>
Vector blend(const LaneIntegers& mask, const Vector& a, const Vector& b) {
  return mask ? a : b;
}
inline LaneIntegers getBits(const LaneReals& v) { return reinterpret_cast<LaneIntegers>(v); }
inline bool isAny(const LaneIntegers& v) {
  const LaneIntegers halves = v | __builtin_shufflevector(v, v, 4, 5, 6, 7, 0, 1, 2, 3);
  const LaneIntegers quarters = halves | __builtin_shufflevector(halves, halves, 2, 3, 0, 1, 6, 7, 4, 5);
  return (quarters[0] | quarters[1]) != 0;
}

#else

template <typename Number>
struct LaneRegisters {
  typedef Number Part __attribute__((vector_size(kRegister * sizeof(Number))));
  static constexpr int kParts = kLane / kRegister;
  Part parts[kParts];

  Number operator[](Eigen::Index lane) const { return parts[lane / kRegister][lane % kRegister]; }

  template <typename Out = Number, typename F, typename... In>
  static LaneRegisters<Out> apply(const F& f, const In&... in) {
    LaneRegisters<Out> out;
#pragma GCC unroll 4
    for (int i = 0; i < kParts; ++i) out.parts[i] = typename LaneRegisters<Out>::Part(f(in.parts[i]...));
    return out;
  }
#define BIELLE_EACH(op, Out)                                                              \
  friend LaneRegisters<Out> operator op(const LaneRegisters& a, const LaneRegisters& b) { \
    return apply<Out>([](const Part& x, const Part& y) { return x op y; }, a, b);         \
  }
  BIELLE_EACH(+, Number)
  BIELLE_EACH(-, Number)
  BIELLE_EACH(*, Number)
  BIELLE_EACH(/, Number)
  BIELLE_EACH(&, Number)
  BIELLE_EACH(|, Number)
  BIELLE_EACH(<, long long)
  BIELLE_EACH(<=, long long)
  BIELLE_EACH(>, long long)
  BIELLE_EACH(>=, long long)
  BIELLE_EACH(==, long long)
  BIELLE_EACH(!=, long long)
#undef BIELLE_EACH
  friend LaneRegisters operator-(const LaneRegisters& a) {
    return apply([](const Part& x) { return -x; }, a);
  }
  friend LaneRegisters operator~(const LaneRegisters& a) {
    return apply([](const Part& x) { return ~x; }, a);
  }
};
using LaneReals = LaneRegisters<double>;
using LaneIntegers = LaneRegisters<long long>;  // -1 for true, 0 for false

template <typename Number>
LaneRegisters<Number> spread(Number x) {
  LaneRegisters<Number> out;
  for (auto& part : out.parts) part = x - typename LaneRegisters<Number>::Part{};
  return out;
}
template <typename Number, typename X>
void setLane(LaneRegisters<Number>& v, Eigen::Index lane, X x) {
  v.parts[lane / kRegister][lane % kRegister] = x;
}
template <typename Number>
LaneRegisters<Number> blend(const LaneIntegers& mask, const LaneRegisters<Number>& a, const LaneRegisters<Number>& b) {
  return LaneRegisters<Number>::apply([](const auto& m, const auto& x, const auto& y) { return m ? x : y; }, mask, a,
                                      b);
}
inline LaneIntegers getBits(const LaneReals& v) {
  return LaneReals::apply<long long>([](const auto& x) { return reinterpret_cast<LaneIntegers::Part>(x); }, v);
}
inline bool isAny(const LaneIntegers& v) {
  LaneIntegers::Part all = v.parts[0];
  for (int i = 1; i < LaneIntegers::kParts; ++i) all |= v.parts[i];
  long long any = 0;
  for (Eigen::Index i = 0; i < kRegister; ++i) any |= all[i];
  return any != 0;
}

#endif

}  // namespace bielle
