#include "model/payload.h"

#include <algorithm>
#include <cmath>

#include "bielle/model/builder.h"

namespace bielle {

namespace {

struct Carrier {
  int body = 1;
  SE3 X_BL;  // of the link on the body
};

Carrier findCarrier(const Model& model, const std::string& link) {
  if (link.empty()) {
    const auto moves_first = [](const Motor& motor) { return motor.joint == 1; };
    if (std::any_of(model.motors().begin(), model.motors().end(), moves_first))
      throw InputError(model.name(), "payload", "the robot is fixed to the ground and has no trunk to carry it",
                       "name a link that carries it, or leave it out");
    return {};
  }
  const int frame = model.findFrame(link);
  const int body = frame < 0 ? 0 : model.frames()[frame].body;
  if (body > 0) return {body, model.frames()[frame].X_BF};
  throw InputError(model.name(), "payload",
                   "link '" + link + (frame < 0 ? "' does not exist" : "' is fixed to the ground"),
                   "name a link that moves");
}

}  // namespace

Model addPayload(const Model& model, const Payload& payload) {
  if (!(payload.mass >= 0 && std::isfinite(payload.mass)) || (payload.at && !payload.at->allFinite()))
    throw InputError(model.name(), "payload", "its mass is negative, or a number is not finite",
                     "give kilograms, and its place in metres");
  if (payload.mass == 0) return model;
  const Carrier carrier = findCarrier(model, payload.link);
  ModelParts parts = takeParts(model);
  Inertia& inertia = parts.bodies[carrier.body].inertia;
  const Vector3d at = payload.at ? carrier.X_BL.act(*payload.at) : inertia.com;
  inertia = inertia + Inertia{payload.mass, at, Matrix3d::Zero()};
  return ModelBuilder::restore(std::move(parts));
}

}  // namespace bielle
