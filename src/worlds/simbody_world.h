#pragma once
/// \file The world of Simbody, the reference: other kinematics, other dynamics, steps of controlled error.
///
/// Simbody has the tree, the closures as constraints, cut so that there are few of them, and gravity
/// (src/worlds/simbody_tree.h). Contacts, stops, torques and the
/// push are forces over its kinematics. A rotor is a body pinned to the ground whose speed is constrained to that of its
/// joint: it weighs the armature and nothing else. The anchors of the contacts (contact_law.h) move after every step that
/// the integrator has accepted, so that forces are functions of the state during a step. Work is integrated by the
/// trapezoidal rule over these steps.
#include <memory>

#include "bielle/worlds/world.h"
#include "worlds/contact_law.h"

namespace bielle::worlds {

enum class SimbodyIntegrator {
  RungeKutta3,      ///< Simbody's choice where contacts limit the steps
  RungeKuttaMerson  ///< of fourth order: fewer steps where the motion is smooth
};

struct SimbodyWorldOptions {
  WorldOptions world;      ///< time_step: the longest step; 0: no limit
  double accuracy = 1e-3;  ///< relative local error of the integrator
  /// Tolerance of the constraints: most of any row, m of points and rad (sines) of directions. Simbody's own way, a mean
  /// square over all rows of the robot, lets a loop that moves open the more, the more others rest.
  double gap = 1e-7;
  ContactOptions contact;
  SimbodyIntegrator integrator = SimbodyIntegrator::RungeKutta3;
  bool as_modelled = false;  ///< loops cut where the model cuts them: the same motion, with more rows of constraints
};

std::unique_ptr<World> makeSimbodyWorld(const Model& model, const SimbodyWorldOptions& options = {});

}  // namespace bielle::worlds
