#include "bielle/io/refinement.h"

#include <algorithm>
#include <cmath>

#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/rnea.h"
#include "bielle/io/result.h"

namespace bielle {
namespace {

// States at the nodes and in the middle of the steps between them.
MotionRecord halveSteps(const MotionRecord& record) {
  const Eigen::Index stages = record.u.rows();
  MotionRecord out = record;
  out.q.resize(2 * stages + 1, record.q.cols());
  out.v.resize(2 * stages + 1, record.v.cols());
  out.u.resize(2 * stages, record.u.cols());
  for (Eigen::Index k = 0; k < stages; ++k) {
    out.q.middleRows<2>(2 * k) << record.q.row(k), record.q_mid.row(k);
    out.v.middleRows<2>(2 * k) << record.v.row(k), record.v_mid.row(k);
    out.u.middleRows<2>(2 * k).rowwise() = record.u.row(k);
  }
  out.q.row(2 * stages) = record.q.row(stages);
  out.v.row(2 * stages) = record.v.row(stages);
  return out;
}

}  // namespace

double calcStepError(const Model& model, const MotionRecord& record) {
  if (!record.has_midpoints) return 0;
  Workspace ws(model);
  double error = 0, largest = 0;
  for (Eigen::Index k = 0; k < record.a.rows(); ++k) {
    const double h = record.time[k + 1] - record.time[k];
    if (h == 0) continue;  // an impact
    updatePositions(model, ws, record.q_mid.row(k).transpose());
    updateMassMatrix(model, ws);
    const auto calcNorm = [&ws](const VectorXd& a) {
      return std::sqrt(std::max(0.0, a.dot(ws.M.selfadjointView<Eigen::Lower>() * a)));
    };
    const VectorXd a = record.a.row(k);
    error = std::max(error, calcNorm((record.v.row(k + 1) - record.v.row(k)).transpose() / h - a));
    largest = std::max(largest, calcNorm(a));
  }
  return largest > 0 ? error / largest : 0;
}

std::optional<Motion> refineStages(const MotionRequest& request, const Model& model, const ProblemOptions& problem,
                                   const Motion& solved, const MotionRecord& record) {
  if (problem.objective.objective != Objective::Effort || problem.timings.areGiven()) return {};
  const auto step = std::find_if(request.options.begin(), request.options.end(),
                                 [](const OptionEntry& option) { return option.name == "time_step"; });
  if (step == request.options.end() || *step->value != 0) return {};
  if (calcStepError(model, record) <= kLargestStepError) return {};
  *step->value = solved.schedule.phases.front().dt / 2;
  Motion motion = makeRequested(request, model, problem);
  setGuess(halveSteps(record), motion);
  return motion;
}

}  // namespace bielle
