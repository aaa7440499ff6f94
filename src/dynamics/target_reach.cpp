#include "dynamics/target_reach.h"

#include <array>
#include <limits>
#include <utility>

#include "model/number_text.h"

namespace bielle {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// A line, or a point, where it has no direction.
struct Line {
  Vector3d p, direction = Vector3d::Zero();

  Vector3d at(double s) const { return p + s * direction; }
};

// A joint on the way from one body to another: its axis in the body that comes before and in the one behind, and where the string
// passes it.
struct Stop {
  Line before, behind;
  double slide = 0;  // m, along both
};

// False where a joint slides. \param one, other  bodies
bool listStops(const Model& model, int one, int other, std::vector<Stop>& stops) {
  std::vector<Stop> down;  // to the other body
  while (one != other) {
    const bool up = one > other;  // bodies come after those that carry them
    int& body = up ? one : other;
    const Joint& joint = model.joints()[static_cast<size_t>(body)];
    if (joint.kind == JointKind::Prismatic || joint.kind == JointKind::Planar || joint.kind == JointKind::FreeFlyer)
      return false;
    const bool hinge = joint.kind == JointKind::Revolute || joint.kind == JointKind::Continuous;
    const Line child{Vector3d::Zero(), hinge ? joint.axis : Vector3d::Zero()};
    const Line parent{joint.X_PJ.p, hinge ? Vector3d(joint.X_PJ.R * joint.axis) : Vector3d::Zero()};
    if (up)
      stops.push_back({child, parent});
    else
      down.push_back({parent, child});
    body = joint.parent;
  }
  stops.insert(stops.end(), down.rbegin(), down.rend());
  return true;
}

// Where the shortest string from `from` to `to` passes an axis: the points are in the bodies before and behind it.
double findPassage(const Stop& stop, const Vector3d& from, const Vector3d& to) {
  const auto measure = [](const Line& line, const Vector3d& point) {
    const double along = line.direction.dot(point - line.p);
    return std::pair(along, (point - line.at(along)).norm());
  };
  const auto [s, d] = measure(stop.before, from);
  const auto [t, e] = measure(stop.behind, to);
  return d + e > 0 ? (s * e + t * d) / (d + e) : s;
}

// Slides every stop, where it may slide, to the shortest way between those beside it.
void tighten(std::vector<Stop>& stops) {
  for (size_t i = 0; i < stops.size(); ++i) {
    Stop& stop = stops[i];
    if (stop.before.direction.isZero(0)) continue;
    const bool first = i == 0, last = i + 1 == stops.size();
    if (first && last) return;
    const Vector3d from = first ? Vector3d::Zero() : stops[i - 1].behind.at(stops[i - 1].slide);
    const Vector3d to = last ? Vector3d::Zero() : stops[i + 1].before.at(stops[i + 1].slide);
    if (first)
      stop.slide = stop.behind.direction.dot(to - stop.behind.p);
    else if (last)
      stop.slide = stop.before.direction.dot(from - stop.before.p);
    else
      stop.slide = findPassage(stop, from, to);
  }
}

double calcLength(const std::vector<Stop>& stops) {
  double length = 0;
  for (size_t i = 0; i + 1 < stops.size(); ++i)
    length += (stops[i + 1].before.at(stops[i + 1].slide) - stops[i].behind.at(stops[i].slide)).norm();
  return length;
}

SE3 getBody(const FrameTarget& target) { return target.X_WT * target.X_BF.inverse(); }

}  // namespace

Span calcSpan(const Model& model, const FrameTarget& one, const FrameTarget& other) {
  constexpr int kSweeps = 30;
  constexpr double kEnough = 1e-6;
  std::vector<Stop> stops;
  Span span{one.X_BF.p, other.X_BF.p, kInfinity};
  if (!listStops(model, one.body, other.body, stops)) return span;
  const bool whole_one = one.mask.all() && !stops.empty(), whole_other = other.mask.all() && !stops.empty();
  if (!whole_one) stops.insert(stops.begin(), {Line{span.one}, Line{span.one}});
  if (!whole_other) stops.push_back({Line{span.other}, Line{span.other}});
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    tighten(stops);
    const double length = calcLength(stops), before = span.length;
    span.length = length;
    if (!(length < before * (1 - kEnough))) break;
  }
  if (whole_one) span.one = stops.front().before.at(stops.front().slide);
  if (whole_other) span.other = stops.back().behind.at(stops.back().slide);
  return span;
}

std::pair<std::string, std::string> findTargetsApart(const Model& model, const std::vector<FrameTarget>& frames) {
  FrameTarget world;
  world.name = "the origin of the world";
  for (size_t i = 0; i < frames.size(); ++i)
    for (size_t k = i + 1; k <= frames.size(); ++k) {
      const bool is_world = k == frames.size();
      const FrameTarget &one = frames[i], &other = is_world ? world : frames[k];
      const Span span = calcSpan(model, one, other);
      const std::array<Vector3d, 2> ends = {getBody(one).act(span.one), getBody(other).act(span.other)};
      Vector3d way = ends[0] - ends[1];
      for (int r = 0; r < 3; ++r)
        if (!one.mask[r] || !other.mask[r]) way[r] = 0;
      const double distance = way.norm();
      if (span.bridges(distance)) continue;
      const bool at_joints = span.one != one.X_BF.p || span.other != other.X_BF.p;
      const std::string name = "target '" + one.name + "'";
      TextStream text;
      text << name << " stays open by at least " << distance - span.length << " m: ";
      text << (at_joints ? "the joint at it" : "it") << " would be " << distance << " m from ";
      text << (is_world ? other.name : "target '" + other.name + "'");
      if (at_joints) text << " or the joint there";
      text << ", and what is between them bridges " << span.length << " m at most; give places within reach, in m";
      return {name, text.str()};
    }
  return {};
}

}  // namespace bielle
