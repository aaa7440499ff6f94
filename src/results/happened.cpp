#include "bielle/results/happened.h"

#include <limits>
#include <stdexcept>

#include "bielle/dynamics/kinematics.h"
#include "bielle/model/names.h"
#include "dynamics/largest_gaps.h"
#include "motion/record_tables.h"
#include "results/happened_summary.h"
#include "results/result_files.h"

namespace bielle {
namespace {

void requireTable(const RowMatrixXd& x, Eigen::Index rows, Eigen::Index columns, const char* name) {
  if (x.rows() != rows || x.cols() != columns)
    throw std::invalid_argument("happened: " + std::string(name) + " is " + std::to_string(x.rows()) + " x " +
                                std::to_string(x.cols()) + "; give " + std::to_string(rows) + " x " +
                                std::to_string(columns));
  if (!x.allFinite())
    throw std::invalid_argument("happened: " + std::string(name) + " has a number that is not finite");
}

MotionRecord makeRecord(const Model& model, const HappenedMotion& motion) {
  const Eigen::Index nodes = motion.time.size(), stages = nodes - 1;
  if (stages < 1)
    throw std::invalid_argument("happened: there are " + std::to_string(nodes) + " nodes; give two or more");
  for (Eigen::Index k = 0; k < stages; ++k)
    if (!(motion.time[k + 1] > motion.time[k])) throw std::invalid_argument("happened: time does not ascend");
  requireTable(motion.q, nodes, model.nq(), "q");
  requireTable(motion.v, nodes, model.nv(), "v");
  requireTable(motion.u, stages, model.nu(), "u");
  MotionRecord record;
  startRecord(model, static_cast<int>(stages), record);
  record.time = motion.time;
  record.q = motion.q;
  record.v = motion.v;
  record.u = motion.u;
  constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  record.closure_wrenches.setConstant(kUnknown);
  if (motion.contact_wrenches.size() > 0) {
    requireTable(motion.contact_wrenches, stages, record.contact_wrenches.cols(), "contact_wrenches");
    record.contact_wrenches = motion.contact_wrenches;
  } else {
    record.contact_wrenches.setConstant(kUnknown);
  }
  Workspace ws(model);
  for (Eigen::Index k = 0; k < nodes; ++k) {
    updatePositions(model, ws, record.q.row(k).transpose());
    record.com.row(k) = calcCom(model, ws);
    const ClosureGap gap = calcLargestGaps(model, ws);
    record.gap.row(k) << gap.position, gap.angle;
    if (k < stages) record.a.row(k) = (record.v.row(k + 1) - record.v.row(k)) / (record.time[k + 1] - record.time[k]);
  }
  return record;
}

// The largest distance of a foot along the ground from where it touched down, as long as it touches, m.
double calcSlip(const Model& model, const MotionRecord& record) {
  double slip = 0;
  Workspace ws(model);
  std::vector<Vector3d> touchdowns(model.contacts().size());
  std::vector<char> touched(touchdowns.size(), 0);
  for (Eigen::Index k = 0; k < record.u.rows(); ++k) {
    updatePlacements(model, ws, record.q.row(k).transpose());
    for (size_t c = 0; c < touchdowns.size(); ++c) {
      const auto wrench = record.contact_wrenches.row(k).segment<6>(6 * static_cast<Eigen::Index>(c));
      const bool touches = wrench.squaredNorm() > 0;  // not if it is not known
      const Vector3d place = getPlacement(ws, model.contacts()[c].body, model.contacts()[c].X_BF).p;
      if (touches && !touched[c]) touchdowns[c] = place;
      touched[c] = touches;
      if (touches) slip = std::max(slip, (place - touchdowns[c]).head<2>().norm());
    }
  }
  return slip;
}

}  // namespace

Json makeHappenedSummary(const MotionResult& result) {
  Json summary = makeSummary(result);
  for (const char* of_solving :
       {"formulation", "step", "converged", "interrupted", "termination", "message", "acceptable", "cost", "iterations",
        "seconds", "solver_gap", "constraints", "free_timings", "log_columns", "log"})
    summary.erase(of_solving);
  if (result.goals.empty()) summary.erase("goals");
  return summary;
}

std::vector<std::string> writeHappened(const std::string& directory, const std::string& name, const LoadedRobot& robot,
                                       const HappenedMotion& motion) {
  MotionResult result;
  result.run = makeRunInfo(name, robot);
  result.motion = motion.motion;
  result.ground = motion.ground;
  result.record = makeRecord(robot.model, motion);
  result.schedule.phases.push_back(
      {"recorded", static_cast<int>(result.record.u.rows()), result.record.time[1] - result.record.time[0], {}});
  setFigures(robot.model, result);
  result.slip_position = calcSlip(robot.model, result.record);
  Json summary = makeHappenedSummary(result);
  Json facts;
  try {
    facts = parseJson(motion.facts);
  } catch (const std::exception& error) {
    throw std::invalid_argument(std::string("happened: facts: ") + describeJsonError(error));
  }
  if (!facts.is_object()) throw std::invalid_argument("happened: facts are no JSON object");
  const double duration = result.record.time[result.record.time.size() - 1] - result.record.time[0];
  summary["world"] = "unknown";
  summary["outcome"] = "ended";
  summary["outcome_message"] = "";
  summary["duration"] = duration;
  summary.update(facts);
  return writeResult(directory, result.record, result.run.mechanism, summary);
}

}  // namespace bielle
