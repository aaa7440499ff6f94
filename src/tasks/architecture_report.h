#pragma once
// The results of a comparison of robots: numbers, compare.csv, compare.md and figures.
#include <limits>
#include <string>
#include <vector>

#include "tasks/architectures.h"

namespace bielle::tasks {

// Torques of the motors of a group.
struct GroupLoad {
  double peak = 0;   // of any of them, N m
  double rms = 0;    // over time and over them, N m
  double speed = 0;  // largest of any of them, rad/s
};

// One motion of one robot.
struct Feat {
  std::string outcome;  // passed, not checked, or the problem
  bool done = false;    // converged, met its goals and passed (or not checked, if there is no check)
  bool exists = false;  // there is a motion, done or not, with the numbers below
  int iterations = 0;
  MotorTrace trace;
  std::vector<std::pair<double, double>> com_height;      // over time, s and m
  std::vector<GroupLoad> groups;                          // as in the spec
  double peak_power = 0;                                  // mechanical, of all motors together at a time, W
  double energy = 0;                                      // mechanical, J (design/measures.h)
  double electrical_energy = 0;                           // J
  double com_start = 0, com_lowest = 0, com_highest = 0;  // m
  double distance = 0;                                    // of the centre of mass, over the ground, m
  double duration = 0;                                    // s
  double cost_of_transport = 0;  // electrical energy over weight and distance; NaN for less than 0.2 m
};

Feat readFeat(const ArchitectureSpec& spec, const Contender& contender, const std::string& directory,
              const CaseOutcome& outcome);

// By robot, then by motion or speed.
struct ArchitectureResults {
  std::vector<std::vector<Feat>> motions, speeds;
};

// Writes the page, the table and the figures. Returns their paths; `notes` lists figures that could not be drawn.
// \throws InputError when a file cannot be written
std::vector<std::string> writeArchitectures(const std::string& directory, const ArchitectureSpec& spec,
                                            const std::vector<Contender>& contenders,
                                            const ArchitectureResults& results, std::vector<std::string>& notes);

}  // namespace bielle::tasks
