#include "model/rod_end.h"

#include <algorithm>

#include "model/listing.h"

namespace bielle {
namespace {

// Whether nothing else hangs on a body, nor stands on it, nor drives it, and it is no link of the serial robot.
bool isRod(const Model& model, int body, const Closure& own) {
  const auto hangs = [body](const Joint& joint) { return joint.parent == body; };
  const auto ties = [&](const Closure& c) { return &c != &own && (c.body1 == body || c.body2 == body); };
  const auto stands = [body](const ContactFrame& contact) { return contact.body == body; };
  const auto drives = [body](const Motor& motor) { return motor.joint == body; };
  return body > 0 && std::none_of(model.joints().begin(), model.joints().end(), hangs) &&
         std::none_of(model.motors().begin(), model.motors().end(), drives) && !contains(model.serialJoints(), body) &&
         std::none_of(model.closures().begin(), model.closures().end(), ties) &&
         std::none_of(model.contacts().begin(), model.contacts().end(), stands);
}

}  // namespace

// The line of a rod runs from its joint to the joint at its other end, where the cut is or the other half begins.
std::optional<RodEnd> findRodEnd(const Model& model, const Closure& closure) {
  const bool is_tie = closure.kind == ClosureKind::Weld6D || closure.kind == ClosureKind::Hinge5D ||
                      closure.kind == ClosureKind::Ball3D;
  const bool first = is_tie && isRod(model, closure.body1, closure),
             second = is_tie && isRod(model, closure.body2, closure);
  if (!first && !second) return {};
  const SE3 &X_BC = first ? closure.X_B1 : closure.X_B2, &X_OC = first ? closure.X_B2 : closure.X_B1;
  const bool is_half = first && second && closure.kind == ClosureKind::Weld6D;
  return RodEnd{first, is_half ? (X_BC * X_OC.inverse()).p : X_BC.p};
}

}  // namespace bielle
