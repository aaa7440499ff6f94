#include "worlds/standing_place.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "bielle/motion/footsteps.h"
#include "bielle/motion/motion.h"
#include "math/so3.h"
#include "model/number_text.h"

namespace bielle::worlds {
namespace {

// In the order of a path around it; one of a point.
std::vector<Vector3d> listCorners(const ContactFrame& sole, const SE3& X_WF) {
  std::vector<Vector3d> corners;
  for (const auto& [x, y] : {std::pair(1, 1), {-1, 1}, {-1, -1}, {1, -1}})
    corners.push_back(X_WF.act(Vector3d(x * sole.half_length, y * sole.half_width, 0)));
  return corners;
}

double dropRounding(double x) { return std::abs(x) < 1e-9 ? 0 : x; }

}  // namespace

StandingPlace findPlace(const Model& model, const std::vector<ContactTarget>& soles) {
  StandingPlace place;
  if (soles.empty()) return place;
  Vector3d middle = Vector3d::Zero(), across = Vector3d::Zero();
  for (const ContactTarget& sole : soles) {
    middle += sole.X_WT.p / static_cast<double>(soles.size());
    across += sole.X_WT.R.col(1);  // level while legs bend
  }
  const bool is_level = across.head<2>().norm() > 0.5 * across.norm();
  const double heading = is_level ? dropRounding(std::atan2(-across.x(), across.y())) : 0;
  middle.z() = makeGroundUnder(model, soles).height;
  place.X_WP = {makeAxisRotation(Vector3d::UnitZ(), heading), middle.unaryExpr(&dropRounding)};
  for (const ContactTarget& sole : soles)
    for (const Vector3d& corner : listCorners(model.contacts()[sole.contact], sole.X_WT))
      place.reach = std::max(place.reach, (place.X_WP.inverse().act(corner)).x());
  return place;
}

Ground carryGround(Ground ground, const SE3& X_WP) {
  ground.height += X_WP.p.z();
  for (GroundStep& step : ground.steps) {
    step.top = X_WP.act(step.top);
    step.yaw += calcHeading(X_WP);
  }
  return ground;
}

std::vector<std::string> describeSoles(const Model& model, const Ground& ground,
                                       const std::vector<ContactTarget>& soles) {
  constexpr double kTold = 1e-3;  // m
  std::vector<std::string> told;
  for (const ContactTarget& sole : soles) {
    const ContactFrame& frame = model.contacts()[sole.contact];
    double lowest = std::numeric_limits<double>::infinity();
    for (const Vector3d& corner : listCorners(frame, sole.X_WT))
      lowest = std::min(lowest, corner.z() - ground.calcHeight(corner.x(), corner.y()));
    if (std::abs(lowest) > kTold)
      told.push_back("'" + frame.name + "' starts " + formatNumber(std::abs(lowest)) + " m " +
                     (lowest > 0 ? "over the ground" : "in the ground"));
  }
  return told;
}

bool reachesBoxes(const Model& model, const Ground& ground, const std::vector<ContactTarget>& soles, const SE3& X_WP,
                  double start) {
  const auto isOnBox = [&](const Vector3d& p) {
    return (X_WP.inverse().act(p)).x() > start &&
           std::any_of(ground.steps.begin(), ground.steps.end(),
                       [&](const GroundStep& box) { return box.covers(p.x(), p.y()); });
  };
  return std::any_of(soles.begin(), soles.end(), [&](const ContactTarget& sole) {
    const std::vector<Vector3d> corners = listCorners(model.contacts()[sole.contact], sole.X_WT);
    return std::any_of(corners.begin(), corners.end(), isOnBox);
  });
}

}  // namespace bielle::worlds
