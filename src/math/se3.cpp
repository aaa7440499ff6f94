#include "bielle/math/se3.h"

#include <cmath>

namespace bielle {
namespace {

// Off-diagonal block Q of the left Jacobian of SE(3) (Barfoot, "State estimation for robotics", eq. 7.86), for the
// twist (rho, phi):
//     Q = P/2 + a (FP + PF + FPF) + b (FFP + PFF - 3 FPF) + c (FPFF + FFPF),     F = [phi]x, P = [rho]x
//     a = (t - sin t)/t^3,  b = (t^2/2 + cos t - 1)/t^4,  c = (b + 3 d)/2,  d = (t - sin t - t^3/6)/t^5,  t = |phi|.
Matrix3d calcLeftQ(const Vector3d& rho, const Vector3d& phi) {
  const double t2 = phi.squaredNorm();
  double a, b, c;
  if (t2 < 1e-2) {  // series; t^6 terms kept so that the cancellation of the closed form never shows
    a = 1.0 / 6 - t2 / 120 + t2 * t2 / 5040 - t2 * t2 * t2 / 362880;
    b = 1.0 / 24 - t2 / 720 + t2 * t2 / 40320 - t2 * t2 * t2 / 3628800;
    const double d = -1.0 / 120 + t2 / 5040 - t2 * t2 / 362880 + t2 * t2 * t2 / 39916800;  // (t - sin t - t^3/6) / t^5
    c = 0.5 * (b + 3 * d);
  } else {
    const double t = std::sqrt(t2), s = std::sin(t), cs = std::cos(t);
    a = (t - s) / (t2 * t);
    b = (0.5 * t2 + cs - 1) / (t2 * t2);
    c = 0.5 * (b + 3 * (t - s - t2 * t / 6) / (t2 * t2 * t));
  }
  const Matrix3d F = skew(phi), P = skew(rho);
  const Matrix3d FP = F * P, PF = P * F, FPF = FP * F;
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
  J.topRightCorner<3, 3>() = calcLeftQ(-rho, -phi);
  J.bottomLeftCorner<3, 3>().setZero();
  return J;
}

Matrix6d calcLogJacobian6(const SE3& X) {
  // Inverse of the block triangular right Jacobian.
  const Vector6d twist = log6(X);
  const Vector3d rho = twist.head<3>(), phi = twist.tail<3>();
  const Matrix3d Ji = calcRightJacobianInverse3(phi);
  Matrix6d J;
  J.topLeftCorner<3, 3>() = Ji;
  J.bottomRightCorner<3, 3>() = Ji;
  J.topRightCorner<3, 3>().noalias() = -Ji * calcLeftQ(-rho, -phi) * Ji;
  J.bottomLeftCorner<3, 3>().setZero();
  return J;
}

}  // namespace bielle
