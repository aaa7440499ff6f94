#include "worlds/open_loops.h"

#include "bielle/dynamics/kinematics.h"
#include "dynamics/largest_gaps.h"
#include "model/number_text.h"

namespace bielle::worlds {

std::string describeOpenLoops(const Model& model, Workspace& ws, ConstVectorRef q) {
  constexpr double kOpen = 1e-6;  // m or rad: more than rounding, or a file of few digits, leaves
  updatePlacements(model, ws, q);
  const ClosureGap gap = calcLargestGaps(model, ws);
  if (gap.position <= kOpen && gap.angle <= kOpen) return "";
  return "its loops are open by " + formatNumber(gap.position, "%.3g") + " m and " + formatNumber(gap.angle, "%.3g") +
         " rad where it was reset; give a closed configuration";
}

}  // namespace bielle::worlds
