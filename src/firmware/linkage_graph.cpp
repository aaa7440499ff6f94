#include "firmware/linkage_graph.h"

#include <algorithm>
#include <map>
#include <numeric>

#include "bielle/dynamics/kinematics.h"
#include "bielle/model/error.h"
#include "math/so3.h"
#include "model/joint.h"
#include "model/listing.h"

namespace bielle::firmware {
namespace {

constexpr double kLeastAngle = 0.1;  // rad, between axes that cross
constexpr double kMeeting = 1e-9;    // m, between lines that meet

// The end of a rod (or of half a strut) at an edge: its point in a group.
Vector3d getPoint(const Edge& edge, int group, double along) {
  return edge.in(group).act(edge.hasCentre() ? Vector3d::Zero() : Vector3d(along * edge.axis));
}

bool isEnd(const Edge& edge) { return !edge.needed && (edge.hasCentre() || edge.isHinge()); }

}  // namespace

LinkageGraph::LinkageGraph(const Model& model, const Linkage& linkage, ConstVectorRef q, bool planar_rods)
    : model_(model),
      linkage_(linkage),
      cluster_(*linkage.cluster),
      loops_(cluster_.model),
      ws_(loops_),
      planar_(planar_rods) {
  VectorXd own(loops_.nq());
  gatherConfiguration(model, cluster_, q, own);
  updatePositions(loops_, ws_, own);
  q_ = own;
  markNeeded();
  weld();
  addEdges();
  joinHinges();
  while (removeRod()) {
  }
  for (const Closure& closure : loops_.closures())
    if (closure.kind == ClosureKind::Distance)
      distances.push_back({getGroup(closure.body1), getGroup(closure.body2), (place(closure.body1) * closure.X_B1).p,
                           (place(closure.body2) * closure.X_B2).p, closure.length * closure.length, 0, -1,
                           closure.name});
  plant();
}

int LinkageGraph::toCluster(int joint) const {
  const auto at = std::find(cluster_.joints.begin(), cluster_.joints.end(), joint);
  return at == cluster_.joints.end() ? -1 : static_cast<int>(at - cluster_.joints.begin()) + 1;
}

void LinkageGraph::markNeeded() {
  for (int i : linkage_.joints) needed_.insert(toCluster(i));
  for (int m : linkage_.motors) needed_.insert(toCluster(model_.motors()[static_cast<size_t>(m)].joint));
  for (const Closure& closure : loops_.closures())
    for (const CouplerTerm& term : closure.terms) needed_.insert(term.joint);
  for (const JointForce& force : model_.jointForces())
    if (const int i = toCluster(force.joint); i > 0 && (force.stiffness != 0 || force.preload != 0)) needed_.insert(i);
}

// Bodies that are welded become one group, with the frame of the first of them.
void LinkageGraph::weld() {
  group_.resize(static_cast<size_t>(loops_.numBodies()));
  places_.resize(group_.size());
  std::iota(group_.begin(), group_.end(), 0);
  for (const Closure& closure : loops_.closures()) {
    if (closure.kind != ClosureKind::Weld6D) continue;
    const int a = getGroup(closure.body1), b = getGroup(closure.body2);
    if (a == b) continue;
    const SE3 X_ab = place(closure.body1) * closure.X_B1 * (place(closure.body2) * closure.X_B2).inverse();
    const SE3 X = a < b ? X_ab : X_ab.inverse();
    for (size_t body = 0; body < group_.size(); ++body)
      if (group_[body] == std::max(a, b)) {
        group_[body] = std::min(a, b);
        places_[body] = X * places_[body];
      }
  }
}

void LinkageGraph::addEdge(Edge edge, int body1, const SE3& X_1, int body2, const SE3& X_2) {
  edge.a = getGroup(body1);
  edge.b = getGroup(body2);
  edge.X_a = place(body1) * X_1;
  edge.X_b = place(body2) * X_2;
  edges.push_back(std::move(edge));
}

void LinkageGraph::addEdges() {
  for (int i = 1; i < loops_.numBodies(); ++i) {
    const Joint& joint = loops_.joints()[static_cast<size_t>(i)];
    if (joint.nv == 0) continue;
    Edge edge;
    edge.name = joint.name;
    edge.kind = joint.kind;
    edge.axis = joint.axis;
    edge.axis2 = joint.axis2;
    edge.q = q_.segment(joint.idx_q, joint.nq);
    edge.joint = i;
    edge.needed = needed_.count(i) > 0;
    addEdge(std::move(edge), joint.parent, joint.X_PJ, i, SE3());
  }
  for (const Closure& closure : loops_.closures()) {
    Edge edge;
    edge.name = closure.name;
    edge.axis = closure.axis;
    const SE3 X_12 = (ws_.X_WB[static_cast<size_t>(closure.body1)] * closure.X_B1)
                         .inverseTimes(ws_.X_WB[static_cast<size_t>(closure.body2)] * closure.X_B2);
    if (closure.kind == ClosureKind::Ball3D) {
      edge.kind = JointKind::Spherical;
      edge.q = Eigen::Quaterniond(X_12.R).coeffs();
    } else if (closure.kind == ClosureKind::Hinge5D) {
      edge.kind = JointKind::Revolute;
      edge.q = VectorXd::Constant(1, closure.axis.dot(log3(X_12.R)));
    } else if (closure.kind == ClosureKind::Slider) {
      edge.kind = JointKind::Prismatic;
      edge.q = VectorXd::Constant(1, closure.axis.dot(X_12.p));
    } else {
      continue;
    }
    addEdge(std::move(edge), closure.body1, closure.X_B1, closure.body2, closure.X_B2);
  }
}

std::vector<int> LinkageGraph::listEdges(int group) const {
  std::vector<int> out;
  for (size_t e = 0; e < edges.size(); ++e)
    if (edges[e].used && edges[e].a != edges[e].b && (edges[e].a == group || edges[e].b == group))
      out.push_back(static_cast<int>(e));
  return out;
}

// Centres of mass of its bodies, in the group.
void LinkageGraph::visitMasses(int group, const std::function<void(const Vector3d& com, double mass)>& visit) const {
  for (int body = 1; body < loops_.numBodies(); ++body) {
    if (getGroup(body) != group) continue;
    const Inertia& inertia =
        model_.bodies()[static_cast<size_t>(cluster_.joints[static_cast<size_t>(body) - 1])].inertia;
    if (inertia.mass != 0) visit(place(body).act(inertia.com), inertia.mass);
  }
}

// What else holds a body: a distance, a point spring.
bool LinkageGraph::isHeldOtherwise(int group) const {
  for (const RodDistance& distance : distances)
    if (distance.a == group || distance.b == group) return true;
  for (const Closure& closure : loops_.closures())
    if (closure.kind == ClosureKind::Distance && (getGroup(closure.body1) == group || getGroup(closure.body2) == group))
      return true;
  for (const PointSpring& spring : model_.pointSprings())
    for (int body : {spring.body1, spring.body2})
      if (const int own = toCluster(body); own > 0 && getGroup(own) == group) return true;
  return false;
}

// A body with nothing but two hinges whose axes meet is the cross of a universal joint. With both frames moved to where they meet,
// and R_12 of the second hinge in the first one, its motion is R(n_1, q_1) R(R_12 n_2, q_2) R_12.
void LinkageGraph::joinHinges() {
  for (int group = 1; group < loops_.numBodies(); ++group) {
    if (getGroup(group) != group || getGroup(0) == group || isHeldOtherwise(group)) continue;
    const std::vector<int> ends = listEdges(group);
    if (ends.size() != 2) continue;
    Edge &one = edges[static_cast<size_t>(ends[0])], &two = edges[static_cast<size_t>(ends[1])];
    const int a = one.other(group), b = two.other(group);
    if (!isEnd(one) || !isEnd(two) || !one.isHinge() || !two.isHinge() || a == b) continue;
    const SE3 X_12 = one.in(group).inverse() * two.in(group);
    const Vector3d axis2 = X_12.R * two.axis, normal = one.axis.cross(axis2);
    if (normal.norm() < kLeastAngle || std::abs(X_12.p.dot(normal)) > kMeeting) continue;
    Edge both;
    both.name = one.name + "_" + two.name;
    both.kind = JointKind::Universal;
    both.axis = one.a == a ? one.axis : Vector3d(-one.axis);
    both.axis2 = two.b == b ? axis2 : Vector3d(-axis2);
    both.q = Eigen::Vector2d(one.q[0], two.q[0]);
    both.a = a;
    both.b = b;
    const double square = normal.squaredNorm();
    both.X_a = one.in(a);
    both.X_a.p = one.in(a).act(X_12.p.cross(axis2).dot(normal) / square * one.axis);
    both.X_b.R = two.in(b).R * X_12.R.transpose();
    both.X_b.p = two.in(b).act(X_12.p.cross(one.axis).dot(normal) / square * two.axis);
    const Vector3d centre = one.in(group).act(X_12.p.cross(axis2).dot(normal) / square * one.axis);
    visitMasses(group, [&](const Vector3d& com, double mass) {
      ignored_offset = std::max(ignored_offset, (com - centre).norm());
      masses.push_back({a, both.X_a.p, mass});
    });
    gone_.insert(group);
    one.used = two.used = false;
    edges.push_back(both);
  }
}

// Of hinges with parallel axes, points at the same height; of a hinge and a centre, as high as the centre.
// \param X_12  of the group at edge 2 in that at edge 1
bool LinkageGraph::findHeights(const Edge& one, int group1, const Edge& two, int group2, const SE3& X_12, double& h1,
                               double& h2) const {
  h1 = h2 = 0;
  if (!one.isHinge() && !two.isHinge()) return one.isBall() || two.isBall();
  if (!planar_) return false;
  const SE3 X_1 = one.in(group1), X_2 = X_12 * two.in(group2);
  if (one.isHinge() && two.isHinge() && (X_1.R * one.axis).cross(X_2.R * two.axis).norm() > 1e-9) return false;
  if (one.isHinge())
    h1 = (X_1.R * one.axis).dot(X_2.p - X_1.p);
  else
    h2 = (X_2.R * two.axis).dot(X_1.p - X_2.p);
  return true;
}

// Whether all other bodies still hang together by joints when some groups are gone.
bool LinkageGraph::isConnectedWithout(const std::vector<int>& without, const std::set<int>& groups) const {
  std::set<int> reached = {getGroup(0)};
  for (bool found = true; found;) {
    found = false;
    for (size_t e = 0; e < edges.size(); ++e) {
      const Edge& edge = edges[e];
      if (!edge.used || contains(without, e) || reached.count(edge.a) == reached.count(edge.b)) continue;
      reached.insert(edge.a);
      reached.insert(edge.b);
      found = true;
    }
  }
  for (int group : group_)
    if (!reached.count(group) && !groups.count(group) && !gone_.count(group)) return false;
  return true;
}

bool LinkageGraph::removeRod() {
  for (int group = 1; group < loops_.numBodies(); ++group) {
    if (getGroup(group) != group || getGroup(0) == group || isHeldOtherwise(group)) continue;
    const std::vector<int> ends = listEdges(group);
    if (ends.size() != 2) continue;
    const Edge &one = edges[static_cast<size_t>(ends[0])], &two = edges[static_cast<size_t>(ends[1])];
    if (removePlainRod(group, ends, one, two) || removeStrut(group, ends)) return true;
  }
  return false;
}

bool LinkageGraph::removePlainRod(int group, const std::vector<int>& ends, const Edge& one, const Edge& two) {
  double h1, h2;
  if (!isEnd(one) || !isEnd(two) || one.other(group) == two.other(group)) return false;
  if (!findHeights(one, group, two, group, SE3(), h1, h2)) return false;
  RodDistance distance{one.other(group), two.other(group), getPoint(one, one.other(group), h1),
                       getPoint(two, two.other(group), h2)};
  const Vector3d p1 = getPoint(one, group, h1), p2 = getPoint(two, group, h2);
  distance.k0 = (p2 - p1).squaredNorm();
  if (distance.k0 < 1e-12 || !isConnectedWithout(ends, {group})) return false;
  finishRod(distance, ends, {{group, SE3()}}, p1, p2, loops_.joints()[static_cast<size_t>(group)].name);
  return true;
}

// Two bodies with a slide between them.
bool LinkageGraph::removeStrut(int group, const std::vector<int>& ends) {
  for (int k = 0; k < 2; ++k) {
    const int s = ends[static_cast<size_t>(k)], e1 = ends[static_cast<size_t>(1 - k)];
    const Edge &slide = edges[static_cast<size_t>(s)], &one = edges[static_cast<size_t>(e1)];
    if (slide.kind != JointKind::Prismatic || !isEnd(one)) continue;
    const int far = slide.other(group);
    const std::vector<int> others = listEdges(far);
    if (far == getGroup(0) || others.size() != 2 || isHeldOtherwise(far)) continue;
    const int e2 = others[0] == s ? others[1] : others[0];
    const Edge& two = edges[static_cast<size_t>(e2)];
    if (!isEnd(two) || one.other(group) == two.other(far)) continue;
    // Of `far` in `group`, with the slide at x.
    const double sign = slide.a == group ? 1 : -1;
    const Vector3d direction = sign * (slide.in(group).R * slide.axis);
    SE3 X = slide.in(group)*slide.in(far).inverse();
    const double x = slide.q[0];
    double h1, h2;
    SE3 there = X;
    there.p += x * direction;
    if (!findHeights(one, group, two, far, there, h1, h2) || !isConnectedWithout({e1, e2, s}, {group, far})) continue;
    RodDistance distance{one.other(group), two.other(far), getPoint(one, one.other(group), h1),
                         getPoint(two, two.other(far), h2)};
    const Vector3d p1 = getPoint(one, group, h1), p2 = X.act(getPoint(two, far, h2));
    distance.k0 = (p2 - p1).squaredNorm();
    distance.k1 = (p2 - p1).dot(direction);
    distance.slide = s;
    finishRod(distance, {e1, e2, s}, {{group, SE3()}, {far, there}}, p1, p2 + x * direction,
              loops_.joints()[static_cast<size_t>(group)].name);
    return true;
  }
  return false;
}

// \param parts  its bodies' groups, placed in that of the points p1 and p2
void LinkageGraph::finishRod(RodDistance distance, const std::vector<int>& ends,
                             const std::vector<std::pair<int, SE3>>& parts, const Vector3d& p1, const Vector3d& p2,
                             const std::string& name) {
  for (int e : ends) edges[static_cast<size_t>(e)].used = false;
  distance.name = name;
  rods.push_back(name);
  // Weights of the bodies on the line. A strut is split where its mass is at the reference.
  const Vector3d line = p2 - p1;
  for (const auto& [group, X] : parts)
    visitMasses(group, [&, &X = X](const Vector3d& com, double mass) {
      const Vector3d c = X.act(com) - p1;
      const double share = c.dot(line) / line.squaredNorm();
      ignored_offset = std::max(ignored_offset, (c - share * line).norm());
      masses.push_back({distance.a, distance.pa, mass * (1 - share)});
      masses.push_back({distance.b, distance.pb, mass * share});
    });
  for (const auto& [group, X] : parts) gone_.insert(group);
  distances.push_back(distance);
}

// The spanning tree: needed coordinates first, then the fewest.
void LinkageGraph::plant() {
  std::vector<size_t> order(edges.size());
  std::iota(order.begin(), order.end(), 0);
  const auto rank = [&](size_t e) { return edges[e].needed ? 0 : getNv(edges[e].kind); };
  std::stable_sort(order.begin(), order.end(), [&](size_t x, size_t y) { return rank(x) < rank(y); });
  std::vector<int> part(static_cast<size_t>(loops_.numBodies()));
  std::iota(part.begin(), part.end(), 0);
  const std::function<int(int)> find = [&](int g) {
    return part[static_cast<size_t>(g)] == g ? g : part[static_cast<size_t>(g)] = find(part[static_cast<size_t>(g)]);
  };
  for (size_t e : order) {
    Edge& edge = edges[e];
    if (!edge.used) continue;
    const int a = find(edge.a), b = find(edge.b);
    if (a == b) {
      if (edge.needed)
        throw InputError(model_.name(), "joint '" + edge.name + "'",
                         "motors, serial joints and couplers alone close a loop through it",
                         "cut that loop at another joint, or drive it without this one");
      closing.push_back(static_cast<int>(e));
      continue;
    }
    part[static_cast<size_t>(a)] = b;
    tree.push_back(static_cast<int>(e));
  }
}

std::vector<Step> LinkageGraph::findPath(int from, int to) const {
  std::map<int, std::pair<int, Step>> reached;  // from where
  std::vector<int> front = {from};
  reached[from] = {from, {-1, true}};
  while (!reached.count(to)) {
    std::vector<int> next;
    for (int group : front)
      for (int e : tree) {
        const Edge& edge = edges[static_cast<size_t>(e)];
        if (edge.a != group && edge.b != group) continue;
        const int there = edge.other(group);
        if (reached.count(there)) continue;
        reached[there] = {group, {e, edge.a == group}};
        next.push_back(there);
      }
    if (next.empty())
      throw InputError(model_.name(), "linkage of '" + linkage_.output + "'",
                       "its bodies do not hang together without its rods", "report this robot");
    front = std::move(next);
  }
  std::vector<Step> path;
  for (int at = to; at != from; at = reached[at].first) path.push_back(reached[at].second);
  std::reverse(path.begin(), path.end());
  return path;
}
Edge& LinkageGraph::findEdge(int joint) {
  for (Edge& edge : edges)
    if (edge.joint == joint) return edge;
  throw InputError(model_.name(), "linkage of '" + linkage_.output + "'", "a joint is missing", "report this robot");
}

}  // namespace bielle::firmware
