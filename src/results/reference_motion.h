#pragma once
/// \file Motions at a uniform rate, as references for learning: what MuJoCo has, frame by frame, in the robot that formats/mjcf.h
/// writes with MjcfRotations::Hinges.
///
/// Frame k is at k / rate, s. Between the nodes of a record, coordinates follow the cubic of both states in the tangent space,
/// velocities the straight line; then loops are closed and velocities projected on them. Torques are those of the stage.
#include <string>
#include <vector>

#include "bielle/motion/record.h"

namespace bielle {

struct ReferenceMotion {
  double rate = 0;                       ///< frames per second
  std::vector<std::string> joint_names;  ///< in the order of the file, but for a free joint of the first body
  std::vector<std::string> body_names;   ///< in the order of the file: depth first, without the world
  std::vector<std::string> motor_names;  ///< in the order of u
  RowMatrixXd joint_pos, joint_vel;      ///< rad, m; turns are counted on, not wrapped
  RowMatrixXd body_pos, body_quat;       ///< 3 and 4 columns per body: origin and w, x, y, z of its frame in the world
  RowMatrixXd body_lin_vel, body_ang_vel;  ///< 3 columns per body, of the origin of its frame, in the world
  RowMatrixXd body_com_vel;                ///< 3 columns per body, of its centre of mass, in the world
  RowMatrixXd motor_torque;                ///< N m or N
  VectorXd cycle;                          ///< of a motion that repeats, as in the record; else empty
  std::vector<std::string> warnings;       ///< of hinges that nearly lock
};

/// \param rate  of a motion that repeats, the nearest one at which its period is a whole number of frames is taken: the last frame
/// is then the first one, moved   \param q_ref  of formatMjcf()
/// \throws InputError when the motion has no time, or its loops cannot be closed at a frame
ReferenceMotion makeReferenceMotion(const Model& model, ConstVectorRef q_ref, const MotionRecord& record, double rate);

enum class ReferenceFormat {
  Amp,          ///< of Isaac Lab's AMP: fps, dof_names, body_names, dof_positions, dof_velocities, body_positions, ...
  BeyondMimic,  ///< of BeyondMimic, which is trained in Isaac Lab: the names of mjlab
  Mjlab         ///< of mjlab: fps, joint_pos, joint_vel, body_pos_w, body_quat_w, body_lin_vel_w, body_ang_vel_w
};
inline bool isOfIsaacLab(ReferenceFormat format) { return format != ReferenceFormat::Mjlab; }

/// As a NumPy archive; all have the names of joints, bodies and motors, and motor_torque, as well; of a motion that
/// repeats loop_mode ("wrap"), period (s) and cycle_offset (x, y, yaw). Those of mjlab have
/// velocities of the frames' origins, and quaternions w, x, y, z. Those of Isaac Lab have velocities of centres of mass
/// (its `body_lin_vel_w` and `write_root_com_velocity_to_sim`), quaternions x, y, z, w from version 3 on, and the version.
/// \param isaac_lab  its version: 2 or 3
std::string formatReferenceMotion(const ReferenceMotion& motion, ReferenceFormat format, int isaac_lab = 2);

}  // namespace bielle
