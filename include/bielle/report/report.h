#pragma once
/// \file Pages that need only a browser, without a network: reports on solved motions, and views of robots.
///
/// A report replays the robot in three dimensions and plots its quantities over time, from the files in a result's directory
/// (result.h): trajectory.npz, summary.json, check.json if it is there. Keys of
/// summary.json beyond those of a bare run are used if present: `robot_file`, `phases`, `ground`. Of a motion that `bielle simulate`
/// carried out, its outcome, its pushes and, from plan.npz, its plan are shown as well. Several directories are compared on
/// one page. Names from the files are escaped and shown as text.
///
/// A view is a robot with a slider for each motor, and for parameters; its loops close as the sliders move. The closed configurations are precomputed on a grid over the motors of each loop cluster (a motor outside all loops
/// has its own grid) and interpolated by the page. From the start posture (the robot's first reference, else any closed
/// one) each node of the grid is reached from a closed neighbour, so that the linkage keeps its branch. Where it does
/// not close, the page says so and keeps the last closed configuration. Beside the sliders stand the angles of joints without a motor,
/// the ratio of the linkage (ratio.h; of up to two motors, where it has serial joints) and its distance from dead points
/// (linkage.h), interpolated as well. Motors of clusters with more than three have no slider.
#include <optional>
#include <string>
#include <vector>

#include "bielle/formats/reader.h"

namespace bielle {

/// The page, with the robots of the results (loadRobotOf).
/// \throws InputError naming the file that is missing or inconsistent
std::string makeReport(const std::vector<std::string>& directories);

/// Writes the page to a temporary file and renames it when complete.
/// \throws InputError as above, or when it cannot be written
void writeReport(const std::string& path, const std::vector<std::string>& directories);

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
