// Residuals that keep bodies apart: soles over the ground, shapes from each other.
#include <algorithm>
#include <cmath>

#include "bielle/dynamics/distance.h"
#include "bielle/dynamics/kinematics.h"
#include "ocp/residual_data.h"

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

class SoleClearance : public DescribedResidual {
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
  ResidualData describe() const override {
    MatrixXd corners(corners_.size(), 3), steps(ground_.steps.size(), 8);
    for (size_t i = 0; i < corners_.size(); ++i) corners.row(static_cast<Eigen::Index>(i)) = corners_[i].transpose();
    for (size_t i = 0; i < ground_.steps.size(); ++i) {
      const GroundStep& step = ground_.steps[i];
      steps.row(static_cast<Eigen::Index>(i)) << step.top.transpose(), step.length, step.width, step.yaw, step.pitch,
          step.roll;
    }
    ResidualData data{"sole_clearance", {{"body", sole_.body}}};
    addPlacement("_BF", sole_.X_BF, data);
    data.values.insert(data.values.end(),
                       {{"corners", corners}, {"height", ground_.height}, {"steps", steps}, {"ramp", ramp_}});
    return data;
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

class ShapeDistanceResidual : public DescribedResidual {
 public:
  ShapeDistanceResidual(const Shape& a, const Shape& b) : a_(a), b_(b) {}
  int size() const override { return 1; }
  void calc(const NodeView& node, VectorRef r) const override {
    r[0] = calcDistance(a_, node.ws.X_WB[a_.body], b_, node.ws.X_WB[b_.body]).distance;
  }
  void calcJacobian(const NodeView& node, ResidualRows rows) const override {
    const ShapeDistance distance = calcDistance(a_, node.ws.X_WB[a_.body], b_, node.ws.X_WB[b_.body]);
    for (int body : {a_.body, b_.body})
      for (int k : node.model.supportDofs(body)) rows.q(0, k) = 0;
    addDistanceGradient(node.model, node.ws, a_, b_, distance, rows.q.topRows(1));
  }
  ResidualData describe() const override {
    ResidualData data{"shape_distance", {}};
    for (const auto& [suffix, shape] : {std::pair("_a", &a_), {"_b", &b_}}) {
      data.values.emplace_back(std::string("body") + suffix, shape->body);
      addPlacement(suffix, shape->X_BS, data);
      data.values.emplace_back(std::string("half") + suffix, VectorXd(shape->half));
      data.values.emplace_back(std::string("radius") + suffix, shape->radius);
    }
    return data;
  }

 private:
  Shape a_, b_;
};

}  // namespace

std::unique_ptr<Residual> makeSoleClearance(const BodyFrame& sole, double half_length, double half_width,
                                            const Ground& ground, double ramp) {
  return std::make_unique<SoleClearance>(sole, half_length, half_width, ground, ramp);
}
std::unique_ptr<Residual> makeShapeDistance(const Shape& a, const Shape& b) {
  return std::make_unique<ShapeDistanceResidual>(a, b);
}

}  // namespace bielle
