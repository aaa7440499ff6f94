#include "bielle/math/se3.h"

#include <cmath>

#include "math/small_angle.h"
#include "math/so3.h"

namespace bielle {

template <>
SE3 SE3::inverse() const {
  return inlineInverse();
}
template <>
SE3 SE3::inverseTimes(const SE3& o) const {
  return inlineInverseTimes(o);
}
template <>
Vector3d SE3::act(const Vector3d& point) const {
  return inlineAct(point);
}
template <>
Vector6d SE3::actMotion(const Vector6d& m) const {
  return inlineActMotion(m);
}
template <>
Vector6d SE3::actInvMotion(const Vector6d& m) const {
  return inlineActInvMotion(m);
}
template <>
Vector6d SE3::actForce(const Vector6d& f) const {
  return inlineActForce(f);
}
template <>
Vector6d SE3::actInvForce(const Vector6d& f) const {
  return inlineActInvForce(f);
}
template <>
Matrix6d SE3::toActionMatrix() const {
  return inlineToActionMatrix();
}
namespace {

// Off-diagonal block Q of the left Jacobian of SE(3) (Barfoot, "State estimation for robotics", eq. 7.86), for the
// twist (rho, phi):
//     Q = P/2 + a (FP + PF + FPF) + b (FFP + PFF - 3 FPF) + c (FPFF + FFPF),     F = [phi]x, P = [rho]x
//     a = (t - sin t)/t^3,  b = (t^2/2 + cos t - 1)/t^4,  c = (b + 3 d)/2,  d = (t - sin t - t^3/6)/t^5,  t = |phi|.
// Returns a, b and c; t^6 terms are kept so that the closed form is never used where it cancels.
template <typename T>
std::array<T, 3> calcLeftQSeries(const T& t2) {
  const T b = 1.0 / 24 - t2 / 720 + t2 * t2 / 40320 - t2 * t2 * t2 / 3628800;
  const T d = -1.0 / 120 + t2 / 5040 - t2 * t2 / 362880 + t2 * t2 * t2 / 39916800;  // (t - sin t - t^3/6) / t^5
  return {1.0 / 6 - t2 / 120 + t2 * t2 / 5040 - t2 * t2 * t2 / 362880, b, 0.5 * (b + 3 * d)};
}

std::array<double, 3> calcLeftQFactors(double t2) {
  if (t2 < kSmallAngleSquared) return calcLeftQSeries(t2);
  const double t = std::sqrt(t2), s = std::sin(t), cs = std::cos(t);
  const double b = (0.5 * t2 + cs - 1) / (t2 * t2);
  return {(t - s) / (t2 * t), b, 0.5 * (b + 3 * (t - s - t2 * t / 6) / (t2 * t2 * t))};
}
std::array<Lanes, 3> calcLeftQFactors(const Lanes& t2) {
  return replaceLarge(t2, calcLeftQSeries(t2), [](double one) { return calcLeftQFactors(one); });
}

template <typename T>
Matrix3<T> calcLeftQ(const Vector3<T>& rho, const Vector3<T>& phi) {
  const auto [a, b, c] = calcLeftQFactors(phi.squaredNorm());
  const Matrix3<T> F = skew(phi), P = skew(rho);
  const Matrix3<T> FP = F * P, PF = P * F, FPF = FP * F;
  return 0.5 * P + a * (FP + PF + FPF) + b * (F * FP + PF * F - 3 * FPF) + c * (FPF * F + F * FPF);
}

}  // namespace

Matrix6d makeCrossMotionMatrix(const Vector6d& v) {
  Matrix6d A;
  A.topLeftCorner<3, 3>() = skew(v.tail<3>());
  A.bottomRightCorner<3, 3>() = A.topLeftCorner<3, 3>();
  A.topRightCorner<3, 3>() = skew(v.head<3>());
  A.bottomLeftCorner<3, 3>().setZero();
  return A;
}

SE3 exp6(const Vector6d& twist) {
  const Vector3d w = twist.tail<3>();
  // p = Jl(w) rho, and Jl(w) = Jr(-w)
  return {exp3(w), calcRightJacobian3(-w) * twist.head<3>()};
}

template <typename T>
Vector6<T> log6(const SE3Of<T>& X) {
  Vector6<T> out;
  const Vector3<T> w = log3(X.R);
  const Vector3<T> cross = w.cross(X.p);
  linear(out) = X.p - 0.5 * cross + calcJacobianInverseFactor(w.squaredNorm()) * w.cross(cross);
  angular(out) = w;
  return out;
}
template Vector6d log6(const SE3&);
template Vector6<Lanes> log6(const SE3Of<Lanes>&);

Matrix6d calcRightJacobian6(const Vector6d& twist) {
  const Vector3d rho = twist.head<3>(), phi = twist.tail<3>();
  Matrix6d J;
  J.topLeftCorner<3, 3>() = calcRightJacobian3(phi);
  J.bottomRightCorner<3, 3>() = J.topLeftCorner<3, 3>();
  J.topRightCorner<3, 3>() = calcLeftQ<double>(-rho, -phi);
  J.bottomLeftCorner<3, 3>().setZero();
  return J;
}

// Inverse of a block triangular matrix.
template <typename T>
Matrix6<T> calcRightJacobianInverse6(const Vector6<T>& twist) {
  const Vector3<T> rho = linear(twist), phi = angular(twist);
  const Matrix3<T> Ji = calcRightJacobianInverse3(phi), Q = calcLeftQ<T>(-rho, -phi);
  Matrix6<T> J;
  J.template topLeftCorner<3, 3>() = Ji;
  J.template bottomRightCorner<3, 3>() = Ji;
  J.template topRightCorner<3, 3>().noalias() = -Ji * Q * Ji;
  J.template bottomLeftCorner<3, 3>().setZero();
  return J;
}
template Matrix6d calcRightJacobianInverse6(const Vector6d&);
template Matrix6<Lanes> calcRightJacobianInverse6(const Vector6<Lanes>&);

Matrix6d calcLogJacobian6(const SE3& X) { return calcRightJacobianInverse6<double>(log6(X)); }

}  // namespace bielle
