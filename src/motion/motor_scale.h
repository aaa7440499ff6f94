#pragma once
/// \file Motors of prismatic joints beside those that turn: their forces and speeds, in the costs of a motion.
#include "bielle/model/model.h"

namespace bielle {

/// A force counts as its torque about an arm of this length, a speed as the rate of an arm of this length, m: a ball screw of
/// 10 mm per turn is a gear of 628 turns per metre, one of 13 turns per turn at that arm. Weights of torques and speeds so
/// mean about the same for all motors.
inline constexpr double kScrewArm = 0.02;

inline bool isLinear(const Model& model, const Motor& motor) {
  return model.joints()[motor.joint].kind == JointKind::Prismatic;
}

}  // namespace bielle
