#pragma once
// The motions that `bielle solve` knows: one entry each.
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "bielle/io/result.h"
#include "bielle/motion/sequence.h"

namespace bielle::cli {

// Values of many options under one name (`--weights NAME`).
struct MotionPreset {
  std::string name, help;
  std::function<void()> apply;
};

// One request: the numbers that can be set, and what makes the motion of them.
struct MotionRequest {
  std::vector<OptionEntry> options;
  std::vector<MotionPreset> presets;
  std::function<MotionPlan(const Model&, const VectorXd& q0)> plan;
  std::vector<SequencePart> parts;  // of a sequence
};

struct MotionEntry {
  std::string name, help, example;
  std::vector<std::string> flags;              // options that have a flag of their own, besides --set
  std::function<MotionRequest()> makeRequest;  // with every option at its default
};

const std::vector<MotionEntry>& getMotions();

// By name. \throws ModelError naming the file that asks for it, when there is none
const MotionEntry& findMotion(const std::string& file, const std::string& name);

// Motions by name, one after the other. Options are "NAME.option"; where a motion comes again NAME is "walk2" and so on.
// \throws ModelError when there is no such motion
inline constexpr const char* kSequence = "sequence";
MotionRequest makeSequenceRequest(const std::vector<std::string>& motions);

// Limits given by motor stand among what was requested under these names and that of the motor.
inline constexpr const char *kEffortLimit = "limit ", *kVelocityLimit = "velocity-limit ";

// The request that a result tells of, without limits: they are part of the problem, not of the motion.
// \throws ModelError when there is no such motion or option
MotionRequest remakeRequest(const MotionSummary& summary);

}  // namespace bielle::cli
