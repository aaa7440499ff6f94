#pragma once
/// \file The motions that `bielle solve` knows, by name, and sequences of them as one optimal control problem.
///
/// Each motion of a sequence starts from the standing posture in which the previous one ends. Only the last motion keeps its terminal
/// costs, so that the others need not come to rest. The ground has the steps of all motions and the lowest of their
/// planes; higher soles stand on platforms.
#include <functional>
#include <string>
#include <vector>

#include "bielle/motion/motion.h"

namespace bielle {

struct SequencePart {
  std::string name;  ///< prefix of its phases and options: "NAME.depth"
  std::function<MotionPlan(const Model&, const StandingRobot&)> plan;  ///< e.g. planSquat with its options
};

/// \throws InputError when there is no part, when one is impossible, or when they differ in friction or do not fit on
/// one ground
MotionPlan planSequence(const Model& model, const std::vector<SequencePart>& parts, const StandingRobot& standing);

/// From the robot's standing posture.
Motion makeSequence(const Model& model, const std::vector<SequencePart>& parts, const ProblemOptions& problem = {});

struct MotionRequest;

/// An option of a motion that is read from a file (`--NAME FILE`): the request then holds what it says, and needs it no more.
struct MotionFile {
  std::string name, help;
  std::function<void(const std::string& path, MotionRequest&)> read;  ///< throws InputError
};

using MotionPlanner = std::function<MotionPlan(const Model&, const StandingRobot&, const OptionSet& options)>;

/// A motion by name with its options, a value.
struct MotionRequest {
  OptionSet options;
  std::vector<MotionFile> files;
  MotionPlanner planner;
  std::vector<std::pair<std::string, MotionPlanner>> parts;  ///< of a sequence, by name

  MotionPlan plan(const Model& model, const StandingRobot& standing) const { return planner(model, standing, options); }
};

struct MotionEntry {
  std::string name, help, example;
  std::vector<std::string> flags;  ///< options with their own flag, besides --set
  MotionRequest request;           ///< with every option at its default
};

const std::vector<MotionEntry>& getMotions();

/// Finds a motion by name. \throws InputError naming the file that requests it, when there is none
const MotionEntry& findMotion(const std::string& file, const std::string& name);

/// Consecutive motions by name. Options are "NAME.option"; if a motion is repeated NAME is "walk2" and so on.
/// \throws InputError when there is no such motion
inline constexpr const char* kSequence = "sequence";
MotionRequest makeSequenceRequest(const std::vector<std::string>& motions);
/// The motions of a sequence; none of another request.
std::vector<SequencePart> listParts(const MotionRequest& request);

/// Prefixes of limits given by motor or linkage among the options of a motion, followed by its name.
inline constexpr const char *kEffortLimit = "limit ", *kVelocityLimit = "velocity-limit ",
                            *kPowerLimit = "power-limit ";
inline constexpr const char *kDeadPointMargin = "dead-point-margin", *kNoLimits = "no-limits",
                            *kDeadPointMarginOf = "dead-point-margin of ";

/// The motion of a request from the robot's standing posture. The limits given by motor are listed with the other options.
/// \throws InputError as makeMotion() does
Motion makeMotion(const Model& model, const MotionRequest& request, const ProblemOptions& problem = {});

}  // namespace bielle
