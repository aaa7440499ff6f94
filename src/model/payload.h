#pragma once
// A robot that carries something.
#include <optional>

#include "bielle/model/model.h"

namespace bielle {

// A point mass fixed to the trunk, the first body that moves.
struct Payload {
  double mass = 0;             // kg
  std::optional<Vector3d> at;  // in the frame of the trunk, m; none: its centre of mass

  bool operator==(const Payload& other) const { return mass == other.mass && at == other.at; }
};

// The robot with the mass as part of its trunk. All else is the same to the last bit, and the whole robot is if the mass is zero.
// \throws InputError when the mass is negative, a place is not finite, or a motor moves the first body, which is no trunk then
Model addPayload(const Model& model, const Payload& payload);

}  // namespace bielle
