#include "formats/adopt_feet.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "bielle/dynamics/kinematics.h"

namespace bielle {
namespace {

constexpr double kUpright = 0.9;                      // least cosine between the z axis of a sole and up
constexpr double kBackward = -0.7;                    // most cosine between the x axis of a frame and forward
constexpr double kMirror = 0.06, kSameHeight = 0.02;  // of a pair of feet, m: published models are not quite symmetric
constexpr double kLevel = 0.01;                       // of the feet of a robot with more than two legs, m
constexpr double kTouching = 0.005;  // m; shapes of a foot that reach as low as this over its lowest point are its sole
constexpr double kRound = 1.05;      // extent of a round shape across, over its radius
constexpr double kBelow = 0.01;      // m; a foot that reaches lower under a frame does not stand on it
constexpr double kBlade = 0.03;      // m, the width of a foot that stands on an edge is less

bool isNamedFoot(std::string name) {
  std::transform(name.begin(), name.end(), name.begin(), [](unsigned char c) { return std::tolower(c); });
  return name.find("foot") != std::string::npos || name.find("sole") != std::string::npos;
}

double getExtent(const SE3& X_WS, const Shape& shape, const Vector3d& direction) {
  return (X_WS.R.transpose() * direction).cwiseAbs().dot(shape.half) + shape.radius;
}

// Whether shapes of its body, or of those that this one carries, reach below a frame, as those of a foot below the ankle.
bool isAboveShapes(const Model& model, const Workspace& ws, const Frame& frame) {
  const SE3 X_WF = getPlacement(ws, frame.body, frame.X_BF);
  return std::any_of(model.shapes().begin(), model.shapes().end(), [&](const Shape& shape) {
    if (!model.isAncestorOrSelf(frame.body, shape.body)) return false;
    const SE3 X_FS = X_WF.inverseTimes(getPlacement(ws, shape.body, shape.X_BS));
    return X_FS.p.z() - getExtent(X_FS, shape, Vector3d::UnitZ()) < -kBelow;
  });
}

// Those with z up that are soles by their name, unless by their shapes they are not, and all others.
std::vector<FoundFoot> listUprightFrames(const Model& model, const Workspace& ws) {
  std::vector<FoundFoot> feet;
  for (const Frame& frame : model.frames()) {
    const SE3 X = getPlacement(ws, frame.body, frame.X_BF);
    if (frame.body > 1 && X.R(2, 2) > kUpright)
      feet.push_back(
          {frame.name, frame.body, frame.X_BF, X, isNamedFoot(frame.name) && !isAboveShapes(model, ws, frame)});
  }
  return feet;
}

// z is up along the flat side of a shape, or across it if it is long; x forward, or along the shape if that is nearly forward.
Matrix3d alignSole(const SE3& X_WS, const Shape& shape) {
  Eigen::Index up = 0;
  X_WS.R.row(2).cwiseAbs().maxCoeff(&up);
  Vector3d z = Vector3d::UnitZ(), x = Vector3d::UnitX();
  for (int i = 0; i < 3; ++i)
    if (i != up && shape.half[i] > 0) z -= X_WS.R(2, i) * X_WS.R.col(i);
  if (z.z() < kUpright * z.norm()) z = Vector3d::UnitZ();  // it stands on a corner
  z.normalize();
  Eigen::Index longest = 0;
  shape.half.maxCoeff(&longest);
  const Vector3d along = X_WS.R.col(longest);
  if (shape.half[longest] > 0 && std::abs(along.x()) > kUpright) x = along.x() > 0 ? along : Vector3d(-along);
  x = (x - z.dot(x) * z).normalized();
  return (Matrix3d() << x, z.cross(x), z).finished();
}

// New frames below the shapes of each body of the legs.
std::vector<FoundFoot> makeSoleFrames(const Model& model, const Workspace& ws) {
  std::vector<FoundFoot> feet;
  for (int body = 2; body < model.numBodies(); ++body) {
    std::vector<const Shape*> shapes;
    for (const Shape& shape : model.shapes())
      if (shape.body == body) shapes.push_back(&shape);
    if (shapes.empty()) continue;
    const auto place = [&](const Shape* shape) { return getPlacement(ws, body, shape->X_BS); };
    const auto getBottom = [&](const Shape* shape, const Vector3d& up) {
      return up.dot(place(shape).p) - getExtent(place(shape), *shape, up);
    };
    const auto sortFrom = [&](const Vector3d& up) {
      std::stable_sort(shapes.begin(), shapes.end(),
                       [&](const Shape* a, const Shape* b) { return getBottom(a, up) < getBottom(b, up); });
    };
    sortFrom(Vector3d::UnitZ());
    const Matrix3d R = alignSole(place(shapes[0]), *shapes[0]);
    sortFrom(R.col(2));
    const double ground = getBottom(shapes[0], R.col(2));
    Vector3d low = Vector3d::Constant(std::numeric_limits<double>::infinity()), high = -low;  // in the axes of the sole
    for (const Shape* shape : shapes) {
      if (getBottom(shape, R.col(2)) > ground + kTouching) break;
      for (int i = 0; i < 2; ++i) {
        const double middle = R.col(i).dot(place(shape).p), extent = getExtent(place(shape), *shape, R.col(i));
        low[i] = std::min(low[i], middle - extent);
        high[i] = std::max(high[i], middle + extent);
      }
    }
    low.z() = high.z() = ground;
    const SE3 X_WF{R, R * (low + high) / 2};
    feet.push_back({"", body, ws.X_WB[body].inverse() * X_WF, X_WF, false});
  }
  return feet;
}

// By body: what is left of the robot without its base, held together by joints and closures, is a leg or an arm. 0: the base itself.
std::vector<int> findLegs(const Model& model) {
  std::vector<int> legs(static_cast<size_t>(model.numBodies()), 0);
  for (int i = 2; i < model.numBodies(); ++i) {
    const int parent = model.joints()[static_cast<size_t>(i)].parent;
    legs[static_cast<size_t>(i)] = parent > 1 ? legs[static_cast<size_t>(parent)] : i;
  }
  for (const Closure& closure : model.closures()) {
    const int a = legs[static_cast<size_t>(closure.body1)], b = legs[static_cast<size_t>(closure.body2)];
    if (closure.kind != ClosureKind::Coupler && a != 0 && b != 0) std::replace(legs.begin(), legs.end(), a, b);
  }
  return legs;
}

// The lowest candidate of each leg that reaches as low as the lowest of all. \param candidates  the lowest first
std::vector<FoundFoot> listLowest(const Model& model, const std::vector<FoundFoot>& candidates) {
  const std::vector<int> legs = findLegs(model);
  std::vector<FoundFoot> lowest;
  for (const FoundFoot& foot : candidates) {
    const auto is_of_leg = [&](const FoundFoot& other) {
      return legs[static_cast<size_t>(other.body)] == legs[static_cast<size_t>(foot.body)];
    };
    if (foot.X_WF.p.z() < candidates.front().X_WF.p.z() + kLevel &&
        std::none_of(lowest.begin(), lowest.end(), is_of_leg))
      lowest.push_back(foot);
  }
  return lowest;
}

}  // namespace

std::vector<FoundFoot> findFeet(const Model& model, const Workspace& ws) {
  std::vector<FoundFoot> candidates = listUprightFrames(model, ws);
  const auto named =
      std::stable_partition(candidates.begin(), candidates.end(), [](const FoundFoot& foot) { return foot.is_named; });
  if (named != candidates.begin())
    candidates.erase(named, candidates.end());
  else if (const std::vector<FoundFoot> made = makeSoleFrames(model, ws); !made.empty())
    candidates = made;
  if (candidates.empty()) return {};
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const FoundFoot& a, const FoundFoot& b) { return a.X_WF.p.z() < b.X_WF.p.z(); });
  if (std::vector<FoundFoot> many = listLowest(model, candidates); many.size() > 2) {
    const auto isBefore = [](const FoundFoot& a, const FoundFoot& b) {  // from the front on, and from the left
      const Vector3d apart = a.X_WF.p - b.X_WF.p;
      return std::abs(apart.x()) > kMirror ? apart.x() > 0 : apart.y() > 0;
    };
    for (size_t i = 1; i < many.size(); ++i)  // few; no order that sorting needs, where rows of feet are oblique
      for (size_t k = i; k > 0 && isBefore(many[k], many[k - 1]); --k) std::swap(many[k], many[k - 1]);
    return many;
  }
  const FoundFoot& first = candidates.front();
  std::vector<FoundFoot> feet = {first};
  double nearest = kMirror;
  const Vector3d image(first.X_WF.p.x(), -first.X_WF.p.y(), first.X_WF.p.z());
  for (const FoundFoot& other : candidates) {
    const Vector3d apart = other.X_WF.p - image;
    if (other.body == first.body || std::abs(apart.z()) > kSameHeight || std::abs(first.X_WF.p.y()) < kSameHeight ||
        apart.norm() >= nearest)
      continue;
    nearest = apart.norm();
    feet.resize(1);
    feet.push_back(other);
  }
  // Left is where y is positive.
  if (feet.size() == 2 && feet[0].X_WF.p.y() < 0) std::swap(feet[0], feet[1]);
  return feet;
}

