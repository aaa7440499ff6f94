#include "firmware/mechanism.h"

#include <algorithm>

#include "bielle/model/error.h"
#include "firmware/linkage_graph.h"
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

class MechanismBuilder {
 public:
  MechanismBuilder(const Model& model, const Linkage& linkage, ConstVectorRef q, bool planar_rods)
      : model_(model), linkage_(linkage), cluster_(*linkage.cluster), graph_(model, linkage, q, planar_rods) {}

  Mechanism build() {
    out_.rods = graph_.rods;
    out_.ignored_offset = graph_.ignored_offset;
    number();
    addLoops();
    addDistances();
    addCouplers();
    out_.potential = sumEnergy();
    return std::move(out_);
  }

 private:
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
    for (const Step& step : path) use(graph_.edges[static_cast<size_t>(step.edge)]);
  }
  // Joints and motors come first. A motor that sits on a joint of the output is a copy of it.
  void number() {
    out_.size = linkage_.size();
    for (int i : linkage_.joints) use(graph_.findEdge(graph_.toCluster(i)));
    for (size_t m = 0; m < linkage_.motors.size(); ++m) {
      Edge& edge = graph_.findEdge(graph_.toCluster(model_.motors()[static_cast<size_t>(linkage_.motors[m])].joint));
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
      const Edge& edge = graph_.edges[static_cast<size_t>(step.edge)];
      const SE3s J = calcMotion(edge);
      X = step.forward ? X * toScalars(edge.X_a) * J * toScalars(edge.X_b.inverse())
                       : X * toScalars(edge.X_b) * J.inverse() * toScalars(edge.X_a.inverse());
    }
    return X;
  }
  // A point at the end of a path in the group at its begin, with fewer operations.
  Vector3s carryPoint(const std::vector<Step>& path, const Vector3s& point) const {
    return carry(path, {point, dot(point, point)}).p;
  }

  // A point, and the square of its distance from the origin, as a sum of products in which the rod's length and the distance of
  // its pivots can cancel.
  struct Place {
    Vector3s p;
    Scalar square;
  };
  static Place move(const SE3& X, const Place& x) {
    const SE3s there = toScalars(X);
    return {there.act(x.p), x.square + dot(there.p, there.p) + 2 * dot(toScalars((X.R.transpose() * X.p).eval()), x.p)};
  }
  static Place move(const Edge& edge, const SE3s& motion, const Place& x) {
    const Vector3s p = motion.act(x.p);
    const bool turns = edge.isHinge() || edge.kind == JointKind::Universal;
    return {p, turns ? x.square : dot(p, p)};
  }
  Place carry(const std::vector<Step>& path, Place x) const {
    for (size_t i = path.size(); i-- > 0;) {
      const Edge& edge = graph_.edges[static_cast<size_t>(path[i].edge)];
      const SE3s J = calcMotion(edge);
      x = path[i].forward ? move(edge.X_a, move(edge, J, move(edge.X_b.inverse(), x)))
                          : move(edge.X_b, move(edge, J.inverse(), move(edge.X_a.inverse(), x)));
    }
    return x;
  }
  static std::vector<Step> reverse(std::vector<Step> path) {
    std::reverse(path.begin(), path.end());
    for (Step& step : path) step.forward = !step.forward;
    return path;
  }

  std::vector<int> listCoordinates(const std::vector<Step>& path) const {
    std::vector<int> out;
    for (const Step& step : path)
      for (int c : graph_.edges[static_cast<size_t>(step.edge)].coordinates) out.push_back(c);
    return out;
  }

  // Rows of the joints outside the tree, in the group half way.
  void addLoops() {
    for (int e : graph_.closing) {
      const Edge& edge = graph_.edges[static_cast<size_t>(e)];
      const std::vector<Step> path = graph_.findPath(edge.a, edge.b);
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
  }

  // Both sides of a distance at an edge of its chain: its points in the frames of the joint.
  struct Sides {
    Vector3s a, b;
    Scalar squares;  // |a|^2 + |b|^2
  };
  Sides calcSides(const RodDistance& distance, const std::vector<Step>& path, size_t at) const {
    const auto here = path.begin() + static_cast<std::ptrdiff_t>(at);
    const Edge& edge = graph_.edges[static_cast<size_t>(here->edge)];
    const auto start = [](const Vector3d& point) { return Place{toScalars(point), point.squaredNorm()}; };
    const Place one = carry(reverse({path.begin(), here}), start(distance.pa)),
                two = carry({here + 1, path.end()}, start(distance.pb));
    const Place a = move(edge.X_a.inverse(), here->forward ? one : two),
                b = move(edge.X_b.inverse(), here->forward ? two : one);
    return {a.p, b.p, a.square + b.square};
  }

  // Of two formulas for the same, the one that rounding moves less about the reference.
  Scalar chooseExact(const Scalar& one, const Scalar& other) const {
    double errors[2] = {0, 0};
    for (const double way : {0.0, 0.3, -0.3}) {
      std::vector<double> at;
      for (const Coordinate& coordinate : out_.coordinates) at.push_back(coordinate.reference + way);
      errors[0] += estimateRounding(one, at);
      errors[1] += estimateRounding(other, at);
    }
    return errors[1] < errors[0] ? other : one;
  }

  void addDistances() {
    for (const RodDistance& distance : graph_.distances)
      if (distance.slide >= 0) use(graph_.edges[static_cast<size_t>(distance.slide)]);
    for (const RodDistance& distance : graph_.distances) use(graph_.findPath(distance.a, distance.b));
    for (const RodDistance& distance : graph_.distances) {
      const std::vector<Step> path = graph_.findPath(distance.a, distance.b);
      Equation equation;
      equation.coordinates = listCoordinates(path);
      Scalar square = distance.k0;
      double length = std::sqrt(distance.k0);
      if (distance.slide >= 0) {
        const Edge& slide = graph_.edges[static_cast<size_t>(distance.slide)];
        const Scalar s = makeInput(slide.coordinates[0]);
        square += s * (s + 2 * distance.k1);
        length = std::sqrt(distance.k0 + slide.q[0] * (slide.q[0] + 2 * distance.k1));
        equation.coordinates.push_back(slide.coordinates[0]);
      }
      const size_t middle = path.size() / 2;
      const Sides sides = calcSides(distance, path, middle);
      const Edge& turned = graph_.edges[static_cast<size_t>(path[middle].edge)];
      const Vector3s b = calcMotion(turned).act(sides.b), gap = sides.a - b;
      const bool turns = turned.isHinge() || turned.kind == JointKind::Universal;
      const Scalar row = dot(gap, gap) - square,
                   sum = turns ? gatherConstants(sides.squares - 2 * dot(sides.a, b) - square) : row;
      equation.rows = {Scalar(0.5 / length) * chooseExact(row, sum)};
      for (size_t i = 0; i < path.size(); ++i) addRoots(distance, path, i, square, equation);
      if (distance.slide >= 0) {
        ClosedForm& form = equation.solved[graph_.edges[static_cast<size_t>(distance.slide)].coordinates[0]];
        form.radicand = dot(gap, gap) + (distance.k1 * distance.k1 - distance.k0);
        for (double sign : {1.0, -1.0}) form.roots.push_back(sign * sqrt(form.radicand) - distance.k1);
      }
      out_.equations.push_back(equation);
    }
  }

  // Eq. (2), about the angle of the reference, so that atan2 is far from its cut.
  void addRoots(const RodDistance& distance, const std::vector<Step>& path, size_t i, const Scalar& square,
                Equation& equation) {
    const Edge& edge = graph_.edges[static_cast<size_t>(path[i].edge)];
    if (!edge.isHinge() && edge.kind != JointKind::Prismatic) return;
    const Sides sides = calcSides(distance, path, i);
    const Vector3s n = toScalars(edge.axis);
    ClosedForm form;
    if (edge.isHinge()) {
      const Vector3s b = toScalars(makeAxisRotation(edge.axis, edge.q[0])) * sides.b;
      const Scalar along = dot(n, sides.b);
      const Vector3s across = b - n * along;
      const Scalar A = 2 * dot(sides.a, across), B = 2 * dot(sides.a, cross(n, b)),
                   rest = 2 * (dot(n, sides.a) * along),
                   C = chooseExact(dot(sides.a, sides.a) + (dot(sides.b, sides.b) - square) - rest,
                                   gatherConstants(sides.squares - square - rest));
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
    for (const Closure& closure : graph_.loops().closures()) {
      if (closure.kind != ClosureKind::Coupler) continue;
      Equation equation;
      std::vector<Scalar> terms;
      for (const CouplerTerm& term : closure.terms) {
        Edge& edge = graph_.findEdge(term.joint);
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
      const int own = graph_.toCluster(force.joint);
      if (own < 0 || contains(linkage_.joints, force.joint) || (force.stiffness == 0 && force.preload == 0)) continue;
      Edge& edge = graph_.findEdge(own);
      use(edge);
      const Scalar bent = makeInput(edge.coordinates[0]) - force.rest;
      energy += bent * (0.5 * force.stiffness * bent - force.preload);
    }
    for (const PointSpring& spring : model_.pointSprings()) energy += calcEnergy(spring);
    const int root = graph_.getGroup(0);
    for (int body = 1; body < graph_.loops().numBodies(); ++body) {
      const Inertia& inertia =
          model_.bodies()[static_cast<size_t>(cluster_.joints[static_cast<size_t>(body) - 1])].inertia;
      if (inertia.mass == 0 || isSerial(body) || graph_.isRod(graph_.getGroup(body))) continue;
      graph_.masses.push_back({graph_.getGroup(body), graph_.place(body).act(inertia.com), inertia.mass});
    }
    std::vector<std::pair<Vector3s, double>> weights;
    for (const PointMass& mass : graph_.masses) {
      const std::vector<Step> path = graph_.findPath(root, mass.group);
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
    const auto findGroup = [&](int body) { return body == cluster_.root ? 0 : std::max(graph_.toCluster(body), -1); };
    const int one = findGroup(spring.body1), two = findGroup(spring.body2);
    if (one < 0 || two < 0 || (isSerial(one) && isSerial(two))) return 0;
    const int a = graph_.getGroup(one), b = graph_.getGroup(two);
    if (a == b) return 0;
    const std::vector<Step> path = graph_.findPath(a, b);
    use(path);
    const Vector3s gap = carryPoint(path, toScalars(graph_.place(two).act(spring.point2))) -
                         toScalars(graph_.place(one).act(spring.point1));
    const Scalar length = sqrt(dot(gap, gap) + kShortestLine * kShortestLine), bent = length - spring.rest;
    return bent * (0.5 * spring.stiffness * bent + spring.preload);
  }

  // Whether a body hangs on serial joints alone, so that a serial model has it.
  bool isSerial(int body) const {
    for (int i = body; i > 0; i = graph_.loops().joints()[static_cast<size_t>(i)].parent)
      if (!contains(linkage_.joints, cluster_.joints[static_cast<size_t>(i) - 1])) return false;
    return true;
  }

  const Model& model_;
  const Linkage& linkage_;
  const ReducedCluster& cluster_;
  LinkageGraph graph_;
  Mechanism out_;
};

}  // namespace

Mechanism makeMechanism(const Model& model, const Linkage& linkage, ConstVectorRef q, bool planar_rods) {
  return MechanismBuilder(model, linkage, q, planar_rods).build();
}

}  // namespace bielle::firmware
