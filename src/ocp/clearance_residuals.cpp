// Residuals that keep bodies apart: soles over the ground, capsules from each other.
#include <algorithm>
#include <cmath>

#include "bielle/dynamics/kinematics.h"
#include "bielle/ocp/residual.h"

namespace bielle {
namespace {

Vector3d calcPoint(const NodeView& node, const BodyFrame& frame, const Vector3d& offset) {
  return getPlacement(node.ws, frame.body, frame.X_BF).act(offset);
}

// Height of the ramp around a step over the plane, and its slope in world x and y.
struct Ramp {
  double height = 0;
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();
};

// \param floor  height of the plane
Ramp calcRamp(const GroundStep& step, double floor, double width, const Eigen::Vector2d& point) {
  const double c = std::cos(step.yaw), s = std::sin(step.yaw);
  Eigen::Matrix2d R;
  R << c, -s, s, c;
  const Eigen::Vector2d local = R.transpose() * (point - step.top.head<2>()), half(0.5 * step.length, 0.5 * step.width),
                        beyond = (local.cwiseAbs() - half).cwiseMax(0.0);
  const double distance = beyond.norm();
  if (distance >= width) return {};
  const double t = 1 - distance / width, share = t * t * (3 - 2 * t);
  const double rise = step.calcHeight(point.x(), point.y()) - floor;
  const Eigen::Vector2d top_slope(-std::tan(step.pitch), std::tan(step.roll) / std::cos(step.pitch));
  Ramp ramp{rise * share, share * (R * top_slope)};
  if (distance == 0) return ramp;
  const Eigen::Vector2d outward = beyond.cwiseProduct(local.cwiseSign()) / distance;
  ramp.slope -= rise * 6 * t * (1 - t) / width * (R * outward);
  return ramp;
}

class SoleClearance : public Residual {
 public:
  SoleClearance(const BodyFrame& sole, double X, double Y, const Ground& ground, double ramp)
      : sole_(sole), ground_(ground), ramp_(ramp) {
    if (X > 0 && Y > 0)
      corners_ = {Vector3d(X, Y, 0), Vector3d(X, -Y, 0), Vector3d(-X, Y, 0), Vector3d(-X, -Y, 0)};
    else
      corners_ = {Vector3d::Zero()};
  }
  int size() const override { return static_cast<int>(corners_.size()); }
  void calc(const NodeView& node, VectorRef r) const override {
    for (size_t i = 0; i < corners_.size(); ++i) {
      const Vector3d p = calcPoint(node, sole_, corners_[i]);
      r[i] = p.z() - ground_.height - calcGround(p.head<2>()).height;
    }
  }
  void calcJacobian(const NodeView& node, ResidualRows rows) const override {
    for (size_t i = 0; i < corners_.size(); ++i) {
      const Vector3d p = calcPoint(node, sole_, corners_[i]);
      const Eigen::Vector2d slope = calcGround(p.head<2>()).slope;
      const Vector3d up(-slope.x(), -slope.y(), 1);
      for (int k : node.model.supportDofs(sole_.body)) {
        const auto J = node.ws.J.col(k);
        rows.q(i, k) = up.dot(J.head<3>() + J.tail<3>().cross(p));
      }
    }
  }

 private:
  Ramp calcGround(const Eigen::Vector2d& point) const {
    Ramp highest;
    for (const GroundStep& step : ground_.steps) {
      const Ramp ramp = calcRamp(step, ground_.height, ramp_, point);
      if (ramp.height > highest.height) highest = ramp;
    }
    return highest;
  }

  BodyFrame sole_;
  Ground ground_;
  double ramp_;
  std::vector<Vector3d> corners_;
};

// Closest points p1 + s d1 and p2 + t d2 of two segments, s and t in [0, 1] (Ericson, "Real-Time Collision Detection",
// 5.1.9).
std::pair<double, double> calcClosest(const Vector3d& p1, const Vector3d& d1, const Vector3d& p2, const Vector3d& d2) {
  const auto clamp = [](double x) { return std::clamp(x, 0.0, 1.0); };
  const Vector3d r = p1 - p2;
  const double a = d1.squaredNorm(), e = d2.squaredNorm(), b = d1.dot(d2), c = d1.dot(r), f = d2.dot(r);
  if (a == 0) return {0, e == 0 ? 0 : clamp(f / e)};
  if (e == 0) return {clamp(-c / a), 0};
  const double denominator = a * e - b * b;
  const double s = denominator > 1e-12 * a * e ? clamp((b * f - c * e) / denominator) : 0.5;
  const double t = (b * s + f) / e;
  if (t < 0) return {clamp(-c / a), 0};
  if (t > 1) return {clamp((b - c) / a), 1};
  return {s, t};
}

// Of the middle lines of two capsules.
std::pair<Vector3d, Vector3d> calcClosestPoints(const Capsule& a, const SE3& X_WA, const Capsule& b, const SE3& X_WB) {
  const Vector3d a0 = X_WA.act(a.from), da = X_WA.act(a.to) - a0, b0 = X_WB.act(b.from), db = X_WB.act(b.to) - b0;
  const auto [s, t] = calcClosest(a0, da, b0, db);
  return {a0 + s * da, b0 + t * db};
}

class CapsuleDistance : public Residual {
 public:
  CapsuleDistance(const Capsule& a, const Capsule& b) : a_(a), b_(b) {}
  int size() const override { return 1; }
  void calc(const NodeView& node, VectorRef r) const override {
    r[0] = calcCapsuleDistance(a_, node.ws.X_WB[a_.body], b_, node.ws.X_WB[b_.body]);
  }
  // The closest points may count as fixed to their bodies: moving them along their segments changes nothing, to first
  // order.
  void calcJacobian(const NodeView& node, ResidualRows rows) const override {
    const auto [pa, pb] = calcClosestPoints(a_, node.ws.X_WB[a_.body], b_, node.ws.X_WB[b_.body]);
    const Vector3d normal = (pa - pb) / std::max((pa - pb).norm(), 1e-9);
    for (int body : {a_.body, b_.body})
      for (int k : node.model.supportDofs(body)) rows.q(0, k) = 0;
    const auto add = [&](int body, const Vector3d& p, double sign) {
      for (int k : node.model.supportDofs(body)) {
        const auto J = node.ws.J.col(k);
        rows.q(0, k) += sign * normal.dot(J.head<3>() + J.tail<3>().cross(p));
      }
    };
    add(a_.body, pa, 1);
    add(b_.body, pb, -1);
  }

 private:
  Capsule a_, b_;
};

}  // namespace

std::unique_ptr<Residual> makeSoleClearance(const BodyFrame& sole, double half_length, double half_width,
                                            const Ground& ground, double ramp) {
  return std::make_unique<SoleClearance>(sole, half_length, half_width, ground, ramp);
}
std::unique_ptr<Residual> makeCapsuleDistance(const Capsule& a, const Capsule& b) {
  return std::make_unique<CapsuleDistance>(a, b);
}

double calcCapsuleDistance(const Capsule& a, const SE3& X_WA, const Capsule& b, const SE3& X_WB) {
  const auto [pa, pb] = calcClosestPoints(a, X_WA, b, X_WB);
  return (pa - pb).norm() - a.radius - b.radius;
}

}  // namespace bielle
