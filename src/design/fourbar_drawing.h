#pragma once
/// \file Plane four-bars that move a joint as requested, found among many by their closed form.
///
/// In the plane of a joint at K = 0 with the normal y, x forward and z up in the link that carries it: a crank of length c turns about M,
/// a rod joins its end B to F on the arm of the joint. All is drawn at the joint's angle theta0, where crank and arm point along the
/// angles gamma and alpha from x towards z. With beta = theta - theta0 about y,
///     F = a (cos(alpha - beta), sin(alpha - beta)),    |B - M| = c,    |F - B| = |F0 - B0|                         (1)
/// B being on the side of the line from M to F where it is in the drawing. With r = F - B and the cross product r x p = r_x p_z - r_z p_x,
/// the crank turns, per turn of the joint, by
///     R = (r x F) / (r x (B - M))                                                                                (2)
/// The sines of the angles between rod and arm, and rod and crank, |r x F| / (|r| a) and |r x (B - M)| / (|r| c), vanish at dead points
/// of the joint and of the motor.
#include <vector>

#include "bielle/math/types.h"

namespace bielle {

/// Drawn numbers of a four-bar, m and rad.
struct FourBarDrawing {
  double motor_x = 0, motor_z = 0;  ///< M
  double crank = 0, crank_angle = 0;
  double arm = 0, arm_angle = 0;

  static constexpr int kCount = 6;
  static FourBarDrawing fromVector(const VectorXd& x);
  VectorXd toVector() const;
};

struct FourBarState {
  bool closes = false;
  double ratio = 0;    ///< R of (2)
  double turn = 0;     ///< of the crank from the drawing, about y, rad
  double sine = 0;     ///< the lesser of both sines
  double nearest = 0;  ///< distance of the rod from K, m
};
/// \param turn  beta of (1)
FourBarState calcFourBar(const FourBarDrawing& drawing, double turn);

/// What is requested of a joint at several angles.
struct JointDemand {
  double drawn_at = 0;       ///< theta0
  VectorXd angles;           ///< rad
  VectorXd ratios;           ///< requested |R|; or empty
  VectorXd torques, speeds;  ///< at the joint, N m and rad/s; or empty
  double largest_speed = 0;  ///< of the motor, rad/s; 0: any
};

struct FourBarSpace {
  VectorXd lower, upper;    ///< of the drawing's numbers
  double margin = 0.3;      ///< least sine
  double clearance = 0.01;  ///< least distance of the rod from K, m
};

struct FoundFourBar {
  FourBarDrawing drawing;
  double value = 0;  ///< what is least: see rateFourBar
  double least_ratio = 0, largest_ratio = 0, least_sine = 0;
  double peak_torque = 0, rms_torque = 0, peak_speed = 0;  ///< of the motor, where the demand has torques; N m, rad/s
};

/// The value of a four-bar: with torques, the root mean square of the motor's; with ratios, the largest relative deviation from them;
/// else by how much the largest ratio exceeds the least. Infinite where it does not close or breaks a limit.
FoundFourBar rateFourBar(const FourBarDrawing& drawing, const JointDemand& demand, const FourBarSpace& space);

/// The best of `samples` at random, refined by NLopt (Sbplx), best first; drawings that come out alike are one.
/// The same for the same seed, whatever the number of threads.
std::vector<FoundFourBar> searchFourBars(const JointDemand& demand, const FourBarSpace& space, long samples, int count,
                                         unsigned seed, int threads);

}  // namespace bielle
