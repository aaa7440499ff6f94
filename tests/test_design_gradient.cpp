// Gradients of designs: the measures of kept motions. Oracle: differences of fourth order over designs, each made and lifted
// anew; a five-bar leg whose torques are computed without loops' forces.
#include <cmath>

#include "bielle/design/run.h"
#include "bielle/motion/squat.h"
#include "bielle/motion/walk.h"
#include "check_derivative.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

const std::string kKnee = std::string(BIELLE_SOURCE_DIR) + "/examples/knee_design/knee.yaml";

DesignMotion makeSmallSquat() {
  SquatOptions options;
  options.depth = 0.9, options.duration = 0.8, options.settle = 0.1, options.time_step = 0.02;
  return {"squat", [options](const Model& model, const VectorXd& q0) { return planSquat(model, options, q0); }};
}

DesignMotion makeShortWalk() {
  WalkOptions options;
  options.speed = 0.4, options.steps = 2;
  return {"walk", [options](const Model& model, const VectorXd& q0) { return planWalk(model, options, q0); }};
}

Eigen::Index findActive(const MeasurePieces& term) {
  Eigen::Index active = 0;
  term.values.maxCoeff(&active);
  return active;
}

}  // namespace

TEST_CASE("design gradient: Bipetto's knee, torques and energy of kept motions") {
  const DesignSpec spec = readDesignSpec(kKnee);
  const Parametrization robot = makeParametrization(spec);
  const std::vector<std::string> knees = {"motor_knee_left", "motor_knee_right"};
  EvaluationOptions options;
  options.mode = MotionMode::Kept;
  const DesignEvaluator evaluator(robot, {makeSmallSquat(), makeShortWalk()},
                                  {{Measure::PeakTorque, knees, 1},
                                   {Measure::RmsTorque, knees, 2},
                                   {Measure::Energy, knees, 0.5},
                                   {Measure::RmsTorque, {}, 1}},
                                  options);
  const Eigen::Index n = robot.start().size();
  VectorXd x = robot.start();
  for (int trial = 0; trial < 2; ++trial) {
    CAPTURE(trial, x);
    const SlopedEvaluation here = evaluator.differentiate(x);
    REQUIRE(here.evaluation.status == DesignStatus::Feasible);
    MatrixXd analytic(4, n);
    for (int i = 0; i < 4; ++i) {
      const Eigen::Index active = findActive(here.terms[i]);
      analytic.row(i) = here.terms[i].gradients.row(active);
      const double weight = evaluator.objective()[i].weight / evaluator.start().terms[i];
      CHECK(here.terms[i].values[active] == Approx(weight * here.evaluation.terms[i]).epsilon(1e-9));
    }
    const MatrixXd numeric = differentiate(x, 1e-4, [&](const VectorXd& other) {
      const Evaluation evaluation = evaluator.evaluate(other);
      REQUIRE(evaluation.status == DesignStatus::Feasible);
      VectorXd terms(4);
      for (int i = 0; i < 4; ++i)
        terms[i] = evaluator.objective()[i].weight / evaluator.start().terms[i] * evaluation.terms[i];
      return terms;
    });
    INFO(analytic << "\n\n" << numeric);
    for (int i = 0; i < 4; ++i)
      checkDerivative(analytic.row(i), numeric.row(i), getName(evaluator.objective()[i].measure));
    x[0] -= 0.006, x[1] += 0.004, x[2] -= 0.005, x[3] += 0.003, x[4] += 0.002;
  }
}
