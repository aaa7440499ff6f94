#pragma once
// A result written in another program's format.
#include <string>
#include <vector>

namespace bielle::cli {

struct ExportRequest {
  std::string directory, format;  // of the result; amp, mcap, mjlab, mot, problem or sto
  std::string path;
  std::string robot;  // file of MuJoCo for the robot of a reference or a problem; a URDF of a problem is beside it
  double rate = 50;   // of a reference, frames per second
};

// Whether the format is one of references for learning.
bool isReference(const std::string& format);
// Whether the robot is written beside the motion.
bool hasRobot(const std::string& format);
// Returns warnings. \throws InputError when the result cannot be read, or a file cannot be written
std::vector<std::string> writeExport(const ExportRequest& request);

}  // namespace bielle::cli
