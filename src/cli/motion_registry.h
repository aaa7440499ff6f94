#pragma once
// The motions that `bielle solve` knows: one entry each.
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "bielle/motion/motion.h"

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
  std::function<Motion(const Model&, const ProblemOptions&)> make;
};

struct MotionEntry {
  std::string name, help, example;
  std::vector<std::string> flags;              // options that have a flag of their own, besides --set
  std::function<MotionRequest()> makeRequest;  // with every option at its default
};

const std::vector<MotionEntry>& getMotions();

}  // namespace bielle::cli
