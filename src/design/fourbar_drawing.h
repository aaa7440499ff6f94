#pragma once
/// \file Plane four-bars by the numbers of their drawing, in closed form.
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
#include "bielle/math/types.h"
#include "design/linkage_search.h"

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

/// Four-bars within bounds of their drawings' numbers.
struct FourBarSpace {
  VectorXd lower, upper;
  double margin = 0.3;      ///< least sine
  double clearance = 0.01;  ///< least distance of the rod from K, m
};

/// Drawn at the middle of the demand's angles; their margin is the least sine.
LinkageFamily makeFourBars(const FourBarSpace& space, const JointDemand& demand);

}  // namespace bielle
