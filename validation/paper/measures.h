#pragma once
// Quantities read from the results of a study.
#include <optional>
#include <string>
#include <vector>

#include "bielle/formats/reader.h"
#include "bielle/results/result.h"
#include "paper/studies.h"
#include "tasks/cells.h"

namespace bielle::paper {

using tasks::kMissing;

// The robot, and the motors of the compared joints.
struct ComparedRobot {
  LoadedRobot robot;
  ComparedJoints joints;
  std::vector<std::string> knee_motors, ankle_motors;  // of the closed model; the serial one has them on the joints
};
// \throws InputError when the robot has no such joints
ComparedRobot loadComparedRobot(const std::string& name);

// Torques of some motors over the window, absolute values, N m.
struct Load {
  double peak = kMissing, mean = kMissing;
};

// Extent of the lift (lift.json).
struct LiftFacts {
  std::string message;       // reason for an early end, or empty
  bool at_linkage = false;   // it ended with a linkage out of reach or at a dead point, not for lack of accuracy
  std::string joint;         // the joint driven by this linkage, or empty
  double until = kMissing;   // time of the last lifted node, s
  double margin = kMissing;  // least over nodes and linkages; 0 is a dead point of a joint
};

// One motion of one model.
struct Performance {
  std::string outcome = "none";  // converged, not converged, lifted, lift failed, refused: why, not done, ...
  bool success = false;          // converged, or lifted to its end
  std::optional<MotionRecord> record;
  std::optional<MotionSummary> summary;
  int iterations = 0;
  double seconds = kMissing;  // of the solver
  Load knee, ankle;
  double com_mean = kMissing;                            // height over the window, m
  double com_speed = kMissing;                           // forward, mean over the window, m/s
  double com_lowest = kMissing, com_highest = kMissing;  // of the whole motion, m
  double knee_least = kMissing, knee_most = kMissing;    // angle of the first knee, whole motion, rad
  LiftFacts lift;                                        // of lifted motions
  int first_node = 0, last_node = 0;                     // of the window
};

// One value of a study.
struct Comparison {
  double value = 0;
  Performance closed, serial, lifted, stepped;
};

// The results of the two cases in their directories.
Comparison readComparison(const Study& study, double value, const ComparedRobot& robot, const std::string& cases,
                          const CaseOutcome& closed, const CaseOutcome& serial);

// Paths of the contact frames of the closed robot: N + 1 x 3 each, m.
std::vector<RowMatrixXd> calcFeet(const Model& model, const MotionRecord& record);

}  // namespace bielle::paper
