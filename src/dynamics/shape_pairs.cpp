// Which shapes may come near each other, and which of them are nearest.
#include <algorithm>
#include <numeric>
#include <set>

#include "bielle/dynamics/distance.h"
#include "dynamics/cell.h"

namespace bielle {
namespace {

using Links = std::vector<std::set<int>>;  // per body

// Of bodies, or of what `part` puts in their place, connected by a joint or a closure.
Links listLinks(const Model& model, const std::vector<int>& part) {
  Links links(model.numBodies());
  const auto connect = [&](int a, int b) {
    if (part[a] == part[b]) return;
    links[part[a]].insert(part[b]);
    links[part[b]].insert(part[a]);
  };
  for (int i = 1; i < model.numBodies(); ++i) connect(i, model.joints()[i].parent);
  for (const Closure& closure : model.closures())
    if (closure.kind != ClosureKind::Coupler) connect(closure.body1, closure.body2);
  return links;
}

// Per body the first of those that it is welded to: a loop that was cut within a rod.
std::vector<int> findParts(const Model& model) {
  std::vector<int> part(model.numBodies());
  std::iota(part.begin(), part.end(), 0);
  for (const Closure& closure : model.closures()) {
    if (closure.kind != ClosureKind::Weld6D) continue;
    const auto [first, second] = std::minmax(part[closure.body1], part[closure.body2]);
    std::replace(part.begin(), part.end(), int(second), int(first));
  }
  return part;
}

// What is reached from a body through bodies that `passes` lets through.
template <typename Passes>
std::set<int> reach(const Links& links, int start, const Passes& passes) {
  std::set<int> reached = {start};
  std::vector<int> next = {start};
  while (!next.empty()) {
    const int body = next.back();
    next.pop_back();
    if (body != start && !passes(body)) continue;
    for (int other : links[body])
      if (reached.insert(other).second) next.push_back(other);
  }
  return reached;
}

// Per body the number of its leg, -1 for the trunk, and for what carries no foot.
std::vector<int> findLegs(const Model& model, const Links& links) {
  std::set<int> feet;
  for (const ContactFrame& contact : model.contacts()) feet.insert(contact.body);
  const auto isTrunk = [&](int body) {
    return body == 0 ||
           std::count_if(feet.begin(), feet.end(), [&](int foot) { return model.isAncestorOrSelf(body, foot); }) > 1;
  };
  std::vector<int> legs(model.numBodies(), -1);
  int count = 0;
  for (int foot : feet) {
    if (isTrunk(foot) || legs[foot] >= 0) continue;
    for (int body : reach(links, foot, [&](int b) { return !isTrunk(b); }))
      if (!isTrunk(body)) legs[body] = count;
    ++count;
  }
  return legs;
}

}  // namespace

std::vector<ShapePair> listShapePairs(const Model& model) {
  std::vector<int> part(model.numBodies());
  std::iota(part.begin(), part.end(), 0);
  const std::vector<int> legs = findLegs(model, listLinks(model, part));
  part = findParts(model);
  const Links links = listLinks(model, part);
  std::vector<bool> has_shape(model.numBodies(), false);
  for (const Shape& shape : model.shapes()) has_shape[part[shape.body]] = true;
  std::vector<std::set<int>> neighbours(model.numBodies());
  for (int i = 0; i < model.numBodies(); ++i)
    if (has_shape[i]) neighbours[i] = reach(links, i, [&](int other) { return other != 0 && !has_shape[other]; });
  std::vector<ShapePair> pairs;
  for (int a = 0; a < static_cast<int>(model.shapes().size()); ++a)
    for (int b = 0; b < a; ++b) {
      const int body_a = model.shapes()[a].body, body_b = model.shapes()[b].body;
      if (neighbours[part[body_a]].count(part[body_b])) continue;
      pairs.push_back({a, b, legs[body_a] >= 0 && legs[body_b] >= 0 && legs[body_a] != legs[body_b]});
    }
  return pairs;
}

NearestPair findNearestPair(const Model& model, const std::vector<SE3>& X_WB, const std::vector<ShapePair>& pairs) {
  NearestPair nearest;
  for (size_t i = 0; i < pairs.size(); ++i) {
    const Shape &a = model.shapes()[pairs[i].a], &b = model.shapes()[pairs[i].b];
    const Cell cell_a = makeCell(a, X_WB[a.body]), cell_b = makeCell(b, X_WB[b.body]);
    const double reach = a.half.norm() + a.radius + b.half.norm() + b.radius;
    if (nearest.pair >= 0 && (cell_a.center - cell_b.center).norm() - reach > nearest.distance.distance) continue;
    const ShapeDistance distance = calcCellDistance(cell_a, cell_b);
    if (nearest.pair < 0 || distance.distance < nearest.distance.distance) nearest = {static_cast<int>(i), distance};
  }
  return nearest;
}

}  // namespace bielle
