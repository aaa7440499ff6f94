#pragma once
/// \file The parts of a robot and whether its loops close, as `bielle info` prints them.
#include <string>

#include "bielle/formats/reader.h"

namespace bielle {

/// A JSON object: sizes, mass, mobility, and lists of joints, closures, clusters, motors, point springs, contacts and
/// references, and the joints that these give with their values as assembled, rad or m. The gaps of closures, [m, rad], and the lengths of point springs, m, are given at the neutral configuration and
/// at each reference.
std::string makeRobotInfo(const LoadedRobot& robot);

/// Warnings "file: reference: problem" for references that close with a given joint farther than kReferenceTolerance from its
/// value, or that give and have one outside its range.
/// \throws InputError for a reference that gives a value outside the range of its joint and does not close there
std::vector<std::string> checkReferences(const LoadedRobot& robot);
inline constexpr double kReferenceTolerance = 0.01;  // rad or m

}  // namespace bielle
