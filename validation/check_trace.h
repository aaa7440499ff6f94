#pragma once
/// \file Simbody's values at every node of a motion: the measurements behind the rows of check.h.
#include <optional>

#include "check_input.h"

namespace bielle::validation {

/// Per closure, of frame 2 in frame 1 without free axes.
struct ClosureTrace {
  std::vector<Vector6d> gaps;       ///< position and angle vector; of a coupler its residual, as an angle
  std::vector<Vector6d> gap_rates;  ///< the same for its velocity
};

struct NodeTrace {
  std::vector<SE3> feet;              ///< per contact of the model, placement of its frame in the world
  std::vector<Vector6d> foot_twists;  ///< of that frame, in its own coordinates
  ClosureTrace closures;
  std::vector<SE3> bodies;            ///< placements in the world
  Vector3d com;                       ///< of the robot, m
  double kinetic = 0, potential = 0;  ///< energies, of bodies and rotors, J
  VectorXd passive;                   ///< nv, generalized forces of gravity, springs, dampers and friction
  double passive_power = 0;           ///< their power, W
  double dissipative_power = 0;       ///< that of dampers and friction, W
  double inertial_power = 0;          ///< v . c, c the bias without passive forces: half of v . dM/dt v, W
  double drift_power = 0;             ///< p of Eq. (11), W
};

/// A stage, from its node to the next.
struct StageTrace {
  VectorXd balance;        ///< nv, M a + b - B u - J^T lambda of the recorded values, Eq. (1) of check.h
  VectorXd velocity_rest;  ///< nv, the first of Eqs. (2) over h: remainder along the closures, m/s or rad/s
  VectorXd position_rest;  ///< nv, the second of Eqs. (2), m or rad
  std::optional<ClosureTrace> midpoint;  ///< of a midpoint step
  VectorXd midpoint_rest;                ///< nv, the first two of Eqs. (9), m or rad; the third is position_rest
  double acceleration = 0;               ///< sqrt(a^T M a), a Simbody's own, Eq. (4)
  double acceleration_error = 0;         ///< the same norm of the recorded a less Simbody's
  double finite_difference = 0;          ///< sqrt(e^T M e) of Eq. (6)
  double motor_work = 0;                 ///< over the interval, J
  double exchanged = 0;                  ///< sum of the sizes of the work of each motor, J
  double contact_work = 0;               ///< of feet that slip, J
  double closure_work = 0;               ///< of loops that open, J
  double passive_work = 0;               ///< over the interval, as Eq. (7) or (10) takes it, J
  double dissipative_work = 0;           ///< the part of dampers and friction, J
  double midpoint_power = 0;             ///< p(q_m, v-) + p(q_m, w) of Eq. (11), W
  double energy_scale = 0;               ///< what the step may lose or gain, the right side of Eq. (8) or (12), J
  std::vector<Vector6d>
      impulses;  ///< of a rigid impact: per contact of the model, of the ground on the foot, N s and N m s
};

struct MotionTrace {
  std::vector<NodeTrace> nodes;    ///< N + 1
  std::vector<StageTrace> stages;  ///< N; empty ones of a motion carried out, whose steps are not recorded
};

/// The motion must be consistent and its numbers finite.
MotionTrace traceMotion(const CheckedMotion& motion);

}  // namespace bielle::validation
