#pragma once
// Springs on joints without a motor: where the weight bends them, and how fast they swing.
#include <cmath>

#include "bielle/motion/locomotion.h"

namespace bielle {

// What a posture asks of motors with these limits, while all of the robot accelerates alike.
struct HoldingShare {
  VectorXd u;  // nu, torques of least squares as in calcStaticTorques()
  // However motors and feet share the load, some motor needs that many times its limit; 0 where u keeps the limits, infinity where
  // no torques hold the posture, with forces that feet on the ground can have.
  double least = 0;

  bool isTooMuch() const { return least > 1 && std::isfinite(least); }
};
// \param a  acceleration of a robot with a free base, m/s^2 (world)   \param limits  nu, N m or N, infinite for none
// \param friction  of the ground
HoldingShare calcHoldingShare(const Model& model, const ConstraintSet& constraints, ConstVectorRef q, const Vector3d& a,
                              const VectorXd& limits, double friction);

// The posture q of the reference with its springs bent by the weight, but for those that it names.
VectorXd settleReference(const Model& model, const Reference& reference, const VectorXd& q);

// The longest stages, s, that follow such springs while the robot stands on these contacts: a fifth of the period of its
// fastest mode, in whole milliseconds, at least 2; infinity without springs. (spring_biped oscillates at 34 Hz. Under its own
// gains it falls at once with stages of 12 ms and in the first step with 9 ms; with 6 ms it walks.)
double calcSpringStage(const Model& model, ConstVectorRef q, const std::vector<ContactTarget>& contacts);
double calcSpringStage(const Model& model, const Stance& stance);

}  // namespace bielle
