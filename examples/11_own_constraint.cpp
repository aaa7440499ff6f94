/// \file A squat whose knees must not go too far forward, and what that costs.
///
/// With x_knee(q) the place of a knee along the robot's x axis, the squat of chapter 2 gets one more row per knee and node,
///     x_knee(q_k) <= x_max,                                                                                    (1)
/// where x_max is a centimetre less than the knees go by themselves. Residuals become constraints by bounds and a scale,
/// the violation that counts as 1. The solver returns multipliers y_k >= 0, positive only where (1) binds, for which
///     L = J + sum_k y_k (x_knee(q_k) - x_max)                                                                   (2)
/// has no gradient. So they are a price: a bound that is wider by d saves
///     J(x_max) - J(x_max + d) = d sum_k y_k + O(d^2).                                                           (3)
/// We check that (1) holds, and compare (3) with what two more squats cost.
#include <cstdio>
#include <limits>

#include "bielle/motion/solve.h"
#include "bielle/motion/squat.h"
#include "bielle/robots/robot_loader.h"

using namespace bielle;

namespace {

constexpr double kFree = std::numeric_limits<double>::infinity();

struct Squat {
  FddpSummary summary;
  double farthest = -kFree;  // x_knee, m
  double price = 0;          // sum of y_k over nodes and knees, unit of the cost over m
};

// Without a bound when x_max is infinite.
Squat solve(const Model& model, double x_max) {
  MotionPlan plan = planSquat(model, {}, makeStandingRobot(model));
  const double scale = 0.01;  // m
  for (StageSpec& stage : plan.stages)
    for (const char* shin : {"shin_left", "shin_right"})
      stage.path_constraints.push_back(
          {std::string("knee of ") + shin, makeFrameTranslation(getBodyFrame(model, shin), Vector3d::Zero()),
           Vector3d::Constant(-kFree), Vector3d(x_max, kFree, kFree), Vector3d::Constant(scale)});
  const Motion motion = makeMotion(model, std::move(plan), {});
  SolveOptions options;
  options.solver.gradient_tolerance = 1e-12;
  const Solution solution = bielle::solve(motion, options);
  Squat out;
  out.summary = solution.summary;
  const std::vector<VectorXd>& multipliers = solution.multipliers.values;
  const auto& [xs, us] = solution.trajectory;
  RobotEvaluator evaluator(*motion.problem);
  for (size_t k = 0; k < xs.size(); ++k) {
    const VectorXd u = k < us.size() ? us[k] : VectorXd();
    const int node = static_cast<int>(k);
    const VectorXd& c = evaluator.evaluate(node, xs[k], u).constraints;
    for (int row = 0; row < c.size(); ++row) {
      const std::string name = motion.problem->getConstraintName(node, row);
      if (name != "knee of shin_left, row 0" && name != "knee of shin_right, row 0") continue;  // x of a knee
      out.farthest = std::max(out.farthest, scale * c[row]);
      out.price += multipliers[k][row] / scale;
    }
  }
  return out;
}

bool check(const char* what, double value, double expected, double tolerance) {
  const bool ok = std::abs(value - expected) <= tolerance;
  std::printf("%-52s %12.6f  %12.6f  %s\n", what, value, expected, ok ? "ok" : "FAILED");
  return ok;
}

}  // namespace

int main() {
  const Model model = loadRobot("bipetto").model;
  const Squat free = solve(model, kFree);
  const double x_max = free.farthest - 0.01, d = 2e-4;
  const Squat bounded = solve(model, x_max), wider = solve(model, x_max + d), tighter = solve(model, x_max - d);
  for (const Squat* squat : {&free, &bounded})
    std::printf("knees at most at %.4f m, cost %.6f, %d iterations, %s\n", squat->farthest, squat->summary.cost,
                squat->summary.iterations, squat->summary.message.c_str());
  std::printf("\n%-52s %12s  %12s\n", "", "measured", "expected");
  bool ok = check("Eq. (1): the knees go as far as they may [m]", bounded.farthest, x_max, 1e-9);
  const double saved = (tighter.summary.cost - wider.summary.cost) / (2 * d);
  ok &= check("Eq. (3): price of a metre", bounded.price, saved, 0.01 * saved);
  ok &= bounded.summary.termination == FddpTermination::Converged && bounded.price > 0 && free.price == 0;
  return ok ? 0 : 1;
}
