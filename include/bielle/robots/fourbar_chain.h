#pragma once
/// \file Chains of planar four-bar linkages: closed chains of any size, with closed-form solutions.
///
/// One four-bar in the plane x-z: a crank of length a turns at the origin of its ground, a rocker of length c swings at
/// (d, 0), and a coupler of length b joins their ends by a hinge. With angles measured from x towards z (about -y),
/// theta2 of the crank, theta3 of the coupler and theta4 of the rocker, it closes when
///     a cos theta2 + b cos theta3 = d + c cos theta4
///     a sin theta2 + b sin theta3 =     c sin theta4.                                                          (1)
/// With P the end of the crank, w = (d, 0) - P, l = |w|, h = (l^2 + b^2 - c^2) / (2 l), s = sqrt(b^2 - h^2), the two
/// circles about P and (d, 0) meet in
///     Q = P + h w / l + s (-w_z, w_x) / l    (the branch above w; below it, s is negative).                    (2)
/// The ground of the first linkage is the world, that of every other linkage is the coupler of the one before. Joints
/// per linkage: rocker (theta4), crank (theta2), coupler (theta3 - theta2), in this order; one 5D closure, of which two
/// rows are independent; mobility one.
///
/// The linkage is at a *dead point* of the rocker when crank and coupler are aligned: then dtheta4 = 0, and the
/// rocker's angle does not determine its motion. With a + b = c + d, or a = c and b = d (a parallelogram), all rods can
/// be aligned: (1) then loses rank and the linkage can continue on two branches.
#include "bielle/model/model.h"

namespace bielle {

enum class FourBarMotor { Crank, Rocker };

struct FourBarChainOptions {
  int count = 1;                            ///< four-bars
  double ground = 0.40;                     ///< d, m
  double crank = 0.15;                      ///< a, m
  double coupler = 0.35;                    ///< b, m
  double rocker = 0.30;                     ///< c, m
  double crank_angle = 1.0471975511965976;  ///< theta2 at the closed configuration, rad
  FourBarMotor motor = FourBarMotor::Crank;
  double density = 2;  ///< of the rods, mass per length, kg/m
  double radius = 0;   ///< of the rods, m; 0: slender, not drawn
};

struct FourBarChain {
  Model model;        ///< joints rocker<i>, crank<i>, coupler<i>; closures loop<i>; i from 1; reference `closed`
  VectorXd q_closed;  ///< by Eq. (2), on the branch above w
};

/// \throws InputError when the lengths do not close at this crank angle
FourBarChain makeFourBarChain(const FourBarChainOptions& options = {});

}  // namespace bielle
