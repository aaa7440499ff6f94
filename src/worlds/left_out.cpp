#include "worlds/left_out.h"

#include <cmath>

#include "model/number_text.h"
#include "worlds/contact_law.h"

namespace bielle::worlds {

std::vector<std::string> listMissingStops(const Model& model,
                                          const std::function<bool(const Joint&, int k)>& has_stop) {
  std::vector<std::string> warnings;
  for (const Joint& joint : model.joints())
    for (int k = 0; k < joint.nv; ++k) {
      const double lower = model.lowerLimits()[joint.idx_v + k], upper = model.upperLimits()[joint.idx_v + k];
      if ((std::isfinite(lower) || std::isfinite(upper)) && !has_stop(joint, k))
        warnings.push_back("joint '" + joint.name + "': nothing stops its coordinate " + std::to_string(k + 1) +
                           " at its limits, " + formatNumber(lower) + " and " + formatNumber(upper));
    }
  return warnings;
}

std::vector<std::string> listMissingStops(const Model& model) {
  return listMissingStops(model, [](const Joint& joint, int) { return hasStops(joint.kind); });
}

// With u = R v along the axes of the parent, A u' = R A (v' + w x v) takes the place of R A v'.
std::vector<std::string> listTurnedArmatures(const Model& model) {
  std::vector<std::string> warnings;
  for (const Joint& joint : model.joints()) {
    if (joint.kind != JointKind::Planar && joint.kind != JointKind::FreeFlyer) continue;
    if (const double armature = model.armature()[joint.idx_v]; armature > 0)
      warnings.push_back("joint '" + joint.name + "': its armature of " + formatNumber(armature) +
                         " kg acts on accelerations along the axes of its parent, which differ by its angular velocity "
                         "times its velocity from those along its own");
  }
  return warnings;
}

std::vector<std::string> listRodFrictions(const Wear& wear) {
  std::vector<std::string> warnings;
  for (const RodFriction& friction : wear.frictions)
    warnings.push_back("closure '" + friction.closure +
                       "': the friction of its rod's ends is left out: a coefficient of " +
                       formatNumber(friction.coefficient) + " at a radius of " + formatNumber(friction.radius) + " m");
  return warnings;
}

}  // namespace bielle::worlds
