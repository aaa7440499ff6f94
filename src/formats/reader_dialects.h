#pragma once
/// \file What other programs add to a URDF: loops, couplers and motors, and an account of every other element.
///
/// Loops: `<loop_joint name type>` (Drake until 2018, RigidBodyDynamics.jl, Isaac Sim) and `<constraint name type>` (proposed for
/// urdfdom in 2026) tie two links, named by <link1> and <link2> or <parent> and <child>, at frames that are theirs (xyz and rpy of
/// these elements, or <parent_origin> and <child_origin>); `<loop name type>` (URDF+ of Chignoli and others, "Recursive rigid-body
/// dynamics algorithms for systems with kinematic loops", 2023) ties <predecessor link> and <successor link> at the <origin> of each.
/// Types are `spherical` or `ball`, `continuous`, `revolute` or `hinge`, `prismatic`, and `fixed`; a hinge turns about, and a slider
/// slides along, <axis xyz> (default x) of
/// the first frame, or about <parent_axis> and <child_axis>. A `<joint>` inside `<gazebo>` is one of SDF: its links, at its
/// <pose> in the child, are tied as they stand with all joints at zero.
///
/// Mimics: `<plugin>` of Gazebo (mimic_joint_plugin of roboticsgroup_gazebo_plugins and its successors), by readMimicPlugin(),
/// and by <param name="mimic"> of a joint in <ros2_control>.
///
/// Couplers: `<coupling name>` (URDF+): the sum of the coordinates from the nearest common ancestor to <successor link> is <ratio
/// value> times that to <predecessor link>.
///
/// Motors: `<transmission>` of ros_control, also inside <ros2_control> and in the words of pr2_mechanism. A SimpleTransmission is a
/// motor with a gear; a joint of <ros2_control> with a <command_interface> that no transmission names has a motor without one. A
/// DifferentialTransmission and a FourBarLinkageTransmission are two rotors, next to massless, each with a motor, and two couplers
/// between rotors and joints, with reductions n and offsets o:
///
///     x_a1 = n_a1 (n_j1 (x_j1 - o_1) + n_j2 (x_j2 - o_2)),  x_a2 = n_a2 (n_j1 (x_j1 - o_1) - n_j2 (x_j2 - o_2))       differential
///     x_a1 = n_a1 n_j1 (x_j1 - o_1),                        x_a2 = n_a2 (n_j2 (x_j2 - o_2) + x_j1 - o_1)              four-bar
#include "formats/robot_files.h"
#include "formats/xml_document.h"

namespace bielle {

/// \param for_drake  its elements and transmissions are read by reader_drake.h
/// \throws InputError naming the line for names that do not exist, other types and what is no number
void readDialects(const XMLElement& robot, bool for_drake, UrdfFile& tree, YamlFile& settings);

/// The motors and rotors of these, and the mimics of <ros2_control>. \throws InputError as the former
void readTransmissions(const XMLElement& robot, UrdfFile& tree, YamlFile& settings);

/// A plugin with <joint> and <mimicJoint>: the latter's coordinate is <multiplier> (1) times that of the former, plus <offset> (0),
/// unless the file has a <mimic> of it. \returns whether it is one \throws InputError naming the line for names that do not exist
bool readMimicPlugin(const XMLElement& plugin, UrdfFile& tree);

/// onshape-to-robot marks the ends of loops by frames closing_NAME_1 and closing_NAME_2, others by frames ..cl4_1 and ..cl4_2 (or loop,
/// closure), and by nothing else, in all formats: those that no closure names are told; and so are dependent joints of URDF+
/// without any closure.
/// \param settings  with what completes the robot
void warnOfOpenLoops(UrdfFile& tree, const YamlFile& settings);

}  // namespace bielle
