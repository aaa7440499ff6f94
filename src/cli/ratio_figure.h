#pragma once
// The figure of the reduction ratio.
#include "cli/ratio_report.h"
#include "results/plot.h"

namespace bielle::cli {

// R over the joint angle, or the condition number over both joint angles if there is a map; then the distance from
// dead points, if there are any near.
std::vector<Plot> makeRatioPlots(const RatioReport& report);

}  // namespace bielle::cli
