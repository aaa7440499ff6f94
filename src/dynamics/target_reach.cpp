#include "dynamics/target_reach.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "model/number_text.h"

namespace bielle {
namespace {

// How far apart two points are if targets are met, and at most by what is between them.
struct Apart {
  double distance = 0, span = 0;  // m
  bool at_joints = false;         // the points are those of the joints next to the targets
};

// Of two targets. Where one gives a body its whole place, the joints at that body have their places, too: the legs
// between hip and ankle reach less far than those between trunk and sole.
Apart calcApart(const Model& model, const FrameTarget& one, const FrameTarget& other) {
  Apart apart;
  std::array<Vector3d, 2> ends = {one.X_WT.p, other.X_WT.p};
  std::array<double, 2> beside = {one.X_BF.p.norm(), other.X_BF.p.norm()};  // of the span, at the targets
  const std::array<const FrameTarget*, 2> targets = {&one, &other};
  std::array<int, 2> bodies = {one.body, other.body}, outermost = {-1, -1};
  while (bodies[0] != bodies[1]) {
    const int i = bodies[0] > bodies[1] ? 0 : 1;  // bodies come after those that carry them
    const Joint& joint = model.joints()[bodies[i]];
    if (joint.kind == JointKind::Prismatic || joint.kind == JointKind::Planar || joint.kind == JointKind::FreeFlyer) {
      apart.span = HUGE_VAL;
      return apart;
    }
    outermost[i] = bodies[i];
    bodies[i] = joint.parent;
    apart.span += joint.X_PJ.p.norm();
  }
  for (int i = 0; i < 2; ++i) {
    const FrameTarget& target = *targets[i];
    const int carried = outermost[1 - i];  // by the body of this target, on the way to the other
    const bool carries = bodies[i] == target.body;
    if (!target.mask.all() || (carries && carried < 0)) continue;
    const SE3 X_WB = target.X_WT * target.X_BF.inverse();
    const Vector3d p = carries ? model.joints()[carried].X_PJ.p : Vector3d::Zero();
    ends[i] = X_WB.act(p);
    beside[i] = -p.norm();  // what was counted
    apart.at_joints |= ends[i] != target.X_WT.p;
  }
  apart.span = std::max(0.0, apart.span + beside[0] + beside[1]);
  Vector3d way = ends[0] - ends[1];
  for (int r = 0; r < 3; ++r)
    if (!one.mask[r] || !other.mask[r]) way[r] = 0;
  apart.distance = way.norm();
  return apart;
}

}  // namespace

std::pair<std::string, std::string> findTargetsApart(const Model& model, const std::vector<FrameTarget>& frames) {
  constexpr double kRounding = 1e-9;  // of distances, m; and their share
  FrameTarget world;
  world.body = 0;
  for (size_t i = 0; i < frames.size(); ++i)
    for (size_t k = i + 1; k <= frames.size(); ++k) {
      const bool is_world = k == frames.size();
      const Apart apart = calcApart(model, frames[i], is_world ? world : frames[k]);
      if (!(apart.distance > (1 + kRounding) * apart.span + kRounding)) continue;
      TextStream text;
      const std::string name = "target '" + frames[i].name + "'",
                        other = is_world ? "the origin of the world" : "target '" + frames[k].name + "'";
      text << name << " stays open by at least " << apart.distance - apart.span << " m: ";
      text << (apart.at_joints ? "the joint at it" : "it") << " would be " << apart.distance << " m from " << other;
      if (apart.at_joints) text << " or the joint there";
      text << ", and what is between them bridges " << apart.span << " m at most; give places within reach, in m";
      return {name, text.str()};
    }
  return {};
}

}  // namespace bielle
