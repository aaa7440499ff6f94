#pragma once
/// \file What was taken for rounding in the linkages of a robot, or is too much for that, as warnings.
#include <string>
#include <vector>

#include "dynamics/rounded_linkages.h"

namespace bielle {

/// Adds one warning for all linkages that were mended, and one for each that is locked or has fewer freedoms than motors.
/// \param path   of the file of its placements   \param loops  of that of its closures and motors
void warnOfRounding(const RoundedLinkages& linkages, const std::string& path, const std::string& loops,
                    std::vector<std::string>& warnings);

}  // namespace bielle
