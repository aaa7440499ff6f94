#pragma once
// A result written in another program's format.
#include <string>
#include <vector>

namespace bielle::cli {

constexpr int kIsaacLab = 2;  // where none is given

struct ExportRequest {
  std::string directory, format;  // of the result; amp, beyondmimic, mcap, mjlab, mot, problem or sto
  std::string path;
  std::string robot;  // file of MuJoCo for the robot of a reference or a problem; a URDF of a problem is beside it
  double rate = 50;   // of a reference, frames per second
  int isaac_lab = kIsaacLab;  // its version, 2 or 3, if the format is of it
};

// Whether the format is one of references for learning.
bool isReference(const std::string& format);
// Whether it depends on the version of Isaac Lab.
bool isOfIsaacLab(const std::string& format);
// That no version was given. \param option  that gives it
std::string describeIsaacLab(const std::string& option);
// Whether the robot is written beside the motion.
bool hasRobot(const std::string& format);
// Returns warnings. \throws InputError when the result cannot be read, or a file cannot be written
std::vector<std::string> writeExport(const ExportRequest& request);

}  // namespace bielle::cli
