#pragma once
// A robot that carries something.
#include <optional>
#include <string>

#include "bielle/model/model.h"

namespace bielle {

// A point mass fixed to a link.
struct Payload {
  double mass = 0;             // kg
  std::optional<Vector3d> at;  // in the frame of the link, m; none: the centre of mass of its body
  std::string link;            // empty: the trunk, the first body that moves

  bool operator==(const Payload& other) const { return mass == other.mass && at == other.at && link == other.link; }
};

// The robot with the mass as part of the body of that link. All else is the same to the last bit, and the whole robot is if the mass is zero.
// \throws InputError when the mass is negative, a place is not finite, the link does not exist or does not move, or none is named and a
// motor moves the first body, which is no trunk then
Model addPayload(const Model& model, const Payload& payload);

}  // namespace bielle
