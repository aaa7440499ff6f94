#pragma once
/// \file The parts of a robot and whether its loops close, as `bielle info` prints them.
#include <string>

#include "bielle/model/reader.h"

namespace bielle {

/// A JSON object: sizes, mass, mobility, and lists of joints, closures, clusters, motors, point springs, contacts and
/// references. The gaps of closures, [m, rad], and the lengths of point springs, m, are given at the neutral configuration and
/// at each reference.
std::string makeRobotInfo(const LoadedRobot& robot);

}  // namespace bielle
