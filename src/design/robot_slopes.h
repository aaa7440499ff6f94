#pragma once
/// \file What the variables of a design change in the robot itself: its mass, and what its motors can give and lose.
#include "bielle/design/parametrization.h"
#include "design/measures.h"

namespace bielle {

/// Numbers of one motor, by which its torque u and its speed v count in measures; 0 of what it has not. `heat` is that of
/// continuous_effort, without the factor c of MotorDrive Eq. (1), which is kDriving or kDriven.
enum MotorFactor {
  kPerEffort,       ///< 1 / effort_limit
  kPerSpeed,        ///< 1 / velocity_limit
  kVoltsPerEffort,  ///< share of the supply
  kVoltsPerSpeed,
  kPerContinuous,  ///< 1 / continuous_effort
  kLoss,           ///< 1 / K_m^2 of MotorConversion
  kDriving,        ///< 1 / efficiency of the gear
  kDriven,         ///< its efficiency while it is driven
  kMotorFactors
};
using MotorFactors = Eigen::Matrix<double, kMotorFactors, Eigen::Dynamic>;  ///< one column per motor

struct RobotSlopes {
  double mass = 0;
  VectorXd dmass;  ///< by the variables, zero of choices
  std::vector<Motor> motors;
  std::vector<MotorConversion> drives;
  MotorFactors factors;
  std::vector<MotorFactors> dfactors;
};

/// Central differences between robots made for x, a hundred-thousandth of the bounds apart; motions do not come into it.
/// \param drives  of those robots   \throws InputError as Parametrization::make
RobotSlopes calcRobotSlopes(const Parametrization& robot, const VectorXd& x, const DriveTable& drives);

}  // namespace bielle
