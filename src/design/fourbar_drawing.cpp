#include "design/fourbar_drawing.h"

#include <algorithm>
#include <cmath>

namespace bielle {
namespace {

using Point = Eigen::Vector2d;

double cross(const Point& a, const Point& b) { return a.x() * b.y() - a.y() * b.x(); }
Point point(double radius, double angle) { return {radius * std::cos(angle), radius * std::sin(angle)}; }

// Of the segment from a to b from the origin.
double calcDistance(const Point& a, const Point& b) {
  const Point way = b - a;
  return (a + std::clamp(-a.dot(way) / way.squaredNorm(), 0.0, 1.0) * way).norm();
}

}  // namespace

FourBarDrawing FourBarDrawing::fromVector(const VectorXd& x) { return {x[0], x[1], x[2], x[3], x[4], x[5]}; }
VectorXd FourBarDrawing::toVector() const {
  VectorXd x(kCount);
  x << motor_x, motor_z, crank, crank_angle, arm, arm_angle;
  return x;
}

FourBarState calcFourBar(const FourBarDrawing& d, double turn) {
  const Point M(d.motor_x, d.motor_z), B0 = M + point(d.crank, d.crank_angle), F0 = point(d.arm, d.arm_angle);
  const Point F = point(d.arm, d.arm_angle - turn), w = F - M;
  const double rod2 = (F0 - B0).squaredNorm(), l = w.norm(), h = (l * l + d.crank * d.crank - rod2) / (2 * l);
  const double square = d.crank * d.crank - h * h;
  FourBarState state;
  if (!(square > 0)) return state;
  const double side = cross(F0 - M, B0 - M) > 0 ? 1 : -1;
  const Point arm = h / l * w + side * std::sqrt(square) / l * Point(-w.y(), w.x()), r = F - M - arm;
  const double at_crank = cross(r, arm), at_joint = cross(r, F), rod = r.norm();
  state.closes = true;
  state.ratio = at_joint / at_crank;
  state.sine = std::min(std::abs(at_joint) / (rod * d.arm), std::abs(at_crank) / (rod * d.crank));
  state.turn = std::remainder(d.crank_angle - std::atan2(arm.y(), arm.x()), 2 * M_PI);
  state.nearest = calcDistance(M + arm, F);
  return state;
}

LinkageFamily makeFourBars(const FourBarSpace& space, const JointDemand& demand) {
  const VectorXd turns = demand.angles.array() - demand.middle();
  const auto calc_ratios = [space, turns](const VectorXd& x, VectorXd& ratios, double& margin) {
    const FourBarDrawing drawing = FourBarDrawing::fromVector(x);
    margin = 1;
    for (Eigen::Index k = 0; k < turns.size(); ++k) {
      const FourBarState state = calcFourBar(drawing, turns[k]);
      if (!state.closes || state.sine < space.margin || state.nearest < space.clearance) return false;
      ratios[k] = std::abs(state.ratio);
      margin = std::min(margin, state.sine);
    }
    return true;
  };
  return {space.lower, space.upper, calc_ratios};
}

}  // namespace bielle
