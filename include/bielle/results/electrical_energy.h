#pragma once
/// \file The electrical energy of a motion, from its record.
#include "bielle/motion/record.h"

namespace bielle {

/// Eq. (1) of motion/objective.h, without smoothing, as a sum over the steps.
struct ElectricalEnergy {
  VectorXd by_motor;             ///< nu, J
  double total = 0;              ///< J
  double regeneration = 0;       ///< share of the regenerated energy that is subtracted
  int num_assumed = 0;           ///< motors without a known loss, for which kDefaultTorqueLoss is assumed
  double distance = 0;           ///< of the centre of mass on the ground, from start to end, m
  double cost_of_transport = 0;  ///< total divided by weight and distance; NaN for less than kLeastDistance

  static constexpr double kLeastDistance = 0.2;  ///< m
};

/// Root mean squares over the time of the motion of the torques c u, c of MotorDrive Eq. (1): what heats the windings (nu), N m
/// or N.
VectorXd calcRmsEfforts(const Model& model, const MotionRecord& record);

/// \param regeneration  within 0 .. 1
ElectricalEnergy calcElectricalEnergy(const Model& model, const MotionRecord& record, double regeneration);

}  // namespace bielle