bool turnForward(std::vector<FoundFoot>& feet) {
  const auto is_backward = [](const FoundFoot& foot) { return foot.X_WF.R(0, 0) < kBackward; };
  if (std::none_of(feet.begin(), feet.end(), is_backward)) return false;
  for (FoundFoot& foot : feet) {
    foot.frame.clear();
    if (!is_backward(foot)) continue;
    const SE3 turn((Matrix3d() << -1, 0, 0, 0, -1, 0, 0, 0, 1).finished(), Vector3d::Zero());
    foot.X_BF = foot.X_BF * turn;
    foot.X_WF = foot.X_WF * turn;
  }
  return true;
}

std::vector<FoundFoot> findLegEnds(const Model& model, const Workspace& ws, const std::vector<FoundFoot>& feet) {
  constexpr double kLeast = 0.01;  // m, from a joint to a centre of mass
  std::vector<FoundFoot> ends;
  if (!model.shapes().empty()) return {};
  for (const FoundFoot& foot : feet) {
    const Inertia& link = model.bodies()[static_cast<size_t>(foot.body)].inertia;
    const double away = link.com.norm();
    if (foot.is_named || !foot.X_BF.p.isZero(0) || !(away > kLeast) || !(link.mass > 0)) return {};
    const Vector3d along = link.com / away;
    const double across = link.I_com.trace() / 2;  // of a rod of length 2 l, m (2 l)^2 / 12, however the axes are given
    FoundFoot end = foot;
    end.X_BF.p = (away + std::sqrt(3 * across / link.mass)) * along;
    end.X_WF = {Matrix3d::Identity(), ws.X_WB[static_cast<size_t>(foot.body)].act(end.X_BF.p)};
    end.X_BF.R = ws.X_WB[static_cast<size_t>(foot.body)].R.transpose();
    if (!(end.X_WF.p.z() <= foot.X_WF.p.z() - kLeast)) return {};
    end.frame.clear();
    ends.push_back(end);
  }
  return ends;
}

std::optional<ContactFrame> measureFoot(const Model& model, const FoundFoot& foot) {
  Eigen::Vector2d half = Eigen::Vector2d::Zero();
  double radius = std::numeric_limits<double>::infinity();
  for (const Shape& shape : model.shapes()) {
    if (shape.body != foot.body) continue;
    const SE3 X = foot.X_BF.inverse() * shape.X_BS;
    for (int i = 0; i < 2; ++i) half[i] = std::max(half[i], std::abs(X.p[i]) + getExtent(X, shape, Vector3d::Unit(i)));
    radius = std::min(radius, shape.radius);
  }
  if (half.isZero()) return {};
  ContactFrame contact{"", foot.body, foot.X_BF, ContactKind::Surface6D, half.x(), half.y()};
  const bool is_round = radius > 0 && half.y() <= kRound * radius;
  if (is_round && half.x() <= kRound * radius) {
    contact.kind = ContactKind::Point3D;
    contact.half_length = contact.half_width = 0;
  } else if (is_round || 2 * half.y() < kBlade) {
    contact.kind = ContactKind::Edge5D;
    contact.half_length -= is_round ? radius : 0;
    contact.half_width = 0;
  }
  return contact;
}

}  // namespace bielle
