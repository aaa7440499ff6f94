#pragma once
/// \file Errors of the robot: a machine is not the model that its controller believes in.
#include "bielle/model/model.h"

namespace bielle::worlds {

struct RobotErrors {
  double mass = 0;  ///< of a body: its mass and inertia times 1 - mass to 1 + mass, uniformly distributed [1]
  double rod = 0;   ///< frame 1 of a closure moved by -rod to rod along each axis of its body, as distributed, m
  unsigned seed = 1;

  bool isZero() const { return mass == 0 && rod == 0; }
};

/// The machine of a model.
/// \throws InputError when its masses would not be positive
Model makeMachine(const Model& model, const RobotErrors& errors);

/// Where the machine is when its controller believes that it is at q (nq, closed in the model): the motors of both are at
/// the same positions, or near them where they do not determine all joints; the loops of the machine are closed, the lowest corner of
/// its soles is as high.
/// \throws InputError when the loops of the machine cannot be closed
VectorXd assembleMachine(const Model& model, const Model& machine, ConstVectorRef q);

}  // namespace bielle::worlds
