#pragma once
// Whether a result is of another robot than the one at hand.
#include <string>

#include "bielle/formats/reader.h"

namespace bielle {

// How the robot of a result differs from this one, e.g. " (`<mass value="9"/>` now, `<mass value="8"/>` then)"; empty where it
// does not, or where summary.json has no fingerprint. \throws InputError as loadRobotOf() does
std::string describeOtherRobot(const std::string& directory, const LoadedRobot& now);

}  // namespace bielle
