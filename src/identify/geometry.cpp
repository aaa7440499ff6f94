#include "identify/geometry.h"

#include <algorithm>
#include <numeric>
#include <optional>

#include "bielle/dynamics/kinematics.h"
#include "bielle/model/builder.h"
#include "formats/robot_text.h"
#include "model/listing.h"

namespace bielle {
namespace {

using Kind = GeometryMove::Kind;

constexpr double kCoincide = 1e-9;  // m: one pivot
constexpr double kShortest = 1e-6;  // m: a cross of two axes has no length
constexpr double kParallel = 1e-6;  // rad

// Where a joint or a closure holds a link.
struct Pivot {
  int body = 0;  // of the cluster's model
  Vector3d p = Vector3d::Zero();
  std::optional<Vector3d> axis = {};  // of a hinge; others are points
  bool slides = false;
  std::vector<GeometryMove> moves = {};  // without a direction; none of the joint that carries the link
  std::string name = {};
};

bool turns(JointKind kind) {
  return kind == JointKind::Revolute || kind == JointKind::Continuous || kind == JointKind::Spherical ||
         kind == JointKind::Universal;
}

std::vector<Pivot> listPivots(const Model& whole, const ReducedCluster& cluster) {
  const Model& model = cluster.model;
  std::vector<Pivot> pivots;
  for (int i = 1; i < model.numBodies(); ++i) {
    const Joint& joint = model.joints()[i];
    const bool is_hinge = joint.kind == JointKind::Revolute || joint.kind == JointKind::Continuous;
    Pivot carried{i, Vector3d::Zero(), {}, !turns(joint.kind)};
    Pivot carrying{joint.parent, joint.X_PJ.p, {}, carried.slides, {{Kind::Joint, i}}, joint.name};
    if (is_hinge) carried.axis = joint.axis, carrying.axis = Vector3d(joint.X_PJ.R * joint.axis);
    pivots.push_back(carrying);
    pivots.push_back(carried);
  }
  for (size_t c = 0; c < model.closures().size(); ++c) {
    const Closure &closure = model.closures()[c], &placed = cluster.placed[c];
    if (closure.kind == ClosureKind::Coupler || closure.kind == ClosureKind::Weld6D) continue;
    const bool slides = closure.kind == ClosureKind::Slider;
    const auto add = [&](Kind kind, int body, int whole_body, const SE3& X, const char* end) {
      Pivot pivot{body,
                  X.p,
                  {},
                  slides,
                  {{kind, static_cast<int>(c)}},
                  findFrameName(whole, whole_body, X, closure.name + end)};
      if (closure.kind == ClosureKind::Hinge5D) pivot.axis = Vector3d(X.R * closure.axis);
      pivots.push_back(pivot);
    };
    add(Kind::Frame1, closure.body1, placed.body1, closure.X_B1, "/frame1");
    add(Kind::Frame2, closure.body2, placed.body2, closure.X_B2, "/frame2");
  }
  // One where several hold the same link at one point.
  std::vector<Pivot> out;
  for (const Pivot& pivot : pivots) {
    const auto same = std::find_if(out.begin(), out.end(), [&](const Pivot& other) {
      return other.body == pivot.body && (other.p - pivot.p).norm() < kCoincide;
    });
    if (same == out.end()) {
      out.push_back(pivot);
      continue;
    }
    // What the link is carried by cannot move in it.
    const bool is_fixed = same->moves.empty() || pivot.moves.empty();
    same->moves.insert(same->moves.end(), pivot.moves.begin(), pivot.moves.end());
    if (is_fixed) same->moves.clear();
    if (!pivot.axis || (same->axis && !(same->axis->cross(*pivot.axis).norm() < kParallel))) same->axis.reset();
    same->slides = same->slides || pivot.slides;
  }
  return out;
}

// The moves that put b farther from a along u, in the frame of body `at`, of which placements tell where the others are.
std::vector<GeometryMove> listMoves(const Model& model, const std::vector<SE3>& X_WB, const Pivot& a, const Pivot& b,
                                    int at, const Vector3d& u) {
  const auto turn = [&](int body, const Vector3d& v) {
    return Vector3d(X_WB[static_cast<size_t>(body)].R.transpose() * (X_WB[static_cast<size_t>(at)].R * v));
  };
  const auto point = [&](const Pivot& pivot, double sign) {
    std::vector<GeometryMove> moves = pivot.moves;
    for (GeometryMove& move : moves) move.along = sign * turn(pivot.body, u);
    return moves;
  };
  if (!b.moves.empty()) return point(b, 1);
  if (!a.moves.empty()) return point(a, -1);
  // Both ends carry their links: the weld between these gives way.
  for (size_t c = 0; c < model.closures().size(); ++c) {
    const Closure& closure = model.closures()[c];
    if (closure.kind != ClosureKind::Weld6D) continue;
    if (closure.body1 == a.body && closure.body2 == b.body)
      return {{Kind::Frame1, static_cast<int>(c), turn(a.body, u)}};
    if (closure.body1 == b.body && closure.body2 == a.body)
      return {{Kind::Frame2, static_cast<int>(c), turn(a.body, u)}};
  }
  return {};
}

// Whether a joint of the cluster has a motor or is a serial one.
bool isDriven(const Model& whole, int joint) {
  return contains(whole.serialJoints(), joint) ||
         std::any_of(whole.motors().begin(), whole.motors().end(), [&](const Motor& m) { return m.joint == joint; });
}

std::optional<GeometryNumber> makeLength(const Model& whole, const ReducedCluster& cluster,
                                         const std::vector<SE3>& X_WB, const std::vector<int>& bodies,
                                         const std::vector<const Pivot*>& ends) {
  const Pivot &a = *ends[0], &b = *ends[1];
  if (a.slides || b.slides) return {};
  const int at = bodies.front();
  const auto place = [&](const Pivot& pivot) {
    return X_WB[static_cast<size_t>(at)].inverseTimes(X_WB[static_cast<size_t>(pivot.body)]);
  };
  const SE3 X_a = place(a), X_b = place(b);
  Vector3d u = X_b.act(b.p) - X_a.act(a.p);
  std::optional<Vector3d> axis;
  if (a.axis) axis = Vector3d(X_a.R * *a.axis);
  if (b.axis) {
    const Vector3d other = X_b.R * *b.axis;
    if (axis && !(axis->cross(other).norm() < kParallel)) return {};
    axis = other;
  }
  if (axis) u -= u.dot(*axis) * *axis;
  const double length = u.norm();
  if (!(length > kShortest)) return {};
  GeometryNumber number;
  number.name = whole.bodies()[static_cast<size_t>(cluster.joints[static_cast<size_t>(at) - 1])].name;
  number.value = length;
  number.is_rod = std::none_of(bodies.begin(), bodies.end(), [&](int body) {
    return isDriven(whole, cluster.joints[static_cast<size_t>(body) - 1]);
  });
  number.moves = listMoves(cluster.model, X_WB, a, b, at, u / length);
  if (number.moves.empty()) return {};
  return number;
}

// In the whole model.
GeometryMove placeMove(const ReducedCluster& cluster, GeometryMove move) {
  const auto i = static_cast<size_t>(move.index);
  move.index = move.kind == Kind::Joint ? cluster.joints[i - 1] : cluster.closure_indices[i];
  return move;
}

}  // namespace

std::vector<int> groupBodies(const Model& model) {
  std::vector<int> group(static_cast<size_t>(model.numBodies()));
  std::iota(group.begin(), group.end(), 0);
  for (bool changes = true; changes;) {
    changes = false;
    for (const Closure& closure : model.closures()) {
      if (closure.kind != ClosureKind::Weld6D) continue;
      int &a = group[static_cast<size_t>(closure.body1)], &b = group[static_cast<size_t>(closure.body2)];
      changes = changes || a != b;
      a = b = std::min(a, b);
    }
  }
  return group;
}

std::vector<GeometryNumber> listGeometry(const Model& whole, const ReducedCluster& cluster, ConstVectorRef q) {
  const Model& model = cluster.model;
  Workspace ws(model);
  updatePositions(model, ws, q);
  const std::vector<Pivot> pivots = listPivots(whole, cluster);
  const std::vector<int> group = groupBodies(model);
  std::vector<GeometryNumber> numbers;
  for (size_t c = 0; c < model.closures().size(); ++c)
    if (const Closure& closure = model.closures()[c]; closure.kind == ClosureKind::Distance)
      numbers.push_back({closure.name, closure.length, true, {{Kind::Length, static_cast<int>(c)}}});
  for (int first = 1; first < model.numBodies(); ++first) {
    std::vector<int> bodies;
    for (int body = first; body < model.numBodies(); ++body)
      if (group[static_cast<size_t>(body)] == first) bodies.push_back(body);
    std::vector<const Pivot*> ends;
    for (const Pivot& pivot : pivots)
      if (contains(bodies, pivot.body)) ends.push_back(&pivot);
    if (ends.size() != 2) continue;
    if (auto length = makeLength(whole, cluster, ws.X_WB, bodies, ends)) numbers.push_back(std::move(*length));
  }
  for (const Pivot& pivot : pivots)
    for (int k = 0; k < 3 && !pivot.moves.empty(); ++k) {
      GeometryNumber number{pivot.name + "." + "xyz"[k], pivot.p[k], false, pivot.moves};
      for (GeometryMove& move : number.moves) move.along = Vector3d::Unit(k);
      numbers.push_back(std::move(number));
    }
  return numbers;
}

Model changeGeometry(const Model& model, const ReducedCluster* cluster, const std::vector<GeometryNumber>& numbers,
                     ConstVectorRef changes) {
  ModelParts parts = takeParts(model);
  // The end of a closure with what else is there.
  const auto moveEnd = [&parts](int body, SE3& X, const Vector3d& step) {
    const SE3 before = X;
    const auto follow = [&](int other_body, SE3& other) {
      if (other_body == body && other.p == before.p && other.R == before.R) other.p += step;
    };
    for (Frame& frame : parts.frames)
      if (frame.name != parts.bodies[static_cast<size_t>(frame.body)].name) follow(frame.body, frame.X_BF);
    for (ContactFrame& contact : parts.contacts) follow(contact.body, contact.X_BF);
    for (PointSpring& spring : parts.point_springs) {
      if (spring.body1 == body && spring.point1 == before.p) spring.point1 += step;
      if (spring.body2 == body && spring.point2 == before.p) spring.point2 += step;
    }
    X.p = before.p + step;
  };
  for (size_t i = 0; i < numbers.size(); ++i)
    for (GeometryMove move : numbers[i].moves) {
      if (cluster) move = placeMove(*cluster, move);
      const double change = changes[static_cast<Eigen::Index>(i)];
      if (change == 0) continue;
      if (move.kind == Kind::Joint) {
        parts.joints[static_cast<size_t>(move.index)].X_PJ.p += change * move.along;
        continue;
      }
      Closure& closure = parts.closures[static_cast<size_t>(move.index)];
      if (move.kind == Kind::Length) closure.length += change;
      if (move.kind == Kind::Frame1) moveEnd(closure.body1, closure.X_B1, change * move.along);
      if (move.kind == Kind::Frame2) moveEnd(closure.body2, closure.X_B2, change * move.along);
    }
  return ModelBuilder::restore(std::move(parts));
}

ModelVariation makeVariation(const Model& model, const GeometryNumber& number) {
  ModelVariation variation(model);
  for (const GeometryMove& move : number.moves) {
    const auto i = static_cast<size_t>(move.index);
    const auto turn = [&move](const SE3& X) { return Vector3d(X.R.transpose() * move.along); };
    if (move.kind == Kind::Joint) linear(variation.joints[i]) += turn(model.joints()[i].X_PJ);
    if (move.kind == Kind::Frame1) linear(variation.frames1[i]) += turn(model.closures()[i].X_B1);
    if (move.kind == Kind::Frame2) linear(variation.frames2[i]) += turn(model.closures()[i].X_B2);
    if (move.kind == Kind::Length) variation.lengths[i] += 1;
  }
  return variation;
}

}  // namespace bielle
