#pragma once
/// \file A robot as a page with a slider for each motor; its loops close as the sliders move.
///
/// The closed configurations are precomputed on a grid over the motors of each loop cluster (a motor outside all loops
/// has its own grid) and interpolated by the page. From the start posture (the robot's first reference, else any closed
/// one) each node of the grid is reached from a closed neighbour, so that the linkage keeps its branch. Where it does
/// not close, the page says so and keeps the last closed configuration. Motors of clusters with more than three have no
/// slider.
#include <string>

#include "bielle/formats/reader.h"

namespace bielle {

/// \throws InputError when no closed configuration is found
std::string makeView(const LoadedRobot& robot);

/// Writes the page to a temporary file and renames it. \throws InputError as above, or when it cannot be written
void writeView(const std::string& path, const LoadedRobot& robot);

}  // namespace bielle
