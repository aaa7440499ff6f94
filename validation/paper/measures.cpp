#include "paper/measures.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/model/error.h"
#include "bielle/model/names.h"
#include "bielle/motion/lift.h"
#include "bielle/robots/robot_loader.h"
#include "dynamics/linkage_ratio.h"
#include "results/json_text.h"

namespace fs = std::filesystem;

namespace bielle::paper {
namespace {

constexpr const char* kCaseRemedy = "remove its directory to repeat the case";

// Nodes of the window.
std::pair<int, int> findWindow(Window window, const MotionSummary& summary, int nodes) {
  if (window == Window::Whole) return {0, nodes - 1};
  size_t most = 0;
  for (const MotionSummary::Phase& phase : summary.phases) most = std::max(most, phase.stances.size());
  std::vector<std::pair<int, int>> steps;  // first node in the air, first node on the ground again
  for (const MotionSummary::Phase& phase : summary.phases)
    if (phase.stances.size() < most) steps.emplace_back(phase.start_node, phase.start_node + phase.nodes);
  if (steps.size() < 5) return {0, nodes - 1};
  const std::pair<int, int> found(steps[2].first, steps[steps.size() - 3].second);
  if (found.first > found.second || found.second >= nodes)
    throw InputError(summary.file, "phases", "they are not as long as the trajectory", kCaseRemedy);
  return found;
}

Load calcPhaseLoad(const MotionRecord& record, const std::vector<std::string>& motors, int first, int last) {
  Load load;
  double sum = 0;
  int count = 0;
  for (const std::string& motor : motors) {
    const int column = findColumn(record.u_names, motor);
    for (int k = first; k < std::min<int>(last, record.u.rows()); ++k) {
      const double torque = std::abs(record.u(k, column));
      if (!std::isfinite(torque)) continue;
      load.peak = count ? std::max(load.peak, torque) : torque;
      sum += torque;
      ++count;
    }
  }
  if (count) load.mean = sum / count;
  return load;
}

// Numbers of summary.json that readSummary omits.
void readSolver(const std::string& file, Performance& out) {
  readJsonFile(file, kCaseRemedy, [&out](const Json& json) {
    out.iterations = json.value("iterations", 0);
    out.seconds = json.value("seconds", kMissing);
  });
}

void measure(const Study& study, const std::string& directory, const std::vector<std::string>& knee_motors,
             const std::vector<std::string>& ankle_motors, const std::string& knee, Performance& out) {
  out.record = readRecord(directory + "/trajectory.npz");
  out.summary = readSummary(directory);
  readSolver(out.summary->file, out);
  const MotionRecord& record = *out.record;
  std::tie(out.first_node, out.last_node) =
      findWindow(study.window, *out.summary, static_cast<int>(record.time.size()));
  out.knee = calcPhaseLoad(record, knee_motors, out.first_node, out.last_node);
  out.ankle = calcPhaseLoad(record, ankle_motors, out.first_node, out.last_node);
  const auto height = record.com.col(2);
  out.com_mean = height.segment(out.first_node, out.last_node - out.first_node + 1).mean();
  const double duration = record.time[out.last_node] - record.time[out.first_node];
  if (duration > 0) out.com_speed = (record.com(out.last_node, 0) - record.com(out.first_node, 0)) / duration;
  out.com_lowest = height.minCoeff();
  out.com_highest = height.maxCoeff();
  const auto angle = record.q.col(findColumn(record.q_names, knee));
  out.knee_least = angle.minCoeff();
  out.knee_most = angle.maxCoeff();
}

LiftFacts readLift(const std::string& directory, const Performance& lifted) {
  LiftFacts facts;
  const std::string file = directory + "/lift.json";
  if (!fs::exists(file)) return facts;
  readJsonFile(file, kCaseRemedy, [&](const Json& json) {
    if (!lifted.success) {
      facts.message = json.at("message");
      facts.joint = json.at("joint");
      facts.at_linkage = json.at("status") != getName(NumericalStatus::Inaccurate);
    }
    for (const Json& node : json.at("nodes")) facts.margin = std::fmin(facts.margin, node.at("margin").get<double>());
  });
  if (lifted.record) facts.until = lifted.record->time[lifted.record->time.size() - 1];
  return facts;
}

// Reads the results of a run of the command; `step` is its position in the case.
Performance readPerformance(const Study& study, const CaseOutcome& outcome, size_t step, const std::string& directory,
                            const std::vector<std::string>& knee_motors, const std::vector<std::string>& ankle_motors,
                            const ComparedRobot& robot) {
  const bool lift = step > 0;
  Performance result;
  if (outcome.steps.size() <= step || !outcome.complete) {
    result.outcome = outcome.steps.empty() || outcome.complete ? "not done" : "failed";
    return result;
  }
  const StepOutcome& run = outcome.steps[step];
  result.success = run.status == 0;
  result.outcome = run.status >= 2   ? "refused: " + run.error
                   : run.status == 1 ? (lift ? "lift failed" : "not converged")
                                     : (lift ? "lifted" : "converged");
  if (fs::exists(directory + "/summary.json"))
    measure(study, directory, knee_motors, ankle_motors, robot.joints.knees[0], result);
  if (lift) result.lift = readLift(directory, result);
  return result;
}

}  // namespace

ComparedRobot loadComparedRobot(const std::string& name) {
  ComparedRobot compared{loadRobot(name), {}, {}, {}};
  const Model& model = compared.robot.model;
  const VectorXd q = findClosedConfiguration(model).q;
  const auto findMotors = [&](const std::vector<std::string>& joints, std::vector<std::string>& motors) {
    for (const std::string& joint : joints) {
      const Linkage linkage = makeLinkage(model, q, {joint});
      motors.insert(motors.end(), linkage.motor_names.begin(), linkage.motor_names.end());
    }
  };
  findMotors(compared.joints.knees, compared.knee_motors);
  findMotors(compared.joints.ankles, compared.ankle_motors);
  return compared;
}

Comparison readComparison(const Study& study, double value, const ComparedRobot& robot, const std::string& cases,
                          const CaseOutcome& closed, const CaseOutcome& serial) {
  Comparison comparison;
  comparison.value = value;
  const std::string closed_path = cases + "/" + makeClosedCase(study, value, "").name + "/";
  const std::string serial_path = cases + "/" + makeSerialCase(study, value, "").name + "/";
  comparison.closed =
      readPerformance(study, closed, 0, closed_path + kClosed, robot.knee_motors, robot.ankle_motors, robot);
  comparison.serial =
      readPerformance(study, serial, 0, serial_path + kSerial, robot.joints.knees, robot.joints.ankles, robot);
  comparison.lifted =
      readPerformance(study, serial, 1, serial_path + kLifted, robot.knee_motors, robot.ankle_motors, robot);
  comparison.stepped =
      readPerformance(study, serial, 2, serial_path + kStepped, robot.knee_motors, robot.ankle_motors, robot);
  return comparison;
}

std::vector<RowMatrixXd> calcFeet(const Model& model, const MotionRecord& record) {
  std::vector<RowMatrixXd> feet(model.contacts().size(), RowMatrixXd(record.q.rows(), 3));
  Workspace workspace(model);
  for (int k = 0; k < record.q.rows(); ++k) {
    updatePlacements(model, workspace, record.q.row(k).transpose());
    for (size_t i = 0; i < feet.size(); ++i) {
      const ContactFrame& contact = model.contacts()[i];
      feet[i].row(k) = getPlacement(workspace, contact.body, contact.X_BF).p.transpose();
    }
  }
  return feet;
}

}  // namespace bielle::paper
