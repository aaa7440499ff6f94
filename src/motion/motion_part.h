#pragma once
// Motions that a library enters (model/missing_part.h). What `bielle solve` tells of them, their options included, is in the core
// (registry.cpp, motion_options.cpp).
#include <map>
#include <string>

#include "bielle/motion/registry.h"

namespace bielle {

struct MotionPart {
  MotionPlanner planner;
  // Of a motion with a file: the option that it is, as text.
  std::function<std::string(const std::string& path)> read{};
};
// By name.
std::map<std::string, MotionPart>& getMotionParts();

template <typename Options>
MotionPlanner makePlanner(MotionPlan (*plan)(const Model&, const Options&, const StandingRobot&)) {
  return [=](const Model& model, const StandingRobot& standing, const OptionSet& options) {
    return plan(model, readOptions<Options>(options), standing);
  };
}

}  // namespace bielle
