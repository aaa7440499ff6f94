#pragma once
/// \file The same mechanism with fewer coordinates. A rod that ends in a ball joint may be cut in its middle and welded there:
/// that takes six rows and the three coordinates of the joint. Cut at the ball instead, it takes three rows and none.
#include "bielle/model/model.h"

namespace bielle {

/// Every leaf on a spherical joint that only a weld holds becomes part of the body it is welded to, with all that is fixed to
/// it, and a ball in place of its joint closes the loop, under the name of the weld. It must have no contact, motor, limits,
/// rotor inertia or serial joint. Other joints keep their names, order and values: restrictConfiguration() and
/// restrictVelocity() (motion/serial_model.h) map states, and torques are the same. References give all joints, as they
/// are in the model. A copy of the model, if it has no such leaf.
Model cutAtBalls(const Model& model);

}  // namespace bielle
