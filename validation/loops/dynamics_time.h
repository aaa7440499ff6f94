#pragma once
// What the dynamics of a mechanism cost.
#include "bielle/model/model.h"

namespace bielle::loops {

// Processor times of one posture, s: the least of several runs.
struct DynamicsTimes {
  int mobility = 0;
  // Of all coordinates and the forces of the closures at once (constrained.h).
  double accelerations = 0, derivatives = 0;  // the latter with the accelerations that they are of
  // In reduced coordinates, as in optimal control: a step, which ends with closed loops, and with its derivatives.
  double step = 0, linearization = 0;
};

// \param duration  of a run, s
// \throws InputError when the robot has no closed configuration
DynamicsTimes measureDynamics(const Model& model, double duration);

}  // namespace bielle::loops
