#pragma once
/// \file Friction of rod ends (bielle/model/wear.h): what bears it in a model, and Eq. (1) there.
#include <cmath>
#include <utility>
#include <vector>

#include "bielle/model/model.h"
#include "bielle/model/wear.h"

namespace bielle {

/// The pivots that one closure presses on.
struct RodBearing {
  /// Dofs that turn one side against the other, with the sign in which they do.
  using Pivot = std::vector<std::pair<int, double>>;
  int closure = 0;
  RodFriction law;
  std::vector<Pivot> pivots;
};

/// \throws InputError for a closure that is not there, has friction twice or is no ball, hinge or weld; a weld without
///   joints; a joint that does not turn or is not in the loop; and numbers that cannot be
std::vector<RodBearing> makeRodBearings(const Model& model, const std::vector<RodFriction>& frictions);

template <typename T>
struct RodTorqueOf {
  Vector3<T> torque;      ///< against w, N m
  T slope = 0, fall = 0;  ///< -d torque / dw = slope 1 - fall w w^T; with stiction it may be indefinite
};

/// Eq. (1). \param force  |lambda|, N   \param w  rad/s
template <typename T>
RodTorqueOf<T> calcRodTorque(const RodFriction& law, const T& force, const Vector3<T>& w) {
  using std::sqrt;
  RodTorqueOf<T> out;
  const T square = w.squaredNorm();
  const auto add = [&](double level, double speed) {
    const T size = square + speed * speed, slope = law.radius * level * force / sqrt(size);
    out.slope += slope;
    out.fall += slope / size;
  };
  const double excess = law.stiction - law.coefficient;
  add(excess > 0 ? law.stiction : law.coefficient, law.friction_speed);
  if (excess > 0) add(-excess, law.stribeck_speed);
  out.torque = -out.slope * w;
  return out;
}

}  // namespace bielle
