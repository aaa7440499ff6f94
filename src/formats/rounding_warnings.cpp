#include "formats/rounding_warnings.h"

#include <algorithm>

#include "model/listing.h"
#include "model/number_text.h"

namespace bielle {
namespace {

std::string listClosures(const Model& model, const RoundedLinkage& linkage) {
  std::vector<std::string> names;
  for (int c : linkage.closures) names.push_back("'" + model.closures()[c].name + "'");
  return (names.size() > 1 ? "closures " : "closure ") + listItems(names);
}

std::string listJoints(const Model& model, const RoundedLinkage& linkage) {
  std::vector<std::string> names;
  for (int j : linkage.joints) names.push_back(model.joints()[j].name);
  return listItems(names);
}

std::string describeChange(const RoundedLinkage& linkage) {
  const auto format = [](double change) { return formatNumber(change < 1e-12 ? 0 : change, "%.2g"); };
  return format(linkage.angle) + " rad, " + format(linkage.length) + " m";
}

std::string describeMended(const Model& model, const RoundedLinkage& linkage) {
  const std::string joints = listJoints(model, linkage);
  const std::string kind =
      linkage.shape == LinkageShape::Plane ? "as a plane linkage: axes of " + joints + " made parallel"
      : linkage.shape == LinkageShape::Spherical
          ? "as a spherical linkage: axes of " + joints + " made to meet in a point"
          : "as a linkage of mobility " + std::to_string(linkage.meant) + ": placements of " + joints + " made to fit";
  return listClosures(model, linkage) + " " + kind + " (largest change " + describeChange(linkage) + ")";
}

}  // namespace

void warnOfRounding(const RoundedLinkages& linkages, const std::string& path, const std::string& loops,
                    std::vector<std::string>& warnings) {
  const Model& model = linkages.model;
  std::string mended;
  for (const RoundedLinkage& linkage : linkages.mended)
    mended += (mended.empty() ? "" : "; ") + describeMended(model, linkage);
  if (!mended.empty())
    warnings.push_back(path + ": loops: read " + mended +
                       ": its numbers are rounded; write them with all their digits (a right angle as "
                       "1.5707963267948966), or what `bielle convert` makes of the file");
  const auto describe = [&](const std::string& file, const RoundedLinkage& linkage) {
    const std::string about = file + ": " + listClosures(model, linkage) + ": ";
    if (linkage.written < 0) return about + "its linkage does not close: ";
    std::vector<std::string> motors;
    for (const Motor& motor : model.motors())
      if (contains(linkage.joints, motor.joint)) motors.push_back(motor.name);
    if (static_cast<int>(motors.size()) <= linkage.written) return about + "it is locked as it is written: ";
    return about + "mobility " + std::to_string(linkage.written) + " is less than the " +
           std::to_string(motors.size()) + (motors.size() > 1 ? " motors" : " motor") + " in its loops (" +
           listItems(motors) + "): ";
  };
  for (const RoundedLinkage& linkage : linkages.locked) {
    const std::string apart = linkage.axes.empty()
                                  ? "placements of " + listJoints(model, linkage) + " do not fit"
                                  : "axes of " + linkage.axes[0] + " and " + linkage.axes[1] + " are " +
                                        formatNumber(linkage.apart, "%.2g") + " rad from parallel";
    // A placement may change by more than its numbers are off, so that the most that may be given does where more is needed.
    const double needed = std::min(std::max(linkage.angle, linkage.length), kMostGivenRounding);
    warnings.push_back(describe(path, linkage) + apart +
                       ", more than its numbers are rounded; with placements that differ by " +
                       describeChange(linkage) + " at most, mobility would be " + std::to_string(linkage.meant) +
                       ": correct them, or give `rounding: " + formatNumber(needed, "%.1e") +
                       "` in the robot's YAML file if they were meant to fit");
  }
  for (const RoundedLinkage& linkage : linkages.short_of_freedoms)
    warnings.push_back(
        describe(loops, linkage) +
        "they work against each other; remove motors, or use closures of fewer rows where joints had more "
        "freedom");
}

}  // namespace bielle
