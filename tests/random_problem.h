#pragma once
// A shooting problem of one random stage and a terminal node, with costs of every sort.
#include <random>

#include "bielle/motion/motion.h"
#include "discretizations.h"
#include "math/so3.h"
#include "mechanisms.h"

namespace bielle::testing {

inline StateCost makeRandomStateCost(std::mt19937& rng, const Model& model, const VectorXd& q) {
  return {0.7, model.integrate(q, randomVector(rng, model.nv(), 0.6)), randomVector(rng, model.nv()),
          randomVector(rng, 2 * model.nv()).cwiseAbs(), exp3(Vector3d(0.4, -0.7, 0.5))};
}

// A stage with a cost of every sort that looks at q, v, u and the forces; the barrier is crossed by some rows only.
inline StageSpec makeStage(std::mt19937& rng, const Model& model, const VectorXd& q,
                           const std::vector<ContactTarget>& contacts, StepRule step = StepRule::Euler) {
  StageSpec stage;
  stage.step = step;
  stage.dt = 0.02;
  stage.constraints = makeConstraintSet(model, contacts);
  stage.state = makeRandomStateCost(rng, model, q);
  stage.control = {0.3, randomVector(rng, model.nu()), randomVector(rng, model.nu()).cwiseAbs()};
  const auto quadratic = [&](int n) { return Activation::makeQuadratic(randomVector(rng, n).cwiseAbs()); };
  stage.costs.push_back({"com", 2, quadratic(3), makeComPosition(randomVector(rng, 3))});
  stage.costs.push_back({"com velocity", 2, quadratic(3), makeComVelocity(randomVector(rng, 3))});
  const BodyFrame frame{model.numBodies() - 1, randomPlacement(rng)};
  stage.costs.push_back({"velocity", 1, quadratic(6), makeFrameVelocity(frame, randomVector(rng, 6))});
  for (int c = 0; c < static_cast<int>(stage.constraints.closures.size()); ++c) {
    const int rows = countForces(stage.constraints, c);
    stage.costs.push_back(
        {"force", 1e-2, quadratic(rows), makeContactForce(stage.constraints, c, randomVector(rng, rows, 5))});
    if (c < stage.constraints.num_loops) continue;
    std::unique_ptr<Residual> cone = makeWrenchCone(stage.constraints, c, 0.1, 0.04, 0.5);
    const int n = cone->size();
    stage.costs.push_back({"cone", 1e-2,
                           Activation::makeBarrier(VectorXd::Ones(n), VectorXd::Zero(n), VectorXd::Constant(n, 1e12)),
                           std::move(cone)});
  }
  for (const Linkage& linkage : listLinkages(model, q))
    stage.costs.push_back({"transmission", 1, quadratic(1), makeTransmission(linkage, 6)});
  return stage;
}

inline StageSpec makeTerminal(std::mt19937& rng, const Model& model, const VectorXd& q) {
  StageSpec stage = makeStage(rng, model, q, {});
  stage.constraints = {};
  stage.costs.resize(3);
  return stage;
}

inline RobotProblem makeProblem(std::mt19937& rng, const Model& model, const VectorXd& q,
                                const std::vector<ContactTarget>& contacts, const Discretization& how) {
  std::vector<StageSpec> stages;
  stages.push_back(makeStage(rng, model, q, contacts, how.step));
  stages.push_back(makeTerminal(rng, model, q));
  return RobotProblem(model, q, VectorXd::Zero(model.nv()), std::move(stages), how.formulation);
}

}  // namespace bielle::testing
