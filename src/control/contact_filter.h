#pragma once
/// \file The invariant extended Kalman filter of a trunk on standing feet.
///
/// After Hartley, Ghaffari, Eustice and Grizzle, "Contact-aided invariant extended Kalman filtering for robot state
/// estimation" (IJRR 2020), with soles whose attitude counts as well, as in Rotella, Bloesch, Righetti and Schaal, "State
/// estimation for a humanoid robot" (IROS 2014). The state is the attitude R, velocity v and position p of the IMU, the
/// offsets b_g and b_a of its readings, and attitude R_i and position p_i of every foot, all in the world. Errors are
/// those of the world's axes,
///     R = exp(x) R^,  v = exp(x) v^ + n,  p = exp(x) p^ + r,  p_i = exp(x) p^_i + r_i,  R_i = exp(x_i) R^_i           (1)
/// with which the filter neither learns nor forgets what cannot be observed: position and heading. With the means w, f of
/// angular velocity and specific force over a step h, less offsets,
///     R+ = R exp(h w),  v+ = v + h R exp(h w / 2) f + h g,  p+ = p + h (v + v+) / 2,  feet and offsets stay           (2)
/// and with errors of the offsets (e_g, e_a), B = h R+ Jr(h w), D = h R exp(h w / 2), f~ = [f x] Jr(h w / 2) h / 2,
///     x+ = x - B e_g,   r_i+ = r_i - [p_i x] B e_g,   x_i+ = x_i
///     n+ = n + h [g x] x + (D f~ - [v+ x] B) e_g - D e_a                                                              (3)
///     r+ = r + h n + h^2/2 [g x] x + (h/2 D f~ - [p+ x] B) e_g - h/2 D e_a
/// A standing foot is seen by the encoders at a placement (R_h, h) in the frame of the IMU. The differences
///     y = R^ h - (p^_i - p^) = r_i - r,    z = Log(R^ R_h R^_i^T) = x_i - x                                           (4)
/// to first order have constant Jacobians.
#include <vector>

#include "bielle/math/se3.h"

namespace bielle {

struct ContactFilterState {
  Matrix3d R = Matrix3d::Identity();
  Vector3d p = Vector3d::Zero(), v = Vector3d::Zero();  ///< m, m/s
  Vector3d gyro_offset = Vector3d::Zero();              ///< rad/s
  Vector3d accelerometer_offset = Vector3d::Zero();     ///< m/s^2
  std::vector<SE3> feet;
};

/// Standard deviations: of densities per sqrt(s), i.e. of the mean over a second.
struct ContactFilterNoise {
  double gyro = 0, accelerometer = 0;            ///< rad/s, m/s^2, per sqrt(Hz)
  double gyro_walk = 0, accelerometer_walk = 0;  ///< of the offsets, rad/s and m/s^2 in a second
  double foot_slide = 0, foot_turn = 0;          ///< of a standing foot, m and rad in a second
  double foot_position = 0, foot_attitude = 0;   ///< of a placement by the encoders, m and rad
};

/// Indices of the parts of an error: x, n, r, e_g, e_a, and 6 for every foot, r_i and x_i.
inline constexpr int kTurn = 0, kVelocity = 3, kPosition = 6, kGyro = 9, kAccelerometer = 12, kFeet = 15;
inline constexpr int getFootPosition(size_t foot) { return kFeet + 6 * static_cast<int>(foot); }
inline constexpr int getFootTurn(size_t foot) { return getFootPosition(foot) + 3; }
inline int getErrorSize(const ContactFilterState& state) { return getFootPosition(state.feet.size()); }

/// Eq. (1) for an error (size); offsets add.
void integrate(const ContactFilterState& state, ConstVectorRef error, ContactFilterState& out);
/// The error with which `from` becomes `to`.
void difference(const ContactFilterState& from, const ContactFilterState& to, VectorRef error);
/// Eqs. (2) and (3). \param F  size x size, the matrix of (3)
void predict(const Vector3d& gyro, const Vector3d& accelerometer, const Vector3d& gravity, double h,
             ContactFilterState& state, MatrixRef F);
/// Eq. (4): y and z.
Vector6d calcInnovation(const ContactFilterState& state, size_t foot, const SE3& X_IF);

/// State and covariance. No function allocates but the constructor.
class ContactFilter {
 public:
  /// \param sizes  of what a foot fixes: 6, or 3 if it is a point, as which an edge may count
  ContactFilter(const std::vector<int>& sizes, const ContactFilterNoise& noise, const Vector3d& gravity);

  /// \param deviations  of x, n, r, e_g, e_a (15); feet have to be put down
  void reset(const ContactFilterState& state, const Eigen::Matrix<double, 15, 1>& deviations);
  /// Over a step h, s. \param unrest  of each foot, by which its noise counts more; 1 for a foot that carries the robot
  void predict(const Vector3d& gyro, const Vector3d& accelerometer, double h, const std::vector<double>& unrest);
  /// A foot stands where the encoders see it.
  void putDown(size_t foot, const SE3& X_IF);
  /// Learns from a foot that stands. \returns y' S^-1 y, whose mean is the size of the foot
  double correct(size_t foot, const SE3& X_IF);

  const ContactFilterState& state() const { return state_; }
  int getSize(size_t foot) const { return sizes_[foot]; }
  const MatrixXd& covariance() const { return P_; }

 private:
  const std::vector<int> sizes_;
  const ContactFilterNoise noise_;
  const Vector3d gravity_;
  ContactFilterState state_, corrected_;
  MatrixXd P_, F_, FP_;  // size x size
  MatrixXd PH_, K_;      // size x 6
  VectorXd error_;       // size
};

}  // namespace bielle
