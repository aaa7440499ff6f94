#pragma once
// What a robot consists of, and whether its loops close, for `bielle info` and Python.
#include "bielle/model/reader.h"
#include "io/json_text.h"

namespace bielle {

// Sizes, mass, mobility, and lists of joints, closures, clusters, motors, contacts and references. The gaps of closures are
// given at the neutral configuration and at each reference, [m, rad].
Json makeRobotInfo(const LoadedRobot& robot);

}  // namespace bielle
