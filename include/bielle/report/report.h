#pragma once
/// \file A report: solved motions as one HTML page that needs only a browser, without a network.
///
/// It replays the robot in three dimensions and plots its quantities over time, from the files in a result's directory
/// (result.h): trajectory.npz, summary.json, check.json if it is there. Keys of
/// summary.json beyond those of a bare run are used if present: `robot_file`, `phases`, `ground`. Of a motion that `bielle simulate`
/// carried out, its outcome, its pushes and, from plan.npz, its plan are shown as well. Several directories are compared on
/// one page. Names from the files are escaped and shown as text.
#include <string>
#include <vector>

namespace bielle {

/// The page. The robots are loaded again, by `robot_file` or else by name.
/// \throws InputError naming the file that is missing or inconsistent (for example a robot that has changed since)
std::string makeReport(const std::vector<std::string>& directories);

/// Writes the page to a temporary file and renames it when complete.
/// \throws InputError as above, or when it cannot be written
void writeReport(const std::string& path, const std::vector<std::string>& directories);

}  // namespace bielle
