#pragma once
/// \file A robot as a page with a slider for each motor, and for parameters; its loops close as the sliders move.
///
/// The closed configurations are precomputed on a grid over the motors of each loop cluster (a motor outside all loops
/// has its own grid) and interpolated by the page. From the start posture (the robot's first reference, else any closed
/// one) each node of the grid is reached from a closed neighbour, so that the linkage keeps its branch. Where it does
/// not close, the page says so and keeps the last closed configuration. Beside the sliders stand the angles of joints without a motor,
/// the ratio of the linkage (ratio.h; of up to two motors, where it has serial joints) and its distance from dead points
/// (linkage.h), interpolated as well. Motors of clusters with more than three have no
/// slider.
#include <optional>
#include <string>
#include <vector>

#include "bielle/formats/reader.h"

namespace bielle {

/// A parameter of the robot with a slider of its own: the robots of its values, which have the same bodies, joints and motors.
struct ViewParameter {
  std::string name, unit;
  std::vector<double> values;
  std::vector<std::optional<LoadedRobot>> robots;  ///< none where the value is impossible
  size_t start = 0;                                ///< whose value is that of the robot itself
};

/// \throws InputError when no closed configuration of the robot is found; those of parameters are then said not to close
std::string makeView(const LoadedRobot& robot, const std::vector<ViewParameter>& parameters = {});

/// Writes the page to a temporary file and renames it. \throws InputError as above, or when it cannot be written
void writeView(const std::string& path, const LoadedRobot& robot, const std::vector<ViewParameter>& parameters = {});

}  // namespace bielle
