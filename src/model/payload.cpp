#include "model/payload.h"

#include <algorithm>
#include <cmath>

#include "bielle/model/builder.h"

namespace bielle {

Model addPayload(const Model& model, const Payload& payload) {
  constexpr int kTrunk = 1;
  if (!(payload.mass >= 0 && std::isfinite(payload.mass)) || (payload.at && !payload.at->allFinite()))
    throw InputError(model.name(), "payload", "its mass is negative, or a number is not finite",
                     "give kilograms, and its place in metres");
  if (payload.mass == 0) return model;
  const auto moves_first = [](const Motor& motor) { return motor.joint == kTrunk; };
  if (std::any_of(model.motors().begin(), model.motors().end(), moves_first))
    throw InputError(model.name(), "payload", "the robot is fixed to the ground and has no trunk to carry it",
                     "leave it out");
  ModelParts parts = takeParts(model);
  Inertia& trunk = parts.bodies[kTrunk].inertia;
  trunk = trunk + Inertia{payload.mass, payload.at.value_or(trunk.com), Matrix3d::Zero()};
  return ModelBuilder::restore(std::move(parts));
}

}  // namespace bielle
