#include "worlds/contact_law.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "bielle/dynamics/kinematics.h"

namespace bielle::worlds {
namespace {

// A stop gives way by this under a torque of the robot's weight times one metre, or under its weight, rad or m.
constexpr double kTurn = 0.02, kShift = 1e-3;
constexpr double kLeastGravity = 1;   // m/s^2; where there is less, soles and stops are as hard as on Earth
constexpr double kStopDamping = 0.5;  // s/rad; s/m of sliding joints is longer by their ratio of speeds, about 10
// A narrower range is play, rad or m: it gives way by this share of it instead, and what leaves a stop crosses it in a second at
// the fastest: by Eq. (1) nothing rebounds faster than at 1/c.
constexpr double kTurnOfPlay = 0.05, kShiftOfPlay = 5e-3, kShareOfPlay = 0.05, kCrossing = 1;

// The ground is at a place of a sole that is at most so far above it, or as deep in it, m.
constexpr double kOver = 2e-4, kUnder = 5e-3;
constexpr double kHollow = 4;   // the grid between the corners of a sole is so much higher, over the sinkage
constexpr double kSteep = 0.5;  // cosine between a sole and the level: points of steeper ones stay where they are

// Eq. (1)
template <typename T>
struct NormalForce {
  T force, rate;  // rate: d force / d d'
};
template <typename T>
NormalForce<T> calcNormalForce(const T& stiffness, double damping, const T& depth, const T& depth_rate) {
  const T factor = 1 + damping * depth_rate;
  const auto pulls = factor <= T(0);
  return {select(pulls, T(0), T(stiffness * depth * factor)), select(pulls, T(0), T(stiffness * depth * damping))};
}

// N. From it follows how hard soles and stops are, which does not vanish with the gravity.
double calcWeight(const Model& model) {
  const double gravity = model.gravity().norm();
  return model.mass() * (gravity > kLeastGravity ? gravity : 9.81);
}

// Eq. (5), from a to b.
template <typename T>
struct MeanDepth {
  T depth, rate;  // rate: d depth / d b
};
template <typename T>
MeanDepth<T> calcMeanDepth(const T& a, const T& b) {
  const auto from = a > T(0), to = b > T(0), enters = to && !from, leaves = from && !to;
  MeanDepth<T> out{select(from && to, T(0.5 * (a + b)), T(0)), select(from && to, T(0.5), T(0))};
  if (any(enters)) {
    out.depth = select(enters, T(0.5 * b * b / (b - a)), out.depth);
    out.rate = select(enters, T(0.5 * b * (b - 2 * a) / ((b - a) * (b - a))), out.rate);
  }
  if (any(leaves)) {
    out.depth = select(leaves, T(0.5 * a * a / (a - b)), out.depth);
    out.rate = select(leaves, T(0.5 * a * a / ((a - b) * (a - b))), out.rate);
  }
  return out;
}

template <typename T>
T calcNorm(const Vector3<T>& x) {
  using std::sqrt;
  return sqrt(x.squaredNorm());
}

template <typename T>
Vector3<T> shorten(const Vector3<T>& vector, const T& norm, const T& length) {
  const auto is_longer = norm > length;
  if (!any(is_longer)) return vector;
  return select(is_longer, Vector3<T>(vector * (length / norm)), vector);
}

}  // namespace

std::vector<ContactPoint> makeContactPoints(const Model& model, const Ground& ground, const ContactOptions& options) {
  const int grid = ground.steps.empty() ? 2 : options.grid;
  const double sole = calcWeight(model) / options.sinkage;
  std::vector<ContactPoint> points;
  for (size_t c = 0; c < model.contacts().size(); ++c) {
    const ContactFrame& contact = model.contacts()[c];
    const int along_x = contact.kind == ContactKind::Point3D ? 1 : grid,
              along_y = contact.kind == ContactKind::Surface6D ? grid : 1, count = along_x * along_y,
              corners = std::min(along_x, 2) * std::min(along_y, 2);
    for (int i = 0; i < count; ++i) {
      ContactPoint point;
      point.contact = static_cast<int>(c);
      point.body = contact.body;
      const auto place = [](int i, int points) { return points > 1 ? 1 - 2.0 * i / (points - 1) : 0; };  // from 1 to -1
      const double x = place(i % along_x, along_x), y = place(i / along_x, along_y);
      point.is_corner = (along_x == 1 || std::abs(x) == 1) && (along_y == 1 || std::abs(y) == 1);
      const double hollow = point.is_corner ? 0 : kHollow * options.sinkage;
      const int sharers = point.is_corner ? corners : count;
      point.p = contact.X_BF.act(Vector3d(x * contact.half_length, y * contact.half_width, hollow));
      point.stiffness = sole / sharers;
      point.damping = options.damping;
      point.shear_stiffness = options.shear_ratio * point.stiffness;
      point.shear_damping = options.shear_damping * 2 * std::sqrt(options.shear_ratio * sole * model.mass()) / sharers;
      points.push_back(point);
    }
  }
  return points;
}

template <typename T>
TouchOf<T> findTouch(const GroundsOf<T>& grounds, const Vector3<T>& x, const Vector3<T>& from) {
  if constexpr (std::is_same_v<T, double>) {
    const Terrain::Touch touch = grounds.terrains[0]->touch(x, from);
    return {touch.depth, touch.normal};
  } else {
    if (!grounds.hasSteps()) return {grounds.height - x.z(), Vector3<T>::UnitZ()};
    TouchOf<T> out;
    for (Eigen::Index l = 0; l < kLane; ++l) {
      const auto getLane = [l](const Vector3<T>& v) { return Vector3d(v[0][l], v[1][l], v[2][l]); };
      const Terrain::Touch touch = grounds.terrains[l]->touch(getLane(x), getLane(from));
      out.depth.set(l, touch.depth);
      for (int i = 0; i < 3; ++i) out.normal[i].set(l, touch.normal[i]);
    }
    return out;
  }
}

ContactForce calcContactForce(const Terrain& terrain, const ContactPoint& point, const Vector3d& x,
                              const Vector3d& velocity, bool with_damping, const ContactStep& step) {
  return calcContactForce<double>(findTouch<double>(terrain, x, point.from), terrain.ground().friction, point, x,
                                  velocity, with_damping, step);
}

template <typename T>
ContactForceOf<T> calcContactForce(const TouchOf<T>& touch, const T& mu, const ContactPointOf<T>& point,
                                   const Vector3<T>& x, const Vector3<T>& velocity, bool with_damping,
                                   const ContactStepOf<T>& step) {
  ContactForceOf<T> out;
  const Vector3<T>& n = touch.normal;
  const T approach = -n.dot(velocity), before = -n.dot(step.before), h = step.h;
  const MeanDepth<T> mean =
      calcMeanDepth<T>(touch.depth - 0.5 * h * before, touch.depth + 0.5 * h * (2 * approach - before));
  const auto touches = mean.depth > T(0);
  if (!any(touches)) return out;
  const T stiffness = point.share * point.stiffness, shear_stiffness = point.share * point.shear_stiffness,
          shear_damping = point.share * point.shear_damping;
  NormalForce<T> normal = calcNormalForce<T>(stiffness, point.damping, mean.depth, approach);
  normal.rate += normal.force / mean.depth * mean.rate * h;
  const T limit = mu * normal.force;
  const Vector3<T> anchor = select(point.touches, point.anchor, x);
  out.shift = 0.5 * h * (velocity - step.before);
  const Vector3<T> shift = x + out.shift - anchor, sliding = velocity + approach * n;
  const Vector3<T> held = -shear_stiffness * (shift - n.dot(shift) * n);
  const T stretch = calcNorm(held);
  out.spring = shorten<T>(held, stretch, limit);
  const Vector3<T> wanted = out.spring - shear_damping * sliding;
  const T size = calcNorm(wanted);
  const Vector3<T> friction = shorten<T>(wanted, size, limit);
  out.force = normal.force * n + friction;
  out.elastic = 0.5 * stiffness * mean.depth * mean.depth + 0.5 * out.spring.squaredNorm() / shear_stiffness;
  const auto drags = stretch > limit, slips = size > limit;
  out.slides = touches && (drags || slips);
  if (with_damping) {
    const Matrix3<T> along = n * n.transpose();
    const T limit_rate = mu * normal.rate;  // the cone narrows as the point lifts
    const Matrix3<T> across = Matrix3<T>::Identity() - along;
    const T stiff = 0.5 * h * shear_stiffness;
    const Matrix3<T> damper = shear_damping * across;
    Matrix3<T> shear = damper;
    if (!all(drags)) shear += stiff * across;
    if (any(drags)) {
      const Vector3<T> direction = held / stretch;
      Matrix3<T> dragged = damper;
      dragged += limit / stretch * stiff * (across - direction * direction.transpose()) +
                 limit_rate * direction * n.transpose();
      shear = select(drags, dragged, shear);
    }
    if (any(slips)) {
      const Vector3<T> direction = wanted / size;
      const Matrix3<T> slipping =
          limit / size * (shear - direction * (direction.transpose() * shear)) + limit_rate * direction * n.transpose();
      shear = select(slips, slipping, shear);
    }
    out.damping = normal.rate * along + shear;
  }
  if (!all(touches)) {
    const Vector3<T> zero = Vector3<T>::Zero();
    out.force = select(touches, out.force, zero);
    out.spring = select(touches, out.spring, zero);
    out.shift = select(touches, out.shift, zero);
    out.elastic = select(touches, out.elastic, T(0));
    out.damping = select(touches, out.damping, Matrix3<T>(Matrix3<T>::Zero()));
  }
  return out;
}

template <typename T>
void updateAnchor(const GroundsOf<T>& grounds, const Vector3<T>& x, const ContactForceOf<T>& force,
                  ContactPointOf<T>& point) {
  const Vector3<T> at = x + force.shift;
  const TouchOf<T> touch = findTouch<T>(grounds, at, point.from);
  point.touches = touch.depth > T(0);
  point.anchor = point.from = at;
  if (!any(point.touches)) return;
  point.anchor = select(point.touches, Vector3<T>(at + force.spring / (point.share * point.shear_stiffness)), at);
  point.from = select(point.touches, Vector3<T>(at + touch.depth * touch.normal), at);
}

ContactPoint takeLane(const ContactPointOf<Lanes>& point, int lane) {
  ContactPoint out;
  out.contact = point.contact;
  out.body = point.body;
  out.is_corner = point.is_corner;
  out.damping = point.damping;
  out.stiffness = point.stiffness[lane];
  out.shear_stiffness = point.shear_stiffness[lane];
  out.shear_damping = point.shear_damping[lane];
  out.share = point.share[lane];
  out.touches = point.touches[lane];
  for (int i = 0; i < 3; ++i) {
    out.p[i] = point.p[i][lane];
    out.anchor[i] = point.anchor[i][lane];
    out.from[i] = point.from[i][lane];
  }
  return out;
}

double calcLeastHeight(const Model& model, Workspace& ws, ConstVectorRef q) {
  updatePlacements<double>(model, ws, q);
  double least = std::numeric_limits<double>::infinity();
  for (const ContactFrame& contact : model.contacts())
    for (double x : {-contact.half_length, contact.half_length})
      for (double y : {-contact.half_width, contact.half_width})
        least = std::min(least, ws.X_WB[contact.body].act(contact.X_BF.act(Vector3d(x, y, 0))).z());
  return least;
}

std::vector<ContactArea> makeContactAreas(const Model& model, const std::vector<ContactPoint>& points) {
  std::vector<ContactArea> areas;
  for (size_t i = 0; i < points.size(); ++i) {
    const ContactFrame& contact = model.contacts()[points[i].contact];
    if (contact.kind == ContactKind::Point3D) continue;
    if (i == 0 || points[i].contact != points[i - 1].contact)
      areas.push_back({contact.body, contact.X_BF, contact.half_length, contact.half_width, 1, i, {}, {}});
    areas.back().homes.push_back(contact.X_BF.inverse().act(points[i].p));
    areas.back().places.push_back({});
    areas.back().places.back().is_corner = points[i].is_corner;
    if (!points[i].is_corner) areas.back().corner_share = points[areas.back().first].stiffness / points[i].stiffness;
  }
  for (ContactArea& area : areas) area.lane.resize(area.first + area.homes.size());
  return areas;
}

template <>
void settle<double>(const GroundsOf<double>& grounds, const SE3& X_WF, ContactArea& area,
                    std::vector<ContactPoint>& points) {
  const Matrix3d& R = X_WF.R;
  const Eigen::Matrix2d along = R.topLeftCorner<2, 2>(), back = along.inverse();
  const Eigen::Vector2d slope = -R.col(2).head<2>() / R(2, 2), centre = X_WF.p.head<2>();
  const Vector3d plane(X_WF.p.z() - slope.dot(centre), slope.x(), slope.y());
  const double x = area.half_length, y = area.half_width;
  const Terrain::Corners corners = {centre + along * Eigen::Vector2d(x, y), centre + along * Eigen::Vector2d(-x, y),
                                    centre + along * Eigen::Vector2d(-x, -y), centre + along * Eigen::Vector2d(x, -y)};
  for (size_t i = 0; i < area.homes.size(); ++i)
    area.places[i].home = area.places[i].support = centre + along * area.homes[i].head<2>();
  if (R(2, 2) > kSteep) grounds.terrains[0]->findSupports(corners, plane, kOver, kUnder, area.places);
  for (size_t i = 0; i < area.homes.size(); ++i) {
    const Eigen::Vector2d& support = area.places[i].support;
    const bool is_home = support == area.places[i].home;
    const Vector3d& home = area.homes[i];
    const Eigen::Vector2d there =
        is_home ? Eigen::Vector2d(home.head<2>()) : Eigen::Vector2d(back * (support - centre));
    ContactPoint& point = points[area.first + i];
    const bool is_added = !is_home && area.places[i].takes_corner && !area.places[i].is_corner;
    const Vector3d p = area.X_BF.act(Vector3d(there.x(), there.y(), is_added ? 0 : home.z()));
    const Vector3d shift = R * (area.X_BF.R.transpose() * (p - point.p));
    point.p = p;
    point.share = is_added ? area.corner_share : 1;
    point.anchor += shift;
    point.from += shift;
    // What lies on an edge has come from above, though the foot slips over it.
    if (!is_home) point.from.z() = std::max(point.from.z(), plane[0] + plane.tail<2>().dot(support) + kUnder);
  }
}

// One robot after the other: only where the ground has steps.
template <>
void settle<Lanes>(const GroundsOf<Lanes>& grounds, const SE3Of<Lanes>& X_WF, ContactArea& area,
                   std::vector<ContactPointOf<Lanes>>& points) {
  constexpr Vector3<Lanes> ContactPointOf<Lanes>::*kParts[] = {
      &ContactPointOf<Lanes>::p, &ContactPointOf<Lanes>::anchor, &ContactPointOf<Lanes>::from};
  constexpr Vector3d ContactPoint::*kOwn[] = {&ContactPoint::p, &ContactPoint::anchor, &ContactPoint::from};
  std::vector<ContactPoint>& one = area.lane;
  for (Eigen::Index l = 0; l < kLane; ++l) {
    SE3 X;
    for (int i = 0; i < 9; ++i) X.R.data()[i] = X_WF.R.data()[i][l];
    for (int i = 0; i < 3; ++i) X.p[i] = X_WF.p[i][l];
    for (size_t k = area.first; k < area.first + area.homes.size(); ++k)
      for (int part = 0; part < 3; ++part)
        for (int i = 0; i < 3; ++i) (one[k].*kOwn[part])[i] = (points[k].*kParts[part])[i][l];
    settle<double>(*grounds.terrains[l], X, area, one);
    for (size_t k = area.first; k < area.first + area.homes.size(); ++k) {
      points[k].share.set(l, one[k].share);
      for (int part = 0; part < 3; ++part)
        for (int i = 0; i < 3; ++i) (points[k].*kParts[part])[i].set(l, (one[k].*kOwn[part])[i]);
    }
  }
}

std::vector<JointStop> makeJointStops(const Model& model) {
  const double weight = calcWeight(model);
  std::vector<JointStop> stops;
  for (int i = 1; i < model.numBodies(); ++i) {
    const Joint& joint = model.joints()[i];
    if (!hasStops(joint.kind)) continue;
    for (int k = 0; k < joint.nv; ++k) {
      const int dof = joint.idx_v + k;
      const double lower = model.lowerLimits()[dof], upper = model.upperLimits()[dof];
      if (!std::isfinite(lower) && !std::isfinite(upper)) continue;
      const bool slides = joint.kind == JointKind::Prismatic;
      const double range = upper - lower;
      if (range > 0 && range < (slides ? kShiftOfPlay : kTurnOfPlay))
        stops.push_back({dof, joint.idx_q + k, lower, upper, weight / (kShareOfPlay * range), kCrossing / range});
      else
        stops.push_back({dof, joint.idx_q + k, lower, upper, weight / (slides ? kShift : kTurn),
                         slides ? 10 * kStopDamping : kStopDamping});
    }
  }
  return stops;
}

bool hasStops(JointKind kind) { return getNv(kind) == 1 || kind == JointKind::Universal; }

template <typename T>
StopForceOf<T> calcStopForce(const JointStop& stop, const T& q, const T& v, const StopStepOf<T>& step) {
  const T above = q - stop.upper, below = stop.lower - q;
  const auto is_above = above > below;
  const T sign = select(is_above, T(1), T(-1)), depth = select(is_above, above, below), h = sign * step.h;
  const MeanDepth<T> mean = calcMeanDepth<T>(depth - 0.5 * h * step.before, depth + 0.5 * h * (2 * v - step.before));
  const auto touches = mean.depth > T(0);
  if (!any(touches)) return {};
  const NormalForce<T> normal = calcNormalForce<T>(T(stop.stiffness), stop.damping, mean.depth, sign * v);
  return {select(touches, T(-sign * normal.force), T(0)),
          select(touches, T(0.5 * stop.stiffness * mean.depth * mean.depth), T(0)),
          select(touches, T(normal.rate + normal.force / mean.depth * mean.rate * step.h), T(0))};
}

template TouchOf<double> findTouch(const GroundsOf<double>&, const Vector3d&, const Vector3d&);
template TouchOf<Lanes> findTouch(const GroundsOf<Lanes>&, const Vector3<Lanes>&, const Vector3<Lanes>&);
template ContactForce calcContactForce(const TouchOf<double>&, const double&, const ContactPoint&, const Vector3d&,
                                       const Vector3d&, bool, const ContactStep&);
template ContactForceOf<Lanes> calcContactForce(const TouchOf<Lanes>&, const Lanes&, const ContactPointOf<Lanes>&,
                                                const Vector3<Lanes>&, const Vector3<Lanes>&, bool,
                                                const ContactStepOf<Lanes>&);
template void updateAnchor(const GroundsOf<double>&, const Vector3d&, const ContactForce&, ContactPoint&);
template void updateAnchor(const GroundsOf<Lanes>&, const Vector3<Lanes>&, const ContactForceOf<Lanes>&,
                           ContactPointOf<Lanes>&);
template StopForce calcStopForce(const JointStop&, const double&, const double&, const StopStep&);
template StopForceOf<Lanes> calcStopForce(const JointStop&, const Lanes&, const Lanes&, const StopStepOf<Lanes>&);

}  // namespace bielle::worlds
