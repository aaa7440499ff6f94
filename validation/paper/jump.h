#pragma once
// The paper's jump (its section IV-B), as far as its weights can be read from its figures.
//
// Feet are free in flight; at touchdown their costs are height, tilt and velocity. The height of the centre of mass has
// a cost at mid-flight alone. With T the time in the air and v0 = g T / 2, the load is m (g + v0 / D) while pushing and
// landing, each for D seconds, and m g before and after. Hips are weighted like other joints, the heading is not.
// Terminal costs are the height and the heading of the base, and the joints of the legs (Model::serialJoints) with
// their velocities.
#include "paper/problem.h"

namespace bielle::paper {

struct JumpOptions {
  double flight = 26 * kTimeStep;  // rounded to an even number of time steps, s
  int nodes = 10;                  // of each of the phases stand, push, land and settle
  double state_weight = 0.7, torso_weight = 2500;
  double control_weight = 0.05;  // 1/(N m)^2
  double apex_weight = 1e5;      // of the height at mid-flight, 1/m^2
  double force_weight = 500;     // over (m g)^2
  double pressure_weight = 5;    // over the half size of the sole squared
  LandingWeights touchdown{1e5, 1e3, 1e3};
  double terminal_weight = 1e3;
  ContactGains contacts{0, 100};
};

// A jump on the spot off all contacts. \param q0  a standing posture
Motion makeJump(const Model& model, const JumpOptions& options, const VectorXd& q0,
                Formulation formulation = Formulation::Reduced);

}  // namespace bielle::paper
