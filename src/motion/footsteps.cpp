#include "bielle/motion/footsteps.h"

#include <cmath>

#include "math/constants.h"
#include "math/so3.h"

namespace bielle {
namespace {

SE3 makeTurn(double yaw) { return {makeAxisRotation(Vector3d::UnitZ(), yaw), Vector3d::Zero()}; }

// Largest gap between two rectangles along the axes of the first.
double calcGapAlong(const ContactFrame& a, const SE3& X_Wa, const ContactFrame& b, const SE3& X_Wb) {
  const SE3 X_ab = X_Wa.inverseTimes(X_Wb);
  const Eigen::Vector2d reach = X_ab.R.topLeftCorner<2, 2>().cwiseAbs() * Eigen::Vector2d(b.half_length, b.half_width);
  return std::max(std::abs(X_ab.p.x()) - a.half_length - reach.x(), std::abs(X_ab.p.y()) - a.half_width - reach.y());
}

}  // namespace

double calcHeading(const SE3& X) { return std::atan2(X.R(1, 0), X.R(0, 0)); }

std::array<SE3, 2> FootstepPlan::getStance(int count) const {
  std::array<SE3, 2> stance = start;
  for (int i = 0; i < count; ++i) stance[static_cast<int>(steps[i].side)] = steps[i].X_WF;
  return stance;
}

SE3 calcMiddle(const SE3& left, const SE3& right) {
  const double turn = std::remainder(calcHeading(left) - calcHeading(right), 2 * kPi);
  SE3 middle = makeTurn(calcHeading(right) + turn / 2);
  middle.p = (left.p + right.p) / 2;
  return middle;
}

SE3 calcNextMiddle(const SE3& P, const StepCommand& command, Side side) {
  const Side opening = command.lateral > 0 ? Side::Left : Side::Right;
  const Vector3d move(command.forward, side == opening ? 2 * command.lateral : 0, 0);
  return P * makeTurn(command.yaw / 2) * SE3{Matrix3d::Identity(), move} * makeTurn(command.yaw / 2);
}

FootstepPlan planFootsteps(const SE3& left, const SE3& right, const StepCommand& command, int steps, Side first) {
  FootstepPlan plan{{left, right}, {}};
  SE3 P = calcMiddle(left, right);
  const SE3 X_PF[2] = {P.inverseTimes(left), P.inverseTimes(right)};
  Side side = first;
  for (int i = 0; i < steps; ++i, side = getOther(side)) {
    const bool last = i + 1 == steps;
    if (!last) P = calcNextMiddle(P, command, side);
    plan.steps.push_back({side, P * X_PF[static_cast<int>(side)]});
  }
  return plan;
}

double calcSoleDistance(const ContactFrame& a, const SE3& X_Wa, const ContactFrame& b, const SE3& X_Wb) {
  return std::max(calcGapAlong(a, X_Wa, b, X_Wb), calcGapAlong(b, X_Wb, a, X_Wa));
}

}  // namespace bielle
