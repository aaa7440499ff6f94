#pragma once
/// \file Lanes that are on their own ways: choices by a mask, for numbers and matrices of double or of Lanes.
#include "bielle/math/types.h"
#include "math/lanes.h"

namespace bielle {

template <typename T>
using MaskOf = typename LogicOf<T>::Mask;
/// How many worlds, nodes, .. a T holds.
template <typename T>
inline constexpr int kLanesOf = std::is_same_v<T, double> ? 1 : static_cast<int>(kLane);

/// The same in every lane.
template <typename T>
MaskOf<T> makeMask(bool x) {
  if constexpr (std::is_same_v<T, double>)
    return x;
  else
    return {spread(x ? -1LL : 0LL)};
}
inline bool all(const LaneMask& a) { return !any(!a); }
inline bool all(bool a) { return a; }
inline void setLaneOf(LaneMask& x, Eigen::Index lane, bool value) { x.set(lane, value); }
inline void setLaneOf(Lanes& x, Eigen::Index lane, double value) { x.set(lane, value); }
inline void setLaneOf(bool& x, Eigen::Index, bool value) { x = value; }
inline void setLaneOf(double& x, Eigen::Index, double value) { x = value; }
inline LaneMask select(const LaneMask& mask, const LaneMask& a, const LaneMask& b) {
  return (mask && a) || (!mask && b);
}

/// Writes `from` to the lanes of the mask.
inline void assignLanes(bool mask, double from, double& to) {
  if (mask) to = from;
}
inline void assignLanes(const LaneMask& mask, const Lanes& from, Lanes& to) { to = select(mask, from, to); }
template <typename Mask, typename From, typename To>
void assignLanes(const Mask& mask, const Eigen::MatrixBase<From>& from, Eigen::MatrixBase<To>& to) {
  for (Eigen::Index c = 0; c < to.cols(); ++c)
    for (Eigen::Index r = 0; r < to.rows(); ++r) to(r, c) = select(mask, from(r, c), to(r, c));
}
/// a in the lanes of the mask, b in the others.
template <typename Mask, typename T, int Rows, int Cols>
Eigen::Matrix<T, Rows, Cols> select(const Mask& mask, const Eigen::Matrix<T, Rows, Cols>& a,
                                    const Eigen::Matrix<T, Rows, Cols>& b) {
  if constexpr (std::is_same_v<T, double>) {
    return mask ? a : b;
  } else {
    Eigen::Matrix<T, Rows, Cols> out;
    for (Eigen::Index i = 0; i < a.size(); ++i) out.data()[i] = select(mask, a.data()[i], b.data()[i]);
    return out;
  }
}

}  // namespace bielle
