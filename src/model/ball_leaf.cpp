#include "model/ball_leaf.h"

#include <algorithm>

namespace bielle {

int findBallLeaf(const Model& model, const std::vector<Closure>& closures, const Closure& weld,
                 const std::vector<int>& taken) {
  if (weld.kind != ClosureKind::Weld6D) return -1;
  for (const auto& [leaf, other] : {std::pair{weld.body1, weld.body2}, {weld.body2, weld.body1}}) {
    const int body = leaf;
    const auto uses = [body](const Closure& c) { return c.body1 == body || c.body2 == body; };
    const auto hangs = [body](const Joint& joint) { return joint.parent == body; };
    const auto drives = [body](const Motor& motor) { return motor.joint == body; };
    if (body > 0 && model.joints()[body].kind == JointKind::Spherical && model.joints()[body].parent != other &&
        std::find(taken.begin(), taken.end(), other) == taken.end() &&
        std::count_if(closures.begin(), closures.end(), uses) == 1 &&
        std::none_of(model.joints().begin(), model.joints().end(), hangs) &&
        std::none_of(model.motors().begin(), model.motors().end(), drives))
      return body;
  }
  return -1;
}

}  // namespace bielle
