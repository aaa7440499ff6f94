// Numbers of a comparison of robots, from the files of its cases.
#include <algorithm>
#include <cmath>
#include <filesystem>

#include "bielle/model/names.h"
#include "bielle/results/result.h"
#include "results/json_text.h"
#include "tasks/architecture_report.h"
#include "tasks/cells.h"

namespace fs = std::filesystem;

namespace bielle::tasks {
namespace {

constexpr const char* kRemedy = "remove its directory to repeat the case";
constexpr double kLeastDistance = 0.2;  // m, for a cost of transport

// Speeds in the middle of steps where there are such, as in the energies of a result.
MotorTrace readTrace(const MotionRecord& record) {
  MotorTrace trace;
  const RowMatrixXd& velocities = record.has_midpoints ? record.v_mid : record.v;
  const Eigen::Index stages = record.u.rows();
  trace.torque = trace.speed = MatrixXd::Zero(record.u.cols(), stages);
  for (Eigen::Index k = 0; k < stages; ++k) {
    trace.time.push_back(record.time[k]);
    trace.dt.push_back(record.time[k + 1] - record.time[k]);
    if (trace.dt.back() > 0) trace.torque.col(k) = record.u.row(k).transpose();
  }
  for (size_t m = 0; m < record.u_names.size(); ++m)
    trace.speed.row(static_cast<Eigen::Index>(m)) =
        velocities.col(findColumn(record.v_names, record.u_names[m])).head(stages).transpose();
  return trace;
}

// Motors belong to the first group with a word of their names; all are in the last one.
std::vector<std::vector<int>> groupMotors(const std::vector<MotorGroup>& groups,
                                          const std::vector<std::string>& motors) {
  std::vector<std::vector<int>> members(groups.size());
  for (size_t m = 0; m < motors.size(); ++m) {
    members.back().push_back(static_cast<int>(m));
    for (size_t g = 0; g + 1 < groups.size(); ++g) {
      const auto fits = [&](const std::string& word) { return motors[m].find(word) != std::string::npos; };
      if (std::none_of(groups[g].words.begin(), groups[g].words.end(), fits)) continue;
      members[g].push_back(static_cast<int>(m));
      break;
    }
  }
  return members;
}

GroupLoad calcLoad(const std::vector<int>& members, const std::vector<MotorMeasures>& motors) {
  GroupLoad load;
  double squares = 0;
  for (const int m : members) {
    load.peak = std::max(load.peak, motors[m].peak_torque);
    load.speed = std::max(load.speed, motors[m].peak_speed);
    squares += motors[m].rms_torque * motors[m].rms_torque;
  }
  if (!members.empty()) load.rms = std::sqrt(squares / static_cast<double>(members.size()));
  return load;
}

void measure(const ArchitectureSpec& spec, const Contender& contender, const MotionRecord& record, Feat& out) {
  out.exists = true;
  out.trace = readTrace(record);
  const Model& model = contender.robot.model;
  const std::vector<MotorMeasures> motors = calcMotorMeasures(out.trace, makeDrives(model, spec.drives));
  for (const std::vector<int>& members : groupMotors(spec.groups, record.u_names))
    out.groups.push_back(calcLoad(members, motors));
  for (const MotorMeasures& motor : motors) {
    out.energy += motor.energy;
    out.electrical_energy += motor.electrical_energy;
  }
  out.peak_power = out.trace.torque.cwiseProduct(out.trace.speed).colwise().sum().maxCoeff();
  const Eigen::Index last = record.com.rows() - 1;
  out.com_start = record.com(0, 2);
  out.com_lowest = record.com.col(2).minCoeff();
  out.com_highest = record.com.col(2).maxCoeff();
  for (Eigen::Index k = 0; k <= last; ++k) out.com_height.emplace_back(record.time[k], record.com(k, 2));
  out.distance = (record.com.row(last).head<2>() - record.com.row(0).head<2>()).norm();
  out.duration = record.time[last] - record.time[0];
  out.cost_of_transport = out.distance < kLeastDistance
                              ? kMissing
                              : out.electrical_energy / (model.mass() * model.gravity().norm() * out.distance);
}

// The first goal that is missed, or an empty text.
std::string findMissedGoal(const std::vector<GoalOutcome>& goals) {
  for (const GoalOutcome& goal : goals)
    if (!goal.met()) return goal.goal.name + ": " + formatOutcome(goal);
  return "";
}

// The first row of the check that fails, or an empty text.
std::string findFailure(const std::string& file) {
  std::string failure;
  readJsonFile(file, kRemedy, [&failure](const Json& json) {
    if (json.at("pass").get<bool>()) return;
    failure = "check failed";
    for (const Json& row : json.at("rows"))
      if (!row.at("pass").get<bool>()) {
        failure = row.at("name").get<std::string>();
        return;
      }
  });
  return failure;
}

}  // namespace

Feat readFeat(const ArchitectureSpec& spec, const Contender& contender, const std::string& directory,
              const CaseOutcome& outcome) {
  Feat feat;
  if (!outcome.complete || outcome.steps.empty()) {
    feat.outcome = "failed";
    return feat;
  }
  if (outcome.steps[0].status >= 2) {
    feat.outcome = "refused: " + outcome.steps[0].error;
    return feat;
  }
  measure(spec, contender, readRecord(directory + "/trajectory.npz"), feat);
  const MotionSummary summary = readSummary(directory);
  readJsonFile(summary.file, kRemedy, [&feat](const Json& json) { feat.iterations = json.value("iterations", 0); });
  const std::string check = directory + "/check.json";
  const bool is_checked = fs::exists(check);
  std::string failure = findMissedGoal(summary.goals);
  if (failure.empty() && is_checked) failure = findFailure(check);
  feat.done = summary.converged && failure.empty();
  feat.outcome = !summary.converged ? "not converged"
                 : !failure.empty() ? failure
                                    : (is_checked ? "passed" : "converged, not checked");
  return feat;
}

}  // namespace bielle::tasks
