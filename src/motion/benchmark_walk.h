#pragma once
/// \file The benchmark walk: a fixed workload for measuring speed, not a good walk.
///
/// From the standing posture, 250 stages of 15 ms by default: double support (13), then four times right foot (26),
/// both (1), left foot (26), both (1); double support to the end. Stages where a foot lands are the switches.
/// Costs of a stage, h the time step:
/// - full state regularization about the standing posture at rest (including linkage joints, which would otherwise
///   force FDDP to short steps), and motor torques;
/// - centre of mass: x follows `speed` from the first step to the last switch, z stays;
/// - force of every stance foot: the weight divided by their number, along z;
/// - height of the swing foot: a half sine, `step_height` at mid-swing;
/// - velocity of both feet at the switches, zero, its weight divided by h.
/// With a friction, standing soles also keep their wrench cones, as in motions (addWrenchCones).
/// The last node has only the state regularization.
#include "bielle/motion/motion.h"

namespace bielle {

struct BenchmarkWalkOptions {
  int start_nodes = 13;            ///< double support before the first step
  int swing_nodes = 26;            ///< single support
  int switch_nodes = 1;            ///< double support between two steps
  int cycles = 4;                  ///< of two steps, right foot standing first
  int total_nodes = 250;           ///< the last double support fills up
  double time_step = 0.015;        ///< s
  double speed = 0.2;              ///< of the centre of mass along x, m/s
  double step_height = 0.04;       ///< of the swing foot at mid-swing, m
  double state_weight = 1;         ///< of the state regularization
  double importance_floor = 0.3;   ///< least weight of a coordinate within the state regularization
  double control_weight = 0.02;    ///< of the motor torques, 1/(N m)^2
  double com_weight = 1000;        ///< of the centre of mass, 1/m^2
  double force_weight = 10;        ///< of the contact force reference, over (m g)^2
  double height_weight = 1e4;      ///< of the height of the swing foot, 1/m^2
  double switch_weight = 1e2;      ///< of the velocity of both feet at the switches times h, s^2/m^2
  double terminal_weight = 1e3;    ///< of the velocities at the end
  double friction = 0;             ///< of the wrench cones of standing soles, 1; 0: there are none
  double contact_kp = 0;           ///< stabilisation of the contacts, 1/s^2
  double contact_kd = 100;         ///< 1/s
  std::string left = "foot_left";  ///< contact frames
  std::string right = "foot_right";
};

/// \throws InputError when the robot lacks a foot, or the schedule does not fit into total_nodes
Motion makeBenchmarkWalk(const Model& model, const BenchmarkWalkOptions& options = {},
                         Formulation formulation = Formulation::Reduced);

}  // namespace bielle
