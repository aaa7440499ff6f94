#pragma once
/// \file A robot as a URDF for Drake.
///
/// The tree is that of a URDF alone; beside it
///   - a ball is one <drake:ball_constraint>, a hinge two on its axis, a weld three on the axes of its frame;
///   - a coupler of two joints is a <mimic>;
///   - a spring between points is a <drake:linear_spring_damper>, whose free length contains the preload;
///   - a motor is a <transmission> with <drake:rotor_inertia> and <drake:gear_ratio>;
///   - ball and universal joints are <drake:joint>. Drake's universal joint turns about x, then y of its link: the frame of such a
///     link is turned where ours has other axes.
/// Drake has constraints and mimics in discrete plants with the solver SAP alone. Its elements name no link of the world, so that
/// whatever is fixed to the ground gets a link of its own there. loadRobot reads all of that: the same mechanism, whose hinges and
/// welds have become two and three balls with redundant rows.
#include "bielle/formats/robot_writer.h"

namespace bielle {

/// Distance of the points of a hinge from its frame, m.
inline constexpr double kDrakeHingeLever = 0.05;
/// Distance of the points of a weld from its frame, m.
inline constexpr double kDrakeWeldLever = 0.1;

/// \throws InputError naming a universal joint whose axes are not at right angles
UrdfText formatDrake(const Model& model);

}  // namespace bielle
