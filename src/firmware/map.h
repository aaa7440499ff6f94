#pragma once
// The maps of one linkage over a range of its joints: how they are computed, and how exact they are.
#include "bielle/firmware/firmware.h"
#include "firmware/solution.h"

namespace bielle::firmware {

// A posture of the exact mechanism.
struct ExactPosture {
  Eigen::VectorXd joints, motors;
  Eigen::MatrixXd R;
};

struct MapErrors {
  double motors = 0, joints = 0;  // largest error of a coordinate, rad or m
  double ratio = 0;               // of R, over its largest entry
};

struct Maps {
  std::string robot, base;  // the body that carries the linkage
  std::string name;         // a C identifier
  std::vector<std::string> joint_names, motor_names;
  std::vector<bool> joint_slides, motor_slides;  // m instead of rad
  std::vector<Motor> motors;
  Mechanism mechanism;
  Eigen::VectorXd lower, upper;              // of the joints
  Eigen::VectorXd motor_lower, motor_upper;  // over that range
  Postures samples;                          // the first one is the reference
  Solution inverse, direct;                  // motors from joints, and joints from motors
  RateSolution rates;
  double nearest = 0;        // least distance from a dead point in the range, as estimated
  double largest_ratio = 0;  // entry of R
  long postures = 0;
  MapErrors errors;
  std::vector<ExactPosture> vectors;  // for the test program

  int size() const { return mechanism.size; }
  bool hasNear() const { return nearest < kNearDeadPoint; }
};

// Nothing if the motors do not determine what the joints do: springs bear the rest.
// \throws InputError as of formatFirmware()
std::optional<Maps> makeMaps(const Model& model, const Linkage& linkage, ConstVectorRef q,
                             const FirmwareOptions& options);

}  // namespace bielle::firmware
