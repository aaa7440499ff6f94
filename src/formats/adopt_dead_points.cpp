#include "formats/adopt_dead_points.h"

#include <algorithm>
#include <cmath>

#include "bielle/dynamics/ratio.h"
#include "bielle/model/error.h"
#include "model/number_text.h"

namespace bielle {
namespace {

std::string formatAngle(double value) { return formatNumber(std::abs(value) < 1e-9 ? 0.0 : value, "%.4g"); }

// Those of a kind at one angle, as a linkage passes them on several ways, are one.
std::vector<RatioSample> selectDead(const RatioSweep& sweep) {
  constexpr double kSame = 1e-3;  // rad or m
  std::vector<RatioSample> out;
  for (const RatioSample& sample : sweep.samples) {
    const bool is_known = std::any_of(out.begin(), out.end(), [&](const RatioSample& other) {
      return other.dead == sample.dead && std::abs(other.joints[sweep.joint] - sample.joints[sweep.joint]) < kSame;
    });
    if ((sample.dead != DeadPointKind::None || sample.loses_rank) && !is_known) out.push_back(sample);
  }
  return out;
}

std::string describeDead(const Linkage& linkage, size_t joint, const RatioSample& dead, double posture) {
  const double angle = dead.joints[static_cast<Eigen::Index>(joint)];
  return linkage.joint_names[joint] + " at " + formatAngle(angle) + ", " + formatAngle(std::abs(angle - posture)) +
         " (rad or m) away: " +
         (dead.dead == DeadPointKind::Motors   ? "the motors cannot hold it"
          : dead.dead == DeadPointKind::Output ? "it turns back"
                                               : "its loops can go on in several ways");
}

}  // namespace

std::vector<std::string> describeDeadPoints(const Model& model, ConstVectorRef start, ConstVectorRef posture) {
  std::vector<std::string> lines;
  try {
    for (const Linkage& linkage : listLinkages(model, posture)) {
      if (linkage.isDirect()) continue;
      if (calcTransmission(linkage, model, start) < 0)
        lines.push_back(linkage.output + " is on the other side of a dead point than in the neutral configuration");
      const DeadPoint nearest = findDeadPoint(linkage, model, posture);
      if (linkage.joints.empty() && nearest.kind != DeadPointKind::None)
        lines.push_back(linkage.output + ": one of the " + getName(nearest.kind) + ", " + formatDistance(nearest) +
                        " (rad or m) away");
      for (size_t j = 0; j < linkage.joints.size(); ++j)
        for (const RatioSample& sample : selectDead(sweepRatio(model, linkage, posture, static_cast<int>(j))))
          lines.push_back(describeDead(linkage, j, sample, posture[model.joints()[linkage.joints[j]].idx_q]));
    }
  } catch (const InputError& error) {  // the posture is one itself
    lines.push_back(error.element() + ": " + error.problem());
  }
  return lines;
}

}  // namespace bielle
