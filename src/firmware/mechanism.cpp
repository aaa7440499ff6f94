#include "firmware/mechanism.h"

#include <algorithm>
#include <numeric>
#include <set>

#include "bielle/dynamics/kinematics.h"
#include "bielle/model/error.h"
#include "dynamics/reduction.h"
#include "math/so3.h"
#include "model/joint.h"
#include "model/listing.h"

namespace bielle::firmware {
namespace {

using SE3s = SE3Of<Scalar>;

// Rounding of placements, which would cost operations.
double snap(double x) {
  for (double exact : {0.0, 1.0, -1.0})
    if (std::abs(x - exact) < 4e-16) return exact;
  return x;
}
template <typename Matrix>
auto toScalars(const Matrix& x) {
  return x.unaryExpr([](double entry) { return Scalar(snap(entry)); }).eval();
}
SE3s toScalars(const SE3& X) { return {toScalars(X.R), toScalars(X.p)}; }

Scalar dot(const Vector3s& a, const Vector3s& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Vector3s cross(const Vector3s& a, const Vector3s& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

Eigen::Matrix<double, 3, 2> makeNormals(const Vector3d& axis) {
  Eigen::Index least = 0;
  axis.cwiseAbs().minCoeff(&least);
  Eigen::Matrix<double, 3, 2> out;
  out.col(0) = axis.cross(Vector3d::Unit(least)).normalized();
  out.col(1) = axis.cross(out.col(0));
  return out;
}

Matrix3s rotate(const Vector3d& axis, const Scalar& angle) {
  const Scalar c = cos(angle), s = sin(angle);
  const Matrix3d n = axis * axis.transpose(), cross = skew(axis);
  Matrix3s R;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      R(i, j) = Scalar(snap(n(i, j))) + Scalar(snap((i == j) - n(i, j))) * c + Scalar(snap(cross(i, j))) * s;
  return R;
}

// A joint between two bodies: of the tree, or a closure.
struct Edge {
  std::string name;
  JointKind kind = JointKind::Fixed;
  int a = 0, b = 0;  // groups of welded bodies
  SE3 X_a, X_b;      // frames in the groups
  Vector3d axis, axis2;
  VectorXd q;                    // at the reference
  std::vector<int> coordinates;  // of those in use
  int joint = -1;                // of the model of the cluster
  bool needed = false;           // its coordinate is that of a motor, a serial joint, a coupler or a spring
  bool used = true;

  bool isBall() const { return kind == JointKind::Spherical; }
  bool isHinge() const { return kind == JointKind::Revolute || kind == JointKind::Continuous; }
  bool hasCentre() const { return isBall() || kind == JointKind::Universal; }
  int other(int group) const { return group == a ? b : a; }
  const SE3& in(int group) const { return group == a ? X_a : X_b; }
};

// A step from group to group along an edge.
struct Step {
  int edge;
  bool forward;  // from a to b
};

class Reducer {
 public:
  Reducer(const Model& model, const Linkage& linkage, ConstVectorRef q, bool planar_rods)
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
  }

  Mechanism reduce() {
    markNeeded();
    weld();
    addEdges();
    while (removeRod()) {
    }
    plant();
    number();
    addLoops();
    addDistances();
    addCouplers();
    out_.potential = sumEnergy();
    return std::move(out_);
  }

 private:
  int toCluster(int joint) const {
    const auto at = std::find(cluster_.joints.begin(), cluster_.joints.end(), joint);
    return at == cluster_.joints.end() ? -1 : static_cast<int>(at - cluster_.joints.begin()) + 1;
  }

  void markNeeded() {
    for (int i : linkage_.joints) needed_.insert(toCluster(i));
    for (int m : linkage_.motors) needed_.insert(toCluster(model_.motors()[static_cast<size_t>(m)].joint));
    for (const Closure& closure : loops_.closures())
      for (const CouplerTerm& term : closure.terms) needed_.insert(term.joint);
    for (const JointForce& force : model_.jointForces())
      if (const int i = toCluster(force.joint); i > 0 && (force.stiffness != 0 || force.preload != 0))
        needed_.insert(i);
  }

  int findRoot(int body) const { return group_[static_cast<size_t>(body)]; }
  // Placement of a body in its group.
  const SE3& place(int body) const { return places_[static_cast<size_t>(body)]; }

  // Bodies that are welded become one group, with the frame of the first of them.
  void weld() {
    group_.resize(static_cast<size_t>(loops_.numBodies()));
    places_.resize(group_.size());
    std::iota(group_.begin(), group_.end(), 0);
    for (const Closure& closure : loops_.closures()) {
      if (closure.kind != ClosureKind::Weld6D) continue;
      const int a = findRoot(closure.body1), b = findRoot(closure.body2);
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

  void addEdge(Edge edge, int body1, const SE3& X_1, int body2, const SE3& X_2) {
    edge.a = findRoot(body1);
    edge.b = findRoot(body2);
    edge.X_a = place(body1) * X_1;
    edge.X_b = place(body2) * X_2;
    edges_.push_back(std::move(edge));
  }

  void addEdges() {
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

  std::vector<int> listEdges(int group) const {
    std::vector<int> out;
    for (size_t e = 0; e < edges_.size(); ++e)
      if (edges_[e].used && edges_[e].a != edges_[e].b && (edges_[e].a == group || edges_[e].b == group))
        out.push_back(static_cast<int>(e));
    return out;
  }

  struct Distance {
    int a, b;               // groups
    Vector3d pa, pb;        // in them
    double k0 = 0, k1 = 0;  // D^2 = k0 + 2 k1 s + s^2 with the coordinate of a slide; without one k0
    int slide = -1;         // edge
    std::string name{};
  };

  // What else holds a body: a distance, a point spring.
  bool isHeldOtherwise(int group) const {
    for (const Distance& distance : distances_)
      if (distance.a == group || distance.b == group) return true;
    for (const Closure& closure : loops_.closures())
      if (closure.kind == ClosureKind::Distance &&
          (findRoot(closure.body1) == group || findRoot(closure.body2) == group))
        return true;
    for (const PointSpring& spring : model_.pointSprings())
      for (int body : {spring.body1, spring.body2})
        if (const int own = toCluster(body); own > 0 && findRoot(own) == group) return true;
    return false;
  }

  // The end of a rod (or of half a strut) at an edge: its point in a group.
  static Vector3d getPoint(const Edge& edge, int group, double along) {
    return edge.in(group).act(edge.hasCentre() ? Vector3d::Zero() : Vector3d(along * edge.axis));
  }

  // Of hinges with parallel axes, points at the same height; of a hinge and a centre, as high as the centre.
  // \param X_12  of the group at edge 2 in that at edge 1
  bool findHeights(const Edge& one, int group1, const Edge& two, int group2, const SE3& X_12, double& h1,
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
  bool isConnectedWithout(const std::vector<int>& edges, const std::set<int>& groups) const {
    std::set<int> reached = {findRoot(0)};
    for (bool found = true; found;) {
      found = false;
      for (size_t e = 0; e < edges_.size(); ++e) {
        const Edge& edge = edges_[e];
        if (!edge.used || contains(edges, e) || reached.count(edge.a) == reached.count(edge.b)) continue;
        reached.insert(edge.a);
        reached.insert(edge.b);
        found = true;
      }
    }
    for (int group : group_)
      if (!reached.count(group) && !groups.count(group) && !gone_.count(group)) return false;
    return true;
  }

  bool isEnd(const Edge& edge) const { return !edge.needed && (edge.hasCentre() || edge.isHinge()); }

  bool removeRod() {
    for (int group = 1; group < loops_.numBodies(); ++group) {
      if (findRoot(group) != group || findRoot(0) == group || isHeldOtherwise(group)) continue;
      const std::vector<int> ends = listEdges(group);
      if (ends.size() != 2) continue;
      const Edge &one = edges_[static_cast<size_t>(ends[0])], &two = edges_[static_cast<size_t>(ends[1])];
      if (removePlainRod(group, ends, one, two) || removeStrut(group, ends)) return true;
    }
    return false;
  }

  bool removePlainRod(int group, const std::vector<int>& ends, const Edge& one, const Edge& two) {
    double h1, h2;
    if (!isEnd(one) || !isEnd(two) || one.other(group) == two.other(group)) return false;
    if (!findHeights(one, group, two, group, SE3(), h1, h2)) return false;
    Distance distance{one.other(group), two.other(group), getPoint(one, one.other(group), h1),
                      getPoint(two, two.other(group), h2)};
    const Vector3d p1 = getPoint(one, group, h1), p2 = getPoint(two, group, h2);
    distance.k0 = (p2 - p1).squaredNorm();
    if (distance.k0 < 1e-12 || !isConnectedWithout(ends, {group})) return false;
    finishRod(distance, ends, {{group, SE3()}}, p1, p2, loops_.joints()[static_cast<size_t>(group)].name);
    return true;
  }

  // Two bodies with a slide between them.
  bool removeStrut(int group, const std::vector<int>& ends) {
    for (int k = 0; k < 2; ++k) {
      const int s = ends[static_cast<size_t>(k)], e1 = ends[static_cast<size_t>(1 - k)];
      const Edge &slide = edges_[static_cast<size_t>(s)], &one = edges_[static_cast<size_t>(e1)];
      if (slide.kind != JointKind::Prismatic || !isEnd(one)) continue;
      const int far = slide.other(group);
      const std::vector<int> others = listEdges(far);
      if (far == findRoot(0) || others.size() != 2 || isHeldOtherwise(far)) continue;
      const int e2 = others[0] == s ? others[1] : others[0];
      const Edge& two = edges_[static_cast<size_t>(e2)];
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
      Distance distance{one.other(group), two.other(far), getPoint(one, one.other(group), h1),
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
  void finishRod(Distance distance, const std::vector<int>& ends, const std::vector<std::pair<int, SE3>>& parts,
                 const Vector3d& p1, const Vector3d& p2, const std::string& name) {
    for (int e : ends) edges_[static_cast<size_t>(e)].used = false;
    distance.name = name;
    out_.rods.push_back(name);
    // Weights of the bodies on the line. A strut is split where its mass is at the reference.
    const Vector3d line = p2 - p1;
    for (const auto& [group, X] : parts)
      for (int body = 1; body < loops_.numBodies(); ++body) {
        if (findRoot(body) != group) continue;
        const Inertia& inertia =
            model_.bodies()[static_cast<size_t>(cluster_.joints[static_cast<size_t>(body) - 1])].inertia;
        if (inertia.mass == 0) continue;
        const Vector3d c = (X * place(body)).act(inertia.com) - p1;
        const double share = c.dot(line) / line.squaredNorm();
        out_.ignored_offset = std::max(out_.ignored_offset, (c - share * line).norm());
        masses_.push_back({distance.a, distance.pa, inertia.mass * (1 - share)});
        masses_.push_back({distance.b, distance.pb, inertia.mass * share});
      }
    for (const auto& [group, X] : parts) gone_.insert(group);
    distances_.push_back(distance);
  }

  // The spanning tree: needed coordinates first, then the fewest.
  void plant() {
    std::vector<size_t> order(edges_.size());
    std::iota(order.begin(), order.end(), 0);
    const auto rank = [&](size_t e) { return edges_[e].needed ? 0 : getNv(edges_[e].kind); };
    std::stable_sort(order.begin(), order.end(), [&](size_t x, size_t y) { return rank(x) < rank(y); });
    std::vector<int> part(static_cast<size_t>(loops_.numBodies()));
    std::iota(part.begin(), part.end(), 0);
    const std::function<int(int)> find = [&](int g) {
      return part[static_cast<size_t>(g)] == g ? g : part[static_cast<size_t>(g)] = find(part[static_cast<size_t>(g)]);
    };
    for (size_t e : order) {
      Edge& edge = edges_[e];
      if (!edge.used) continue;
      const int a = find(edge.a), b = find(edge.b);
      if (a == b) {
        if (edge.needed)
          throw InputError(model_.name(), "joint '" + edge.name + "'",
                           "motors, serial joints and couplers alone close a loop through it",
                           "cut that loop at another joint, or drive it without this one");
        closing_.push_back(static_cast<int>(e));
        continue;
      }
      part[static_cast<size_t>(a)] = b;
      tree_.push_back(static_cast<int>(e));
    }
  }

  // The way from one group to another along the tree.
  std::vector<Step> findPath(int from, int to) const {
    std::map<int, std::pair<int, Step>> reached;  // from where
    std::vector<int> front = {from};
    reached[from] = {from, {-1, true}};
    while (!reached.count(to)) {
      std::vector<int> next;
      for (int group : front)
        for (int e : tree_) {
          const Edge& edge = edges_[static_cast<size_t>(e)];
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

  int addCoordinate(const std::string& name, double reference) {
    out_.coordinates.push_back({name, reference});
    return static_cast<int>(out_.coordinates.size()) - 1;
  }

  void use(Edge& edge) {
    if (!edge.coordinates.empty()) return;
    for (Eigen::Index k = 0; k < edge.q.size(); ++k)
      edge.coordinates.push_back(
          addCoordinate(edge.name + (edge.q.size() > 1 ? "." + std::to_string(k) : ""), edge.q[k]));
    if (edge.kind != JointKind::Spherical && edge.kind != JointKind::FreeFlyer) return;
    Scalar norm = -0.5;  // of the quaternion
    Equation unit;
    for (size_t k = edge.coordinates.size() - 4; k < edge.coordinates.size(); ++k) {
      const Scalar x = makeInput(edge.coordinates[k]);
      norm += 0.5 * (x * x);
      unit.coordinates.push_back(edge.coordinates[k]);
    }
    unit.rows = {norm};
    out_.equations.push_back(unit);
  }
  void use(const std::vector<Step>& path) {
    for (const Step& step : path) use(edges_[static_cast<size_t>(step.edge)]);
  }
  Edge& findEdge(int joint) {
    for (Edge& edge : edges_)
      if (edge.joint == joint) return edge;
    throw InputError(model_.name(), "linkage of '" + linkage_.output + "'", "a joint is missing", "report this robot");
  }

  // Joints and motors come first. A motor that sits on a joint of the output is a copy of it.
  void number() {
    out_.size = linkage_.size();
    for (int i : linkage_.joints) use(findEdge(toCluster(i)));
    for (size_t m = 0; m < linkage_.motors.size(); ++m) {
      Edge& edge = findEdge(toCluster(model_.motors()[static_cast<size_t>(linkage_.motors[m])].joint));
      if (edge.coordinates.empty()) {
        use(edge);
        continue;
      }
      const int copy = addCoordinate(edge.name, edge.q[0]), joint = edge.coordinates[0];
      Equation same;
      same.rows = {makeInput(copy) - makeInput(joint)};
      same.coordinates = {joint, copy};
      same.solved[copy].roots = {makeInput(joint)};
      same.solved[joint].roots = {makeInput(copy)};
      out_.equations.push_back(same);
    }
  }

  SE3s calcMotion(const Edge& edge) const {
    const auto q = [&](size_t k) { return makeInput(edge.coordinates[k]); };
    const auto turn = [&](size_t k) {
      const Scalar x = q(k), y = q(k + 1), z = q(k + 2), w = q(k + 3);
      Matrix3s R;
      R << 1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w),  //
          2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w),   //
          2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y);
      return R;
    };
    const Vector3s zero = Vector3s::Zero();
    switch (edge.kind) {
      case JointKind::Fixed:
        break;
      case JointKind::Revolute:
      case JointKind::Continuous:
        return {rotate(edge.axis, q(0)), zero};
      case JointKind::Prismatic:
        return {Matrix3s::Identity(), toScalars(edge.axis) * q(0)};
      case JointKind::Spherical:
        return {turn(0), zero};
      case JointKind::Universal:
        return {rotate(edge.axis, q(0)) * rotate(edge.axis2, q(1)), zero};
      case JointKind::Planar: {
        const auto B = toScalars(makePlaneBasis(edge.axis));
        return {rotate(edge.axis, q(2)), B.col(0) * q(0) + B.col(1) * q(1)};
      }
      case JointKind::FreeFlyer:
        return {turn(3), Vector3s(q(0), q(1), q(2))};
    }
    return {};
  }

  // Placement of the group at the end of a path in that at its begin.
  SE3s calcPlacement(const std::vector<Step>& path) const {
    SE3s X;
    for (const Step& step : path) {
      const Edge& edge = edges_[static_cast<size_t>(step.edge)];
      const SE3s J = calcMotion(edge);
      X = step.forward ? X * toScalars(edge.X_a) * J * toScalars(edge.X_b.inverse())
                       : X * toScalars(edge.X_b) * J.inverse() * toScalars(edge.X_a.inverse());
    }
    return X;
  }
  // A point at the end of a path in the group at its begin, with fewer operations.
  Vector3s carryPoint(const std::vector<Step>& path, const Vector3s& point) const {
    Vector3s p = point;
    for (size_t i = path.size(); i-- > 0;) {
      const Edge& edge = edges_[static_cast<size_t>(path[i].edge)];
      const SE3s J = calcMotion(edge);
      p = path[i].forward ? toScalars(edge.X_a).act(J.act(toScalars(edge.X_b.inverse()).act(p)))
                          : toScalars(edge.X_b).act(J.inverse().act(toScalars(edge.X_a.inverse()).act(p)));
    }
    return p;
  }
  static std::vector<Step> reverse(std::vector<Step> path) {
    std::reverse(path.begin(), path.end());
    for (Step& step : path) step.forward = !step.forward;
    return path;
  }

  std::vector<int> listCoordinates(const std::vector<Step>& path) const {
    std::vector<int> out;
    for (const Step& step : path)
      for (int c : edges_[static_cast<size_t>(step.edge)].coordinates) out.push_back(c);
    return out;
  }

  // Rows of the joints outside the tree, in the group half way.
  void addLoops() {
    for (int e : closing_) {
      const Edge& edge = edges_[static_cast<size_t>(e)];
      const std::vector<Step> path = findPath(edge.a, edge.b);
      use(path);
      const auto half = path.begin() + static_cast<std::ptrdiff_t>(path.size() / 2);
      const std::vector<Step> to_a = reverse({path.begin(), half}), to_b(half, path.end());
      const SE3s X_1 = calcPlacement(to_a) * toScalars(edge.X_a), X_2 = calcPlacement(to_b) * toScalars(edge.X_b);
      const Vector3s p = X_1.p - X_2.p;
      const auto normals = toScalars(makeNormals(edge.axis));
      const auto along = [&](const Vector3s& n1, const Vector3s& n2) {
        return dot(Vector3s(X_1.R * n1), Vector3s(X_2.R * n2));
      };
      Equation loop;
      const auto add = [&](const Scalar& row) {
        if (!row.isConstant()) loop.rows.push_back(row);
      };
      const auto addPoint = [&] {
        for (int i = 0; i < 3; ++i) add(p[i]);
      };
      const auto addAxis = [&] {
        for (int i = 0; i < 2; ++i) add(along(normals.col(i), toScalars(edge.axis)));
      };
      switch (edge.kind) {
        case JointKind::Spherical:
          addPoint();
          break;
        case JointKind::Revolute:
        case JointKind::Continuous:
          addPoint();
          addAxis();
          break;
        case JointKind::Universal:
          addPoint();
          add(along(toScalars(edge.axis), toScalars(edge.axis2)) - edge.axis.dot(edge.axis2));
          break;
        case JointKind::Planar:
          add(dot(p, X_1.R * toScalars(edge.axis)));
          addAxis();
          break;
        case JointKind::Prismatic: {
          for (int i = 0; i < 2; ++i) add(dot(p, X_1.R * normals.col(i)));
          for (int i = 0; i < 3; ++i) {
            const int j = (i + 1) % 3, k = (i + 2) % 3;
            const auto x = toScalars(Vector3d::Unit(j).eval()), y = toScalars(Vector3d::Unit(k).eval());
            add(0.5 * (along(x, y) - along(y, x)));
          }
          break;
        }
        case JointKind::Fixed:
        case JointKind::FreeFlyer:
          break;
      }
      loop.coordinates = listCoordinates(path);
      out_.equations.push_back(loop);
    }
    for (const Closure& closure : loops_.closures())
      if (closure.kind == ClosureKind::Distance)
        distances_.push_back({findRoot(closure.body1), findRoot(closure.body2), (place(closure.body1) * closure.X_B1).p,
                              (place(closure.body2) * closure.X_B2).p, closure.length * closure.length, 0, -1,
                              closure.name});
  }

  // Both sides of a distance at an edge of its chain: its points in the frames of the joint.
  struct Sides {
    Vector3s a, b;
  };
  Sides calcSides(const Distance& distance, const std::vector<Step>& path, size_t at) const {
    const auto here = path.begin() + static_cast<std::ptrdiff_t>(at);
    const Edge& edge = edges_[static_cast<size_t>(here->edge)];
    const Vector3s one = carryPoint(reverse({path.begin(), here}), toScalars(distance.pa)),
                   two = carryPoint({here + 1, path.end()}, toScalars(distance.pb));
    const bool forward = here->forward;
    return {toScalars(edge.X_a.inverse()).act(forward ? one : two),
            toScalars(edge.X_b.inverse()).act(forward ? two : one)};
  }

  void addDistances() {
    for (const Distance& distance : distances_)
      if (distance.slide >= 0) use(edges_[static_cast<size_t>(distance.slide)]);
    for (const Distance& distance : distances_) use(findPath(distance.a, distance.b));
    for (const Distance& distance : distances_) {
      const std::vector<Step> path = findPath(distance.a, distance.b);
      Equation equation;
      equation.coordinates = listCoordinates(path);
      Scalar square = distance.k0;
      double length = std::sqrt(distance.k0);
      if (distance.slide >= 0) {
        const Edge& slide = edges_[static_cast<size_t>(distance.slide)];
        const Scalar s = makeInput(slide.coordinates[0]);
        square += s * (s + 2 * distance.k1);
        length = std::sqrt(distance.k0 + slide.q[0] * (slide.q[0] + 2 * distance.k1));
        equation.coordinates.push_back(slide.coordinates[0]);
      }
      const size_t middle = path.size() / 2;
      const Sides sides = calcSides(distance, path, middle);
      const Vector3s gap = sides.a - calcMotion(edges_[static_cast<size_t>(path[middle].edge)]).act(sides.b);
      equation.rows = {Scalar(0.5 / length) * (dot(gap, gap) - square)};
      for (size_t i = 0; i < path.size(); ++i) addRoots(distance, path, i, square, equation);
      if (distance.slide >= 0) {
        ClosedForm& form = equation.solved[edges_[static_cast<size_t>(distance.slide)].coordinates[0]];
        form.radicand = dot(gap, gap) + (distance.k1 * distance.k1 - distance.k0);
        for (double sign : {1.0, -1.0}) form.roots.push_back(sign * sqrt(form.radicand) - distance.k1);
      }
      out_.equations.push_back(equation);
    }
  }

  // Eq. (2), about the angle of the reference, so that atan2 is far from its cut.
  void addRoots(const Distance& distance, const std::vector<Step>& path, size_t i, const Scalar& square,
                Equation& equation) {
    const Edge& edge = edges_[static_cast<size_t>(path[i].edge)];
    if (!edge.isHinge() && edge.kind != JointKind::Prismatic) return;
    const Sides sides = calcSides(distance, path, i);
    const Vector3s n = toScalars(edge.axis);
    ClosedForm form;
    if (edge.isHinge()) {
      const Vector3s b = toScalars(makeAxisRotation(edge.axis, edge.q[0])) * sides.b;
      const Scalar along = dot(n, sides.b);
      const Vector3s across = b - n * along;
      const Scalar A = 2 * dot(sides.a, across), B = 2 * dot(sides.a, cross(n, b)),
                   C = dot(sides.a, sides.a) + (dot(sides.b, sides.b) - square) - 2 * (dot(n, sides.a) * along);
      form.radicand = A * A + B * B - C * C;
      const Scalar w = sqrt(form.radicand);
      form.roots = {edge.q[0] + atan2(B * C + A * w, A * C - B * w), edge.q[0] + atan2(B * C - A * w, A * C + B * w)};
    } else {
      const Vector3s gap = sides.a - sides.b;
      const Scalar along = dot(gap, n);
      form.radicand = along * along + (square - dot(gap, gap));
      form.roots = {along + sqrt(form.radicand), along - sqrt(form.radicand)};
    }
    equation.solved[edge.coordinates[0]] = form;
  }

  void addCouplers() {
    for (const Closure& closure : loops_.closures()) {
      if (closure.kind != ClosureKind::Coupler) continue;
      Equation equation;
      std::vector<Scalar> terms;
      for (const CouplerTerm& term : closure.terms) {
        Edge& edge = findEdge(term.joint);
        use(edge);
        const Scalar x = makeInput(edge.coordinates[0]);
        Scalar p = 0;
        for (size_t k = term.higher.size(); k-- > 0;) p = (p + term.higher[k]) * x;
        terms.push_back((p + term.coefficient) * x);
        equation.coordinates.push_back(edge.coordinates[0]);
      }
      const auto sumBut = [&](size_t left_out) {
        Scalar sum = -closure.offset;
        for (size_t k = 0; k < terms.size(); ++k)
          if (k != left_out) sum += terms[k];
        return sum;
      };
      for (size_t k = 0; k < terms.size(); ++k)
        if (closure.terms[k].isLinear())
          equation.solved[equation.coordinates[k]].roots = {Scalar(-1 / closure.terms[k].coefficient) * sumBut(k)};
      equation.rows = {sumBut(terms.size())};
      out_.equations.push_back(equation);
    }
  }

  // Springs, and the weight of bodies that do not hang on serial joints alone.
  Scalar sumEnergy() {
    Scalar energy = 0;
    for (const JointForce& force : model_.jointForces()) {
      const int own = toCluster(force.joint);
      if (own < 0 || contains(linkage_.joints, force.joint) || (force.stiffness == 0 && force.preload == 0)) continue;
      Edge& edge = findEdge(own);
      use(edge);
      const Scalar bent = makeInput(edge.coordinates[0]) - force.rest;
      energy += bent * (0.5 * force.stiffness * bent - force.preload);
    }
    for (const PointSpring& spring : model_.pointSprings()) energy += calcEnergy(spring);
    const int root = findRoot(0);
    for (int body = 1; body < loops_.numBodies(); ++body) {
      const Inertia& inertia =
          model_.bodies()[static_cast<size_t>(cluster_.joints[static_cast<size_t>(body) - 1])].inertia;
      if (inertia.mass == 0 || isSerial(body) || gone_.count(findRoot(body))) continue;
      masses_.push_back({findRoot(body), place(body).act(inertia.com), inertia.mass});
    }
    std::vector<std::pair<Vector3s, double>> weights;
    for (const Mass& mass : masses_) {
      const std::vector<Step> path = findPath(root, mass.group);
      use(path);
      weights.emplace_back(carryPoint(path, toScalars(mass.point)), mass.mass);
    }
    // The inputs of gravity come after all coordinates.
    Vector3s g;
    for (int i = 0; i < 3; ++i) g[i] = makeInput(out_.gravity() + i);
    for (const auto& [point, mass] : weights) energy -= Scalar(mass) * dot(g, point);
    return energy;
  }

  Scalar calcEnergy(const PointSpring& spring) {
    const auto findGroup = [&](int body) { return body == cluster_.root ? 0 : std::max(toCluster(body), -1); };
    const int one = findGroup(spring.body1), two = findGroup(spring.body2);
    if (one < 0 || two < 0 || (isSerial(one) && isSerial(two))) return 0;
    const int a = findRoot(one), b = findRoot(two);
    if (a == b) return 0;
    const std::vector<Step> path = findPath(a, b);
    use(path);
    const Vector3s gap =
        carryPoint(path, toScalars(place(two).act(spring.point2))) - toScalars(place(one).act(spring.point1));
    const Scalar length = sqrt(dot(gap, gap) + kShortestLine * kShortestLine), bent = length - spring.rest;
    return bent * (0.5 * spring.stiffness * bent + spring.preload);
  }

  // Whether a body hangs on serial joints alone, so that a serial model has it.
  bool isSerial(int body) const {
    for (int i = body; i > 0; i = loops_.joints()[static_cast<size_t>(i)].parent)
      if (!contains(linkage_.joints, cluster_.joints[static_cast<size_t>(i) - 1])) return false;
    return true;
  }

  struct Mass {
    int group;
    Vector3d point;
    double mass;
  };

  const Model& model_;
  const Linkage& linkage_;
  const ReducedCluster& cluster_;
  const Model& loops_;
  Workspace ws_;
  bool planar_;
  VectorXd q_;
  std::set<int> needed_;     // joints of the cluster's model
  std::vector<int> group_;   // of bodies, by its first one
  std::vector<SE3> places_;  // of bodies in their groups
  std::set<int> gone_;       // groups that are rods
  std::vector<Edge> edges_;
  std::vector<int> tree_, closing_;
  std::vector<Distance> distances_;
  std::vector<Mass> masses_;
  Mechanism out_;
};

}  // namespace

Mechanism makeMechanism(const Model& model, const Linkage& linkage, ConstVectorRef q, bool planar_rods) {
  return Reducer(model, linkage, q, planar_rods).reduce();
}

}  // namespace bielle::firmware
