#pragma once
// What the trials of the predictive controller share.
#include <memory>

#include "bielle/control/predictive_controller.h"
#include "bielle/motion/squat.h"

namespace bielle::testing {

inline constexpr int kStageTicks = 12;  // control steps of 1 ms in a stage of a walk by command
inline constexpr int kLeadTicks = 4;    // that a solve begins before its stage, where it is asked to

// A squat of Bipetto, its solution, and the policy of its gains.
struct ShortSquat {
  Solution solution;
  std::unique_ptr<Policy> gains;
};
inline constexpr double kStage = 0.015;  // of it, s
SquatOptions makeShortSquat();
const ShortSquat& getShortSquat();

PredictiveOptions makeShortWindow(int threads);
// Of that squat.
std::unique_ptr<PredictiveController> makeController(const PredictiveOptions& options);

}  // namespace bielle::testing
