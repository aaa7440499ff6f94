#pragma once
// Robots and motions that tests of designs share.
#include "bielle/motion/squat.h"
#include "bielle/robots/robot_loader.h"
#include "design/design_motions.h"

namespace bielle::testing {

inline const std::string kKnee = BIELLE_SOURCE_DIR "/examples/knee_design/knee.yaml";

inline Model loadBipetto() { return loadRobot(BIELLE_SOURCE_DIR "/robots/bipetto").model; }

inline DesignMotion makeSquat(double depth, double duration = 0.8, double settle = 0.1, double time_step = 0.02) {
  SquatOptions options;
  options.depth = depth, options.duration = duration, options.settle = settle, options.time_step = time_step;
  return {"squat",
          [options](const Model& model, const StandingRobot& standing) { return planSquat(model, options, standing); }};
}

inline double square(double x) { return x * x; }

// Of hardly any depth, short: the cheapest motion there is.
inline DesignMotion makeSmallSquat() { return makeSquat(0.95, 0.6, 0.06, 0.03); }

}  // namespace bielle::testing
