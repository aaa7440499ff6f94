// Models whose curvature is too small by a factor along some directions.
#include <catch2/catch.hpp>

#include "bielle/solve/fddp.h"
#include "solve_in_place.h"
#include "solve_problems.h"

using namespace bielle;
using namespace bielle::test;

namespace {

// Controls are states; one of two directions is `steepness` times as curved as its model says.
class FlatModels : public PlainProblem {
 public:
  explicit FlatModels(double steepness) : curvature_(1, steepness) {}
  int numStages() const override { return 3; }
  int stateSize() const override { return 2; }
  int tangentSize(int) const override { return 2; }
  int controlSize(int) const override { return 2; }
  const VectorXd& initialState() const override { return start_; }
  double calcStep(int, const VectorXd&, const VectorXd& u, VectorXd& x_next) const override {
    x_next = u;
    return 1 + 0.5 * (u - goal_).dot(curvature_.cwiseProduct(u - goal_));
  }
  double calcTerminalCost(const VectorXd&) const override { return 0; }
  void linearizeStage(const NodeEvaluation& at, StageModel& out) const override {
    out.Fx().setZero();
    out.Fu().setIdentity();
    out.lx.setZero();
    out.lu = curvature_.cwiseProduct(at.u - goal_);
    out.luu().setIdentity();
  }
  void linearizeTerminal(const VectorXd&, StageModel& out) const override { out.lx.setZero(); }

 private:
  const Eigen::Vector2d curvature_, goal_{1, 2};
  const VectorXd start_ = VectorXd::Zero(2);
};

}  // namespace

TEST_CASE("fddp: a direction that models make too flat does not hold up the others") {
  for (double steepness : {1.0, 4.0, 7.0, 15.0}) {
    CAPTURE(steepness);
    const FlatModels problem(steepness);
    ShootingTrajectory t{{4, VectorXd::Zero(2)}, {3, VectorXd::Zero(2)}};
    FddpOptions options;
    options.gradient_tolerance = 1e-16;
    const FddpSummary summary = solveInPlace(problem, t, options);
    CAPTURE(summary.message, summary.iterations);
    CHECK(summary.termination == FddpTermination::Converged);
    CHECK(summary.iterations < 25);
    for (const VectorXd& u : t.us) CHECK((u - Eigen::Vector2d(1, 2)).norm() < 1e-6);
  }
}
