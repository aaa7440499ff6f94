#pragma once
/// \file What motors and linkages pay for a motion.
#include <string>
#include <vector>

#include "bielle/model/model.h"
#include "bielle/ocp/shooting_problem.h"
#include "bielle/solve/fddp.h"

namespace bielle {

/// Of one motor over a motion of N stages.
struct MotorMeasures {
  double peak_torque = 0;  ///< max |u|, N m or N
  double rms_torque = 0;   ///< sqrt(sum h u^2 / sum h)
  double peak_speed = 0;   ///< max |v|, rad/s or m/s
  double energy = 0;       ///< sum h |u v|, J: what is braked is not given back
};

struct MotionMeasures {
  std::vector<MotorMeasures> motors;  ///< in the order of the model
  /// The farthest that a unit motion of a linkage is from showing at its motors: with Q an orthonormal basis of the
  /// closed
  /// motions of a loop cluster and Q_M its rows of motors, the largest 1 / sigma_min(Q_M) over clusters and nodes, 1 or
  /// more. Infinite where the motors do not determine the linkage (a dead point of the motors).
  double conditioning = 1;
};

/// \param dt  N, s   \param trajectory  states (q, v) of the model at N + 1 nodes, closed; N controls
MotionMeasures calcMotionMeasures(const Model& model, const std::vector<double>& dt,
                                  const ShootingTrajectory& trajectory);

enum class Measure { PeakTorque, RmsTorque, Energy, Conditioning };
const char* getName(Measure measure);

/// The largest peak torque, rms torque or conditioning over the motors named and all motions, or the energy of
/// all of them together.
double getMeasure(Measure measure, const std::vector<int>& motors, const std::vector<MotionMeasures>& motions);

}  // namespace bielle
