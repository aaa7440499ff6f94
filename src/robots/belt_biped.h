#pragma once
/// \file A biped with serial hips, knees driven by belts and ankles driven by differentials, and two with one of these alone.
///
/// x forward, y left, z up; s = +1 for the left leg, -1 for the right one. All frames are parallel in the neutral
/// configuration, which is closed: legs straight, motors at 0. Joints of a leg: those of SerialBipedParameters.
///
/// Knee: a motor on the thigh at the hip turns the knee by a belt,
///     motor_knee = n knee                                                                                        (1)
/// Ankle: pitch and roll in one point, driven by two motors on the shank through a differential,
///     (motor_ankle1 + motor_ankle2) / 2 = m ankley,    s (motor_ankle1 - motor_ankle2) / 2 = m anklex            (2)
/// so that equal turns pitch the foot and opposite ones roll it, each motor with half of the torque. Angles of motors
/// are those of their pulleys relative to the link that carries them. (1) and (2) are couplers: belts and gears have no
/// mass of their own, pulleys have.
///
/// With belts alone, motors drive the ankles' joints directly; with differentials alone, those of the knees. The masses of the motors
/// stay in their places, the pulleys go.
///
/// The architecture is common. Distance of the hips, soles, height of the trunk in half_sitting and total mass are
/// about those of robots/bipetto; all other dimensions and masses are ours, and no such robot was built.
#include "robots/biped_parts.h"

namespace bielle {

struct BeltBipedParameters : SerialBipedParameters {
  double knee_ratio = 2;           ///< n: turns of the motor's pulley per turn of the knee
  double ankle_ratio = 2;          ///< m: of the mean turn of the motors per turn of the ankle
  double ankle_motor_drop = 0.06;  ///< of the ankle motors below the knee, m
  double pulley_mass = 0.1;        ///< of each motor's pulley, kg
};

std::vector<Parameter> listParameters(BeltBipedParameters& parameters);

/// \throws ModelError when a parameter is outside its bounds, or the legs do not reach from hip_height to the ground
Model makeBeltBiped(const BeltBipedParameters& parameters = {});

/// Its knees driven by belts, its ankles serial.
struct BeltKneeParameters : BeltBipedParameters {};
std::vector<Parameter> listParameters(BeltKneeParameters& parameters);
Model makeBeltKnee(const BeltKneeParameters& parameters = {});

/// Its knees serial, its ankles driven by differentials.
struct DifferentialAnkleParameters : BeltBipedParameters {};
std::vector<Parameter> listParameters(DifferentialAnkleParameters& parameters);
Model makeDifferentialAnkle(const DifferentialAnkleParameters& parameters = {});

}  // namespace bielle
