#pragma once
// How far apart joints let bodies be.
#include <string>
#include <utility>
#include <vector>

#include "bielle/dynamics/assembly.h"

namespace bielle {

/// Two points of two bodies that are never farther apart than `length`, whatever the joints between them do.
///
/// They are at the ends of a string through one point on every joint between the bodies: a point on the axis of a hinge belongs to
/// both bodies that it joins, so that the string has the same length at all angles, and may slide along the axes,
///     length = min sum_i || p_{i+1} - p_i ||,                                                                      (1)
/// for a leg the way from the middle of the hip to that of the ankle. Any points give a bound; those of (1) are sought axis by
/// axis.
struct Span {
  Vector3d one, other;  ///< m, in either body
  double length = 0;    ///< m; infinite beyond joints that slide

  /// Rounding aside.
  bool bridges(double distance) const { return !(distance > (1 + kRounding) * length + kRounding); }

 private:
  static constexpr double kRounding = 1e-9;  // m, and its share
};
/// \param one, other  a target with free rows has no known rotation: the string ends at it, otherwise at the joint next to it
Span calcSpan(const Model& model, const FrameTarget& one, const FrameTarget& other);

/// A target that is out of reach of another one, or of the world, whatever the joints between them do, and what says
/// so: often they are in other units. Empty if none is.
std::pair<std::string, std::string> findTargetsApart(const Model& model, const std::vector<FrameTarget>& frames);

}  // namespace bielle
