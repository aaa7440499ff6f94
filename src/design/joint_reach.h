#pragma once
/// \file How far joints reach through their linkages, and the ratios on the way: before and after, and as measures of designs.
#include <array>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bielle/dynamics/ratio.h"
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

/// Of which joints, and over which angles, a measure is about ranges.
struct JointAngles {
  std::vector<std::string> joints = {};              ///< * stands for any text; empty: all of listReaches()
  std::optional<std::array<double, 2>> angles = {};  ///< rad (m); none: as far as the joints of the start design reach
};
/// A joint and angles that it ought to reach.
struct JointRange {
  std::string joint;
  double lower = 0, upper = 0;
};
/// Of the joints of linkages and of those with a motor of their own.
/// \param needs_ratio  whether joints whose linkages have several motors are left out, or refused if they are named without *
/// \throws InputError when there are none
std::vector<JointRange> findRanges(const Model& start, const JointAngles& requested, bool needs_ratio,
                                   const char* where);

/// From the closed configuration of a robot to limits and dead points.
struct JointWay {
  std::vector<RatioSample> samples;  ///< their angles rise, or fall; empty where the joint starts at a dead point
  int joint = 0;                     ///< its index in the linkage
  bool turns = false;                ///< round and round
};

/// How much of its range a joint reaches as in listReaches(), and the ratios there.
struct RangeCoverage {
  double share = 0;                                                     ///< 0 .. 1
  double least = 0, largest = std::numeric_limits<double>::infinity();  ///< |R|; these where the share is 0
};

/// The ways of joints, each swept once.
class JointWays {
 public:
  explicit JointWays(const Model& model) : model_(model) {}  ///< which stays where it is

  /// \throws InputError when the robot has no such joint, or its loops are open
  RangeCoverage calcCoverage(const JointRange& range);

 private:
  const JointWay& find(const std::string& joint);

  const Model& model_;
  VectorXd q_;  // closed; empty before the first joint
  std::map<std::string, JointWay> ways_;
};

/// "0 .. 2.1", and of the ratio.
std::string formatRange(const JointReach& reach);
std::string formatRatio(const JointReach& reach);

}  // namespace bielle
