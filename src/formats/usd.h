#pragma once
/// \file A robot as a file of USD in text form, by the schema UsdPhysics and what PhysX (Isaac Sim) and Newton add to it.
///
/// Bodies keep their names and frames and stand at q_ref, where loops should be closed; coordinates of joints are those of the model.
/// A closure is a joint of its name with excludeFromArticulation: a weld is fixed, a ball spherical, a hinge revolute, a
/// slider prismatic, and a distance is a PhysicsDistanceJoint whose bounds are its length. What is fixed to the world hangs on
/// a body `ground`. A universal joint is two revolute ones, NAME_X and NAME_Y by their axes, with a body
/// NAME_cross in between. A motor is a drive without stiffness and damping; a coupler of two joints is a NewtonMimicAPI, and a
/// PhysxMimicJointAPI where both turn. Frames are Xforms with NewtonSiteAPI. Names that USD does not allow are changed, and
/// `displayName` says what they were. Numbers have all their digits; programs that read the file keep those of float, but for the
/// places of bodies.
#include <string>
#include <vector>

#include "bielle/model/model.h"

namespace bielle {

struct UsdText {
  std::string usda;
  std::vector<std::string> warnings;  ///< each names something that USD cannot express or that was changed
};

/// \param q_ref  closed configuration (nq), as of findClosedConfiguration
/// \throws InputError naming a joint that UsdPhysics does not have: planar, or a free-flyer that a body carries
UsdText formatUsd(const Model& model, ConstVectorRef q_ref);

}  // namespace bielle
