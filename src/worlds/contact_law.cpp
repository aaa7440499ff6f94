#include "worlds/contact_law.h"

#include <algorithm>
#include <cmath>

namespace bielle::worlds {
namespace {

// A stop gives way by this under a torque of the robot's weight times one metre, or under its weight, rad or m.
constexpr double kTurn = 0.02, kShift = 1e-3;
constexpr double kLeastGravity = 1;   // m/s^2; where there is less, soles and stops are as hard as on Earth
constexpr double kStopDamping = 0.5;  // s/rad; s/m of sliding joints is longer by their ratio of speeds, about 10

// The ground is at a place of a sole that is at most so far above it, or as deep in it, m.
constexpr double kOver = 2e-4, kUnder = 5e-3;
constexpr double kSteep = 0.5;  // cosine between a sole and the level: points of steeper ones stay where they are

// Eq. (1)
struct NormalForce {
  double force = 0, rate = 0;  // rate: d force / d d'
};
NormalForce calcNormalForce(double stiffness, double damping, double depth, double depth_rate) {
  const double factor = 1 + damping * depth_rate;
  if (factor <= 0) return {};
  return {stiffness * depth * factor, stiffness * depth * damping};
}

// N. From it follows how hard soles and stops are, which does not vanish with the gravity.
double calcWeight(const Model& model) {
  const double gravity = model.gravity().norm();
  return model.mass() * (gravity > kLeastGravity ? gravity : 9.81);
}

// Eq. (5), from a to b.
struct MeanDepth {
  double depth = 0, rate = 0;  // rate: d depth / d b
};
MeanDepth calcMeanDepth(double a, double b) {
  if (a > 0 && b > 0) return {0.5 * (a + b), 0.5};
  if (b > 0) return {0.5 * b * b / (b - a), 0.5 * b * (b - 2 * a) / ((b - a) * (b - a))};
  if (a > 0) return {0.5 * a * a / (a - b), 0.5 * a * a / ((a - b) * (a - b))};
  return {};
}

Vector3d shorten(const Vector3d& vector, double length) {
  const double norm = vector.norm();
  return norm > length ? Vector3d(vector * (length / norm)) : vector;
}

}  // namespace

std::vector<ContactPoint> makeContactPoints(const Model& model, const Ground& ground, const ContactOptions& options) {
  const int grid = ground.steps.empty() ? 2 : options.grid;
  const double sole = calcWeight(model) / options.sinkage;
  std::vector<ContactPoint> points;
  for (size_t c = 0; c < model.contacts().size(); ++c) {
    const ContactFrame& contact = model.contacts()[c];
    const int along_x = contact.kind == ContactKind::Point3D ? 1 : grid,
              along_y = contact.kind == ContactKind::Surface6D ? grid : 1, count = along_x * along_y;
    for (int i = 0; i < count; ++i) {
      ContactPoint point;
      point.contact = static_cast<int>(c);
      point.body = contact.body;
      const auto place = [](int i, int points) { return points > 1 ? 1 - 2.0 * i / (points - 1) : 0; };  // from 1 to -1
      const double x = place(i % along_x, along_x) * contact.half_length,
                   y = place(i / along_x, along_y) * contact.half_width;
      point.p = contact.X_BF.act(Vector3d(x, y, 0));
      point.stiffness = sole / count;
      point.damping = options.damping;
      point.shear_stiffness = options.shear_ratio * point.stiffness;
      point.shear_damping = options.shear_damping * 2 * std::sqrt(options.shear_ratio * sole * model.mass()) / count;
      points.push_back(point);
    }
  }
  return points;
}

ContactForce calcContactForce(const Terrain& terrain, const ContactPoint& point, const Vector3d& x,
                              const Vector3d& velocity, bool with_damping, const ContactStep& step) {
  return calcContactForce(terrain.touch(x, point.from), terrain.ground().friction, point, x, velocity, with_damping,
                          step);
}

ContactForce calcContactForce(const Terrain::Touch& touch, double mu, const ContactPoint& point, const Vector3d& x,
                              const Vector3d& velocity, bool with_damping, const ContactStep& step) {
  ContactForce out;
  const Vector3d& n = touch.normal;
  const double approach = -n.dot(velocity), before = -n.dot(step.before), h = step.h;
  const MeanDepth mean = calcMeanDepth(touch.depth - 0.5 * h * before, touch.depth + 0.5 * h * (2 * approach - before));
  if (!(mean.depth > 0)) return out;
  NormalForce normal = calcNormalForce(point.stiffness, point.damping, mean.depth, approach);
  normal.rate += normal.force / mean.depth * mean.rate * h;
  const double limit = mu * normal.force;
  const Vector3d anchor = point.touches ? point.anchor : x;
  out.shift = 0.5 * h * (velocity - step.before);
  const Vector3d shift = x + out.shift - anchor, sliding = velocity + approach * n;
  const Vector3d held = -point.shear_stiffness * (shift - n.dot(shift) * n);
  out.spring = shorten(held, limit);
  const Vector3d wanted = out.spring - point.shear_damping * sliding, friction = shorten(wanted, limit);
  out.force = normal.force * n + friction;
  out.elastic =
      0.5 * point.stiffness * mean.depth * mean.depth + 0.5 * out.spring.squaredNorm() / point.shear_stiffness;
  const double stretch = held.norm(), size = wanted.norm();
  out.slides = stretch > limit || size > limit;
  if (!with_damping) return out;
  const Matrix3d along = n * n.transpose();
  const double limit_rate = mu * normal.rate;  // the cone narrows as the point lifts
  const Matrix3d across = Matrix3d::Identity() - along;
  Matrix3d shear = point.shear_damping * across;
  const double stiff = 0.5 * h * point.shear_stiffness;
  if (stretch > limit) {
    const Vector3d direction = held / stretch;
    shear +=
        limit / stretch * stiff * (across - direction * direction.transpose()) + limit_rate * direction * n.transpose();
  } else {
    shear += stiff * across;
  }
  if (size > limit) {
    const Vector3d direction = wanted / size;
    shear =
        (limit / size * (shear - direction * (direction.transpose() * shear)) + limit_rate * direction * n.transpose())
            .eval();
  }
  out.damping = normal.rate * along + shear;
  return out;
}

void updateAnchor(const Terrain& terrain, const Vector3d& x, const ContactForce& force, ContactPoint& point) {
  const Vector3d at = x + force.shift;
  const Terrain::Touch touch = terrain.touch(at, point.from);
  point.touches = touch.depth > 0;
  point.anchor = point.from = at;
  if (!point.touches) return;
  point.anchor += force.spring / point.shear_stiffness;
  point.from += touch.depth * touch.normal;
}

std::vector<ContactArea> makeContactAreas(const Model& model, const std::vector<ContactPoint>& points) {
  std::vector<ContactArea> areas;
  for (size_t i = 0; i < points.size(); ++i) {
    const ContactFrame& contact = model.contacts()[points[i].contact];
    if (contact.kind == ContactKind::Point3D) continue;
    if (i == 0 || points[i].contact != points[i - 1].contact)
      areas.push_back({contact.body, contact.X_BF, contact.half_length, contact.half_width, i, {}, {}});
    areas.back().homes.push_back(contact.X_BF.inverse().act(points[i].p).head<2>());
  }
  for (ContactArea& area : areas) area.places.resize(area.homes.size());
  return areas;
}

void settle(const Terrain& terrain, const SE3& X_WF, ContactArea& area, std::vector<ContactPoint>& points) {
  const Matrix3d& R = X_WF.R;
  const Eigen::Matrix2d along = R.topLeftCorner<2, 2>(), back = along.inverse();
  const Eigen::Vector2d slope = -R.col(2).head<2>() / R(2, 2), centre = X_WF.p.head<2>();
  const Vector3d plane(X_WF.p.z() - slope.dot(centre), slope.x(), slope.y());
  const double x = area.half_length, y = area.half_width;
  const Terrain::Corners corners = {centre + along * Eigen::Vector2d(x, y), centre + along * Eigen::Vector2d(-x, y),
                                    centre + along * Eigen::Vector2d(-x, -y), centre + along * Eigen::Vector2d(x, -y)};
  for (size_t i = 0; i < area.homes.size(); ++i)
    area.places[i].home = area.places[i].support = centre + along * area.homes[i];
  if (R(2, 2) > kSteep) terrain.findSupports(corners, plane, kOver, kUnder, area.places);
  for (size_t i = 0; i < area.homes.size(); ++i) {
    const Eigen::Vector2d& support = area.places[i].support;
    const bool is_home = support == area.places[i].home;
    const Eigen::Vector2d there = is_home ? area.homes[i] : Eigen::Vector2d(back * (support - centre));
    ContactPoint& point = points[area.first + i];
    const Vector3d p = area.X_BF.act(Vector3d(there.x(), there.y(), 0));
    const Vector3d shift = R * (area.X_BF.R.transpose() * (p - point.p));
    point.p = p;
    point.anchor += shift;
    point.from += shift;
    // What lies on an edge has come from above, though the foot slips over it.
    if (!is_home) point.from.z() = std::max(point.from.z(), plane[0] + plane.tail<2>().dot(support) + kUnder);
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
      stops.push_back({dof, joint.idx_q + k, lower, upper, weight / (slides ? kShift : kTurn),
                       slides ? 10 * kStopDamping : kStopDamping});
    }
  }
  return stops;
}

bool hasStops(JointKind kind) { return getNv(kind) == 1 || kind == JointKind::Universal; }

StopForce calcStopForce(const JointStop& stop, double q, double v, const StopStep& step) {
  const double above = q - stop.upper, below = stop.lower - q;
  const double sign = above > below ? 1 : -1, depth = std::max(above, below), h = sign * step.h;
  const MeanDepth mean = calcMeanDepth(depth - 0.5 * h * step.before, depth + 0.5 * h * (2 * v - step.before));
  if (!(mean.depth > 0)) return {};
  const NormalForce normal = calcNormalForce(stop.stiffness, stop.damping, mean.depth, sign * v);
  return {-sign * normal.force, 0.5 * stop.stiffness * mean.depth * mean.depth,
          normal.rate + normal.force / mean.depth * mean.rate * step.h};
}

}  // namespace bielle::worlds
