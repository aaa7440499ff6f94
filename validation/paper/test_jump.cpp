// The paper's jump.
#include "measure_jump.h"
#include "own_robots.h"
#include "paper/jump.h"
#include "solve_in_place.h"

using namespace bielle;
using namespace bielle::testing;

TEST_CASE("the paper's jump has a solution, which flies as a stone") {
  const Model& model = getBipetto();
  const VectorXd q0 = makeStandingPosture(model);
  paper::JumpOptions options;
  CHECK(paper::makeJump(model, options, q0).problem->numStages() == 4 * 10 + 26);
  options.flight = 0.3;  // in its own 0.39 s the push goes through the knee's dead point
  Motion motion = paper::makeJump(model, options, q0);
  FddpOptions solver;
  solver.max_iterations = 100;
  const FddpSummary summary = test::solveInPlace(*motion.problem, motion.guess, solver);
  const JumpOutcome out = measureJump(motion);
  CAPTURE(summary.message, summary.iterations);
  CHECK(summary.termination == FddpTermination::Converged);
  CHECK(out.stone < 1e-2);
  CHECK(out.rise == Approx(9.81 * 0.3 * 0.3 / 8).epsilon(0.05));
  CHECK(out.knee_lowest > 0);
  CHECK(out.tilt < 0.2);
}
