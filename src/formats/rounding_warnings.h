#pragma once
/// \file What was taken for rounding in the linkages of a robot, or is too much for that, as warnings.
#include <string>
#include <vector>

#include "dynamics/rounded_linkages.h"

namespace bielle {

/// Adds one warning for all linkages that were mended, and one for each that has fewer freedoms than motors.
void warnOfRounding(const RoundedLinkages& linkages, const std::string& path, std::vector<std::string>& warnings);

}  // namespace bielle
