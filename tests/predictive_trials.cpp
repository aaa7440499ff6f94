#include "predictive_trials.h"

#include <catch2/catch.hpp>

#include "own_robots.h"

namespace bielle::testing {

SquatOptions makeShortSquat() {
  SquatOptions options;
  options.depth = 0.93;
  options.duration = 0.5;
  options.time_step = kStage;
  return options;
}

const ShortSquat& getShortSquat() {
  static const ShortSquat squat = [] {
    const Model& model = getBipetto();
    SolveOptions how;
    how.solver = FddpOptions();
    const MotionPlan plan = planSquat(model, makeShortSquat(), makeStandingRobot(model));
    ShortSquat out{solve(makeMotion(model, plan, ProblemOptions()), how), nullptr};
    REQUIRE(out.solution.converged());
    out.gains = std::make_unique<Policy>(makePolicy(out.solution));
    return out;
  }();
  return squat;
}

PredictiveOptions makeShortWindow(int threads) {
  PredictiveOptions options;
  options.nodes = 30;
  options.threads = threads;
  return options;
}

std::unique_ptr<PredictiveController> makeController(const PredictiveOptions& options) {
  const Model& model = getBipetto();
  const MotionPlan plan = planSquat(model, makeShortSquat(), makeStandingRobot(model));
  return std::make_unique<PredictiveController>(makePredictiveMotion(model, plan, ProblemOptions(), options),
                                                getShortSquat().solution.trajectory, options);
}

}  // namespace bielle::testing
