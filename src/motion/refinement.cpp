#include "motion/refinement.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/rnea.h"
#include "math/largest.h"
#include "motion/applied_options.h"

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

struct StepError {
  double share = 0;        // of the largest acceleration
  Eigen::Index stage = 0;  // where it is largest
};

StepError findStepError(const Model& model, const MotionRecord& record) {
  StepError worst;
  if (!record.has_midpoints) return worst;
  Workspace ws(model);
  double largest = 0;
  for (Eigen::Index k = 0; k < record.a.rows(); ++k) {
    const double h = record.time[k + 1] - record.time[k];
    if (h == 0) continue;  // an impact
    updatePositions(model, ws, record.q_mid.row(k).transpose());
    updateMassMatrix(model, ws);
    const auto calcNorm = [&ws](const VectorXd& a) {
      return std::sqrt(getLarger(0, a.dot(ws.M.selfadjointView<Eigen::Lower>() * a)));
    };
    const VectorXd a = record.a.row(k);
    const double error = calcNorm((record.v.row(k + 1) - record.v.row(k)).transpose() / h - a);
    if (!(error <= worst.share) && !std::isnan(worst.share)) worst = {error, k};
    largest = getLarger(largest, calcNorm(a));
  }
  worst.share = largest == 0 ? 0 : worst.share / largest;
  return worst;
}

// Whether a linkage is near the margin that keeps it from its dead points, within two nodes of a stage.
bool isNearDeadPoint(const Motion& motion, const MotionRecord& record, Eigen::Index stage, double margin) {
  const Model& model = motion.problem->model();
  constexpr double kNear = 1.5;  // over the margin
  const Eigen::Index first = std::max<Eigen::Index>(0, stage - 2), last = std::min(record.q.rows(), stage + 4);
  for (const Linkage& linkage : listLinkages(model, motion.problem->initialState().head(model.nq())))
    for (Eigen::Index k = first; k < last; ++k) {
      const double value = calcTransmission(linkage, model, record.q.row(k).transpose());
      if (std::min(value, 1 / value) < kNear * margin) return true;
    }
  return false;
}

// The share of the transmission at the start that a linkage has kNearDeadPoint from the dead point that it comes nearer to around a
// node, the larger one of before and after; 0 if it starts and ends nearer, or never comes so near.
double findMargin(const Linkage& linkage, const Model& model, const MatrixXd& q, const VectorXd& shares,
                  Eigen::Index nearest) {
  const auto calcDistance = [&](Eigen::Index k) {
    return findDeadPoint(linkage, model, q.row(k).transpose()).distance;
  };
  const double least = calcDistance(nearest);
  double margin = 0;
  for (const int direction : {-1, 1}) {
    double last = least, distance = least;
    for (Eigen::Index k = nearest + direction; last < kNearDeadPoint && k >= 0 && k < q.rows(); k += direction) {
      distance = std::min(calcDistance(k), kFarthestDeadPoint);
      if (distance >= kNearDeadPoint) {
        const double part = (kNearDeadPoint - last) / (distance - last);
        margin = std::max(margin, shares[k - direction] + part * (shares[k] - shares[k - direction]));
      }
      last = distance;
    }
  }
  return margin;
}

// By linkage, the margins with which they would keep kNearDeadPoint from the dead points that they come nearer to.
std::map<std::string, double> findMargins(const Motion& motion, const MotionRecord& record) {
  const Model& model = motion.problem->model();
  constexpr double kReserve = 1.05;  // other ways to the dead point are shorter
  constexpr double kGrid = 0.05;     // the same optimum wherever a solve began, the same margin for mirror images
  std::map<std::string, double> margins;
  for (const Linkage& linkage : listLinkages(model, motion.problem->initialState().head(model.nq()))) {
    VectorXd shares(record.q.rows());
    for (Eigen::Index k = 0; k < shares.size(); ++k) {
      const double value = calcTransmission(linkage, model, record.q.row(k).transpose());
      shares[k] = std::min(value, 1 / value);
    }
    double margin = 0;
    for (Eigen::Index k = 1; k + 1 < shares.size(); ++k)
      if (shares[k] <= shares[k - 1] && shares[k] < shares[k + 1])
        margin = std::max(margin, findMargin(linkage, model, record.q, shares, k));
    const double needed = kReserve * margin;
    if (needed > 0 && needed < 1) margins[linkage.output] = std::min(std::ceil(needed / kGrid) * kGrid, 1 - kGrid);
  }
  return margins;
}

}  // namespace

double calcStepError(const Model& model, const MotionRecord& record) { return findStepError(model, record).share; }

double calcSoleMotion(const Motion& motion, const MotionRecord& record) {
  const Model& model = motion.problem->model();
  double reach = 0;  // of a corner, from the middle of the sole
  for (const ContactFrame& contact : model.contacts())
    reach = std::max(reach, std::hypot(contact.half_length, contact.half_width));
  const Slip slip = calcSlip(motion, makeTrack(model, record));
  return slip.position + reach * slip.angle;
}

double calcStageExcess(const Motion& motion, const MotionRecord& record) {
  if (!record.has_midpoints) return 0;
  return getLarger(calcStepError(motion.problem->model(), record) / kLargestStepError,
                   calcSoleMotion(motion, record) / kLargestSlip);
}

std::optional<RefinedMotion> refineStages(const Motion& solved, const MotionRecord& record) {
  const ProblemOptions& problem = solved.problem_options;
  MotionRequest request = *solved.request;
  if (problem.objective.objective == Objective::PeakTorque || problem.timings.areGiven()) return {};
  if (!request.options.find("time_step") || request.options.get<double>("time_step") != 0) return {};
  if (calcStageExcess(solved, record) <= 1) return {};
  request.options.set("time_step", solved.schedule.phases.front().dt / 2);
  RefinedMotion refined{makeMotion(solved.problem->model(), request, problem), {}};
  refined.start = makeStart(halveSteps(record), refined.motion);
  return refined;
}

std::optional<Motion> avoidDeadPoints(const Motion& solved, const MotionRecord& record) {
  const Model& model = solved.problem->model();
  ProblemOptions problem = solved.problem_options;
  double& margin = problem.limits.dead_point_margin;
  const bool widened = problem.limits.enforced && margin > 0 && margin < kWideDeadPointMargin;
  if (!widened || !solved.request->parts.empty()) return {};
  if (problem.objective.objective != Objective::Effort || problem.timings.areGiven()) return {};
  const StepError error = findStepError(model, record);
  if (error.share <= kLargestStepError || !isNearDeadPoint(solved, record, error.stage, margin)) return {};
  margin = kWideDeadPointMargin;
  return makeMotion(model, *solved.request, problem);
}

std::optional<RefinedMotion> keepFromDeadPoints(const Motion& solved, const MotionRecord& record) {
  const Model& model = solved.problem->model();
  ProblemOptions problem = solved.problem_options;
  LimitOptions& limits = problem.limits;
  if (!limits.enforced || limits.dead_point_margin < LimitOptions().dead_point_margin) return {};
  if (problem.objective.objective == Objective::PeakTorque || problem.timings.areGiven()) return {};
  bool larger = false;
  for (const auto& [linkage, needed] : findMargins(solved, record)) {
    if (needed <= getDeadPointMargin(limits, linkage)) continue;
    limits.dead_point_margins[linkage] = needed;
    larger = true;
  }
  if (!larger) return {};
  RefinedMotion apart{makeMotion(model, *solved.request, problem), {}};
  apart.start = makeStart(record, apart.motion);
  return apart;
}

}  // namespace bielle
