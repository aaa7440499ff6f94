#pragma once
/// \file The motions that `bielle solve` knows, by name: one entry each.
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "bielle/io/result.h"
#include "bielle/motion/sequence.h"

namespace bielle {

/// Values of many options under one name (`--weights NAME`).
struct MotionPreset {
  std::string name, help;
  std::function<void()> apply;
};

/// Data of a motion that come from a file (`--NAME FILE`).
struct MotionFile {
  std::string name, help;
  std::function<void(const std::string& path)> read;  ///< throws ModelError
};

/// One request: the options, and the functions that make the motion from them.
struct MotionRequest {
  std::vector<OptionEntry> options;
  std::vector<MotionPreset> presets;
  std::vector<MotionFile> files;
  std::function<MotionPlan(const Model&, const VectorXd& q0)> plan;
  std::vector<SequencePart> parts;  ///< of a sequence
};

struct MotionEntry {
  std::string name, help, example;
  std::vector<std::string> flags;              ///< options with their own flag, besides --set
  std::function<MotionRequest()> makeRequest;  ///< with every option at its default
};

const std::vector<MotionEntry>& getMotions();

/// Finds a motion by name. \throws ModelError naming the file that requests it, when there is none
const MotionEntry& findMotion(const std::string& file, const std::string& name);

/// Consecutive motions by name. Options are "NAME.option"; if a motion is repeated NAME is "walk2" and so on.
/// \throws ModelError when there is no such motion
inline constexpr const char* kSequence = "sequence";
MotionRequest makeSequenceRequest(const std::vector<std::string>& motions);

/// Prefixes of limits given by motor among the options of a motion, followed by the name of the motor.
inline constexpr const char *kEffortLimit = "limit ", *kVelocityLimit = "velocity-limit ",
                            *kPowerLimit = "power-limit ";
inline constexpr const char* kDeadPointMargin = "dead-point-margin";

/// The motion of a request from the robot's standing posture. The limits given by motor are listed with the other options.
/// \throws ModelError as makeMotion() does
Motion makeRequested(const MotionRequest& request, const Model& model, const ProblemOptions& problem);

/// The request recorded in a result, without limits, which are part of the problem and not of the motion.
/// \throws ModelError when there is no such motion or option
MotionRequest remakeRequest(const MotionSummary& summary);

}  // namespace bielle
