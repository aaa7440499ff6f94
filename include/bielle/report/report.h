#pragma once
/// \file A report: solved motions as one page of HTML that needs nothing but a browser, not even a network.
///
/// It replays the robot in three dimensions and plots what happens over time, out of the files that a result leaves in
/// its directory (result.h): trajectory.npz, else trajectory.csv; summary.json; check.json if it is there. Keys of
/// summary.json beyond those of a bare run are used when present: `robot_file`, `phases`, `ground`. Several
/// directories are compared on one page. Names found in the files are shown as text, whatever characters they hold.
#include <string>
#include <vector>

namespace bielle {

/// The page. The robots are loaded again, by `robot_file` or else by name.
/// \throws ModelError naming the file that is missing or does not fit (a robot that has changed since, for example)
std::string makeReport(const std::vector<std::string>& directories);

/// Writes the page aside and renames it when it is whole. \throws ModelError as above, or when it cannot be written
void writeReport(const std::string& path, const std::vector<std::string>& directories);

}  // namespace bielle
