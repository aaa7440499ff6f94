#pragma once
// The paper's walk on level ground, known to the last digit from its example code.
//
// There are no footholds: only the velocity of the centre of mass leads forward. The costs of a landing foot are its
// height, tilt and velocity; its place, its heading and the path of a swing have no costs, but its horizontal velocity
// near the ground does (fly high), and so do feet that come near each other. The force reference is the weight on one
// foot, half of it on each of two, and changes at once; forces and centres of pressure are in the axes of the world.
// Contacts and closures have the gains given, beyond what our own motions keep to (limitGains). The only terminal costs
// are the velocities of the joints of the legs (Model::serialJoints). The guess is the standing posture at rest.
#include "paper/problem.h"

namespace bielle::paper {

// The weights of its example code. Durations there are truncated to whole time steps: 13 in double support at the
// start, 26 on one foot, 1 on both feet between steps, and 14 at the end.
struct WalkOptions {
  double speed = 0.5;  // of the centre of mass, forward, m/s
  int steps = 8;       // the left foot first
  double state_weight = 1, torso_weight = 2500;
  double control_weight = 0.02;                            // 1/(N m)^2
  double com_height_weight = 1000;                         // 1/m^2
  double com_velocity_weight = 100;                        // s^2/m^2
  double force_weight = 10;                                // over (m g)^2
  double pressure_weight = 10;                             // over the half size of the sole squared
  double fly_high_weight = 100, fly_high_slope = 75;       // s^2/m^2, 1/m
  double feet_distance_weight = 100, feet_distance = 0.2;  // of coming nearer than that, 1/m^2 and m
  LandingWeights landing{1e4, 1e4, 1e4};
  double terminal_weight = 1e4;  // of the final velocities
  ContactGains contacts{0, 100}, closures{0, 0};
};

// \param q0  a standing posture   \throws InputError when the robot lacks feet
Motion makeWalk(const Model& model, const WalkOptions& options, const VectorXd& q0,
                Formulation formulation = Formulation::Reduced);

}  // namespace bielle::paper
