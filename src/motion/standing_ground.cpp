#include "motion/standing_ground.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "bielle/model/error.h"
#include "bielle/motion/footsteps.h"
#include "bielle/motion/motion.h"
#include "model/number_text.h"

namespace bielle {
namespace {

constexpr double kStoneRim = 0.02;  // of boxes around soles, m

double findLowest(const std::vector<ContactTarget>& soles) {
  double lowest = std::numeric_limits<double>::infinity();
  for (const ContactTarget& sole : soles) lowest = std::min(lowest, sole.X_WT.p.z());
  return lowest;
}

bool isHigher(const ContactTarget& sole, double lowest) { return sole.X_WT.p.z() >= lowest + kLevelSoles; }

}  // namespace

GroundStep makeStone(const ContactFrame& sole, const SE3& X_WF, double rim) {
  const double yaw = calcHeading(X_WF), pitch = std::asin(std::clamp(-X_WF.R(2, 0), -1.0, 1.0)),
               roll = std::atan2(X_WF.R(2, 1), X_WF.R(2, 2));
  return {X_WF.p, 2 * (sole.half_length + rim), 2 * (sole.half_width + rim), yaw, pitch, roll};
}

bool areLevel(const std::vector<ContactTarget>& soles) {
  const double lowest = findLowest(soles);
  return std::none_of(soles.begin(), soles.end(), [&](const ContactTarget& sole) { return isHigher(sole, lowest); });
}

Ground makeGroundUnder(const Model& model, const std::vector<ContactTarget>& soles) {
  Ground ground;
  const double lowest = findLowest(soles);
  int on_plane = 0;
  for (const ContactTarget& sole : soles) on_plane += isHigher(sole, lowest) ? 0 : 1;
  for (const ContactTarget& sole : soles) {
    const ContactFrame& frame = model.contacts()[sole.contact];
    if (!isHigher(sole, lowest)) {
      ground.height += sole.X_WT.p.z() / on_plane;
      continue;
    }
    double rim = kStoneRim;
    for (const ContactTarget& other : soles)
      if (other.contact != sole.contact)
        rim = std::min(rim, calcSoleDistance(frame, sole.X_WT, model.contacts()[other.contact], other.X_WT) / 2);
    ground.steps.push_back(makeStone(frame, sole.X_WT, std::max(0.0, rim)));
  }
  return ground;
}

void requireLevel(const Model& model, const std::vector<ContactTarget>& soles, const std::string& motion,
                  const std::string& remedy) {
  if (areLevel(soles)) return;
  const auto [lowest, highest] =
      std::minmax_element(soles.begin(), soles.end(),
                          [](const ContactTarget& a, const ContactTarget& b) { return a.X_WT.p.z() < b.X_WT.p.z(); });
  const auto describe = [&](const ContactTarget& sole) {
    return model.contacts()[sole.contact].name + "' at " +
           formatNumber(1e-6 * std::round(1e6 * sole.X_WT.p.z()) + 0.0) + " m";
  };
  throw InputError(model.name(), "feet",
                   "they stand on two levels, '" + describe(*lowest) + " and '" + describe(*highest) + ", but a " +
                       motion + " starts from one",
                   remedy);
}

void requireLevel(const Model& model, const std::vector<ContactTarget>& soles, const std::string& motion) {
  requireLevel(model, soles, motion, "give them the same height in the reference, or step down first, by a walk");
}

}  // namespace bielle
