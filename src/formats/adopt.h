#pragma once
/// \file A first file that completes a robot of others: feet, soles, a standing posture, motors and serial joints, guessed.
#include <string>
#include <vector>

#include "bielle/formats/reader.h"

namespace bielle {

struct Adoption {
  std::string yaml;                  ///< as formats/reader.h reads it; comments explain every guess
  std::vector<std::string> guesses;  ///< the same, one line each
};

/// Guesses from the closed configuration nearest to neutral or, where no posture is found from there, nearest to the middle of all
/// ranges of joints, x forward and z up:
/// - feet (formats/adopt_feet.h): the lowest frames whose z axis is up and that are named foot or sole, or new ones on the lowest
///   points of shapes or, where there are none, where legs that cannot turn their feet end; two of them, if one is the mirror image
///   of the other, or one on each of more legs;
/// - soles: the extent of the shapes of the foot; narrow ones are edges, balls are points, as are all feet that cannot turn about their
///   point (formats/adopt_freedoms.h); without shapes, 0.1 m square;
/// - the posture `half_sitting`: feet flat, as far apart as there and two soles at least, or one sole where that cannot be, the centre
///   of mass over their middle, the base at the greatest of 94, 90, .. 50 % of its height there that can be assembled within the ranges
///   of the joints;
/// - motors: those of the robot or, if there are none, on joints that move all others (formats/adopt_freedoms.h); rotors of
///   1e-3 kg m^2 where it has none, and no limits where they could not hold its weight on a lever of 20 mm;
/// - friction: speeds below which it is a damper so large that steps of 15 ms follow it (dynamics/smooth_friction.h), in place of 0.01;
/// - serial joints: those from base to foot, if they are six of one coordinate each. Dead points of their linkages that they can
///   reach from the posture are told, and that one lies between it and the neutral configuration.
/// \param model  value of the key `model`: the path of the robot, as the file will name it
/// \throws InputError when the robot has no free base, gravity more than 26 degrees beside -z, no loop that closes or no such foot
Adoption adoptRobot(const LoadedRobot& robot, const std::string& model);

}  // namespace bielle
