#include "loops/dynamics_time.h"

#include <functional>
#include <limits>
#include <memory>
#include <vector>

#include "bielle/dynamics/constrained.h"
#include "bielle/model/error.h"
#include "bielle/ocp/robot_problem.h"
#include "dynamics/loop_conflict.h"
#include "loops/processor_clock.h"

namespace bielle::loops {
namespace {

constexpr int kRuns = 10;
constexpr int kStages = 4;  // as `bielle bench` has them: several nodes are linearized at once

// Seconds of one call.
double calcLeastTime(double duration, const std::function<void()>& call) {
  call();
  double least = std::numeric_limits<double>::infinity();
  for (int run = 0; run < kRuns; ++run) {
    const double start = readProcessorClock();
    double time = 0;
    int calls = 0;
    for (; time < duration || calls == 0; time = readProcessorClock() - start, ++calls) call();
    least = std::min(least, time / calls);
  }
  return least;
}

}  // namespace

DynamicsTimes measureDynamics(const Model& model, double duration) {
  const AssemblyResult closed = findClosedConfiguration(model);
  if (closed.status != NumericalStatus::Ok) throw makeClosingError(model, model.name(), closed);
  const VectorXd v = VectorXd::Zero(model.nv()), u = VectorXd::Zero(model.nu());
  const ConstraintSet loops = makeConstraintSet(model);
  DynamicsTimes times;
  times.mobility = calcMobility(model, closed.q).mobility;

  Workspace ws(model);
  ConstrainedWorkspace cws;
  const auto accelerate = [&] { updateConstrainedDynamics(model, ws, cws, loops, closed.q, v, v); };
  times.accelerations = calcLeastTime(duration, accelerate);
  times.derivatives = calcLeastTime(duration, [&] {
    accelerate();
    updateConstrainedDerivatives(model, ws, cws, loops);
  });

  std::vector<StageSpec> stages(kStages + 1);
  for (StageSpec& stage : stages) {
    stage.dt = 1e-3;
    stage.constraints = loops;
  }
  const RobotProblem problem(model, closed.q, v, std::move(stages));
  const auto scratch = problem.makeScratch();
  std::vector<std::unique_ptr<NodeEvaluation>> nodes;
  std::vector<StageModel> models(kStages + 1);
  for (int k = 0; k <= kStages; ++k) {
    nodes.push_back(problem.makeEvaluation());
    models[k].resize(problem.tangentSize(k), k < kStages ? problem.controlSize(k) : 0,
                     k < kStages ? problem.tangentSize(k + 1) : 0);
  }
  const auto step = [&] {
    for (int k = 0; k <= kStages; ++k) {
      EvaluateTask task{k, k > 0 ? &nodes[k - 1]->x_next : &problem.initialState(), k < kStages ? &u : nullptr,
                        k > 0 ? nodes[k - 1].get() : nullptr, nodes[k].get()};
      problem.evaluate(&task, 1, scratch.get());
    }
  };
  const auto linearize = [&] {
    step();
    std::vector<LinearizeTask> tasks(kStages + 1);
    for (int k = 0; k <= kStages; ++k) {
      tasks[k].node = k;
      tasks[k].at = nodes[k].get();
      tasks[k].next = k < kStages ? nodes[k + 1].get() : nullptr;
      tasks[k].out = &models[k];
    }
    problem.linearize(tasks.data(), kStages + 1, scratch.get());
  };
  times.step = calcLeastTime(duration, step) / kStages;
  times.linearization = calcLeastTime(duration, linearize) / kStages;
  return times;
}

}  // namespace bielle::loops
