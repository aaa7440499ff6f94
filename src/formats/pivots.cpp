#include "formats/pivots.h"

#include <algorithm>
#include <limits>

namespace bielle {
namespace {

constexpr double kSamePivot = 1e-7;  // m

struct Welded {
  int link;  // index among the links
  SE3 X_LB;
};

bool isHinge(const Joint& joint) { return joint.kind == JointKind::Revolute || joint.kind == JointKind::Continuous; }

bool isPivot(const Joint& joint) { return joint.kind != JointKind::Fixed && joint.kind != JointKind::FreeFlyer; }

Pivot placePivot(const SE3& X_LF, const Pivot& pivot) {
  Pivot out = pivot;
  out.p = X_LF.R * pivot.p + X_LF.p;
  out.axis = X_LF.R * pivot.axis;
  return out;
}

// Links with their bodies; of each body its link.
std::vector<Welded> weldBodies(const Model& model, std::vector<RigidLink>& links) {
  std::vector<Welded> welded(static_cast<size_t>(model.numBodies()), {-1, SE3::Identity()});
  for (int first = 0; first < model.numBodies(); ++first) {
    if (welded[first].link >= 0) continue;
    const int link = static_cast<int>(links.size());
    links.push_back({model.bodies()[first].name, {}, {}, {}});
    welded[first].link = link;
    for (bool grows = true; grows;) {
      grows = false;
      for (const Closure& c : model.closures()) {
        if (c.kind != ClosureKind::Weld6D || (welded[c.body1].link == link) == (welded[c.body2].link == link)) continue;
        const bool knows_first = welded[c.body1].link == link;
        const SE3 X_12 = c.X_B1 * c.X_B2.inverse();
        const Welded& known = welded[knows_first ? c.body1 : c.body2];
        welded[knows_first ? c.body2 : c.body1] = {link, known.X_LB * (knows_first ? X_12 : X_12.inverse())};
        grows = true;
      }
    }
    for (int body = first; body < model.numBodies(); ++body)
      if (welded[body].link == link)
        links.back().bodies.push_back(body), links.back().X_LB.push_back(welded[body].X_LB);
  }
  return welded;
}

// Pivots of a link that differ in place, the first of each place.
std::vector<int> listPlaces(const RigidLink& link) {
  std::vector<int> places;
  for (size_t i = 0; i < link.pivots.size(); ++i) {
    const auto is_here = [&](int k) {
      return calcPivotDistance(link.pivots[static_cast<size_t>(k)], link.pivots[i]) < kSamePivot;
    };
    if (std::none_of(places.begin(), places.end(), is_here)) places.push_back(static_cast<int>(i));
  }
  return places;
}

// Prim's shortest tree.
void addTree(const std::vector<Pivot>& pivots, std::vector<int> left, int link, std::vector<LinkDistance>& out) {
  std::vector<int> reached = {left.front()};
  left.erase(left.begin());
  while (!left.empty()) {
    LinkDistance best{link, 0, 0, std::numeric_limits<double>::infinity()};
    for (const int from : reached)
      for (const int to : left)
        if (const double length = calcPivotDistance(pivots[from], pivots[to]); length < best.length)
          best = {link, from, to, length};
    out.push_back(best);
    reached.push_back(best.to);
    left.erase(std::find(left.begin(), left.end(), best.to));
  }
}

}  // namespace

std::vector<RigidLink> listRigidLinks(const Model& model) {
  std::vector<RigidLink> links;
  const std::vector<Welded> welded = weldBodies(model, links);
  const auto add = [&](int body, const SE3& X_BF, const Pivot& pivot) {
    const Welded& place = welded[static_cast<size_t>(body)];
    links[static_cast<size_t>(place.link)].pivots.push_back(placePivot(place.X_LB * X_BF, pivot));
  };
  for (int i = 1; i < model.numBodies(); ++i) {
    const Joint& joint = model.joints()[i];
    if (!isPivot(joint)) continue;
    Pivot pivot{joint.name, Vector3d::Zero(), Vector3d::Zero(), model.findMotor(joint.name)};
    if (isHinge(joint)) pivot.axis = joint.axis;
    add(i, SE3::Identity(), pivot);
    add(joint.parent, joint.X_PJ, pivot);
  }
  for (const Closure& c : model.closures()) {
    if (c.kind == ClosureKind::Coupler || c.kind == ClosureKind::Weld6D) continue;
    Pivot pivot{c.name, Vector3d::Zero(), Vector3d::Zero(), -1};
    if (c.kind == ClosureKind::Hinge5D) pivot.axis = c.axis;
    add(c.body1, c.X_B1, pivot);
    add(c.body2, c.X_B2, pivot);
  }
  return links;
}

double calcPivotDistance(const Pivot& a, const Pivot& b) {
  const Vector3d d = b.p - a.p;
  const bool has_a = !a.axis.isZero(), has_b = !b.axis.isZero();
  if (has_a && has_b && a.axis.cross(b.axis).norm() > 1e-9) return d.norm();
  const Vector3d axis = has_a ? a.axis : b.axis;
  return (d - axis * axis.dot(d)).norm();
}

std::vector<LinkDistance> listLinkDistances(const std::vector<RigidLink>& links) {
  std::vector<LinkDistance> out;
  for (size_t i = 0; i < links.size(); ++i) {
    const std::vector<int> places = listPlaces(links[i]);
    const int link = static_cast<int>(i);
    if (places.size() == 3) {
      const auto& pivots = links[i].pivots;
      for (const auto& [from, to] : {std::pair{places[0], places[1]}, {places[1], places[2]}, {places[2], places[0]}})
        out.push_back(
            {link, from, to, calcPivotDistance(pivots[static_cast<size_t>(from)], pivots[static_cast<size_t>(to)])});
    } else if (places.size() > 1) {
      addTree(links[i].pivots, places, link, out);
    }
  }
  return out;
}

}  // namespace bielle
