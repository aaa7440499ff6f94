#pragma once
/// \file How far joints reach through their linkages, and the ratios on the way.
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bielle/model/model.h"

namespace bielle {

struct JointReach {
  std::string joint;
  double lower = 0, upper = 0;  ///< rad (m where prismatic)
  std::optional<std::pair<double, double>>
      ratio;  ///< least and largest |R| (ratio.h) on the way, if one motor drives it
};

/// Of the serial joints that linkages move: from the closed configuration of the robot up to limits of any joint and dead points of
/// the linkage (`bielle ratio`), while its other joints are held. None of linkages that start at a dead point.
std::vector<JointReach> listReaches(const Model& model);

struct ReachChange {
  JointReach before, after;
};
/// Joints of the same names in both whose range changes by more than a thousandth of it, or an end of whose ratio does.
std::vector<ReachChange> listReachChanges(const Model& before, const Model& after);

/// "0 .. 2.1", and of the ratio.
std::string formatRange(const JointReach& reach);
std::string formatRatio(const JointReach& reach);

}  // namespace bielle
