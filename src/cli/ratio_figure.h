#pragma once
// The figure of the reduction ratio.
#include <string>

#include "cli/ratio_report.h"

namespace bielle::cli {

// Script for drawSvg: R over the joint angle, or the condition number over both joint angles if there is a map.
std::string makeRatioScript(const RatioReport& report);

}  // namespace bielle::cli
