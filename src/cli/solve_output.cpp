#include "cli/solve_output.h"

#include <algorithm>
#include <cmath>
#include <iostream>
#include <optional>

#include "bielle/dynamics/linkage.h"
#include "bielle/ocp/robot_problem.h"
#include "bielle/solve/fddp.h"
#include "cli/free_timings.h"
#include "cli/table.h"
#include "model/number_text.h"

namespace bielle::cli {
namespace {

std::string formatConstraints(const FddpSummary& solver) {
  if (solver.penalty == 0) return "none";
  if (solver.violation == 0 && solver.multiplier == 0) return "satisfied, none active";
  const std::string violation = formatNumber(solver.violation, "%.1e");
  return (solver.violation > 0 ? "violated by at most " + violation : std::string("satisfied")) +
         ", largest multiplier " + formatNumber(solver.multiplier, "%.3g") + " after " +
         std::to_string(solver.multiplier_updates) + " updates";
}

// E.g. "35.2 J, cost of transport 0.81 (losses of 12 motors assumed: 0.25 W/(N m)^2)".
std::string formatEnergy(const ElectricalEnergy& energy) {
  std::string text = formatNumber(energy.total, "%.2f") + " J";
  if (std::isfinite(energy.cost_of_transport))
    text += ", cost of transport " + formatNumber(energy.cost_of_transport, "%.3f");
  if (energy.num_assumed > 0)
    text += " (losses of " + std::to_string(energy.num_assumed) +
            " motors assumed: " + formatNumber(kDefaultTorqueLoss) + " W/(N m)^2)";
  return text;
}

// Of linkages that come near one, rad or m.
std::string formatDeadPoints(const MotionResult& result) {
  std::string near;
  for (const DeadPointTrace& linkage : result.dead_points)
    if (linkage.getNearest().kind != DeadPointKind::None)
      near += (near.empty() ? "" : ", ") + linkage.output + " " + formatDistance(linkage.getNearest()) + " at " +
              formatNumber(result.record.time[linkage.getNearestNode()], "%.3g") + " s";
  return (near.empty() ? formatDistance({}) : near) + " (rad or m)";
}

std::string formatCycle(const MotionResult& result) {
  const VectorXd& cycle = result.record.cycle;
  const std::optional<double>& floquet = result.cycle->floquet_multiplier;
  // Of the base; x and y of a cycle that turns are about the world's origin.
  const Eigen::Vector2d base = result.record.q.row(0).head<2>().transpose(),
                        moved = Eigen::Rotation2Dd(cycle[3]) * base + cycle.segment<2>(1) - base;
  std::string text = formatNumber(cycle[0], "%.4g") + " s, moves by " + formatNumber(moved.x(), "%.3f") + ", " +
                     formatNumber(moved.y(), "%.3f") + " m";
  if (std::abs(cycle[3]) > 1e-9) text += ", turns by " + formatNumber(cycle[3], "%.3f") + " rad";
  return text + "; closes to " + formatNumber(result.cycle->closing_error, "%.1e") +
         (floquet ? ", largest Floquet multiplier " + formatNumber(*floquet, "%.3f") : "");
}

// Of a robot that has both kinds of motors, N m and N.
std::string makeTorqueLabel(const Model& model) {
  bool turning = false, sliding = false;
  for (const Motor& motor : model.motors())
    (model.joints()[motor.joint].kind == JointKind::Prismatic ? sliding : turning) = true;
  return !sliding ? "peak torques [N m]" : turning ? "peak torques [N m], forces [N]" : "peak forces [N]";
}

}  // namespace

void printSerialModel(const SerialModel& serial) {
  const auto join = [](const std::vector<std::string>& names) {
    std::string text;
    for (const std::string& name : names) text += (text.empty() ? "" : " ") + name;
    return text;
  };
  std::cout << "serial model: " << serial.frozen_joints.size() << " joints frozen, " << serial.dropped_closures.size()
            << " closures dropped\n";
  std::vector<Row> rows = {{"frozen", join(serial.frozen_joints)}, {"dropped", join(serial.dropped_closures)}};
  for (const SerialModel::Replacement& replacement : serial.replacements)
    rows.push_back({"motors", join(replacement.motors) + " -> " + join(replacement.joints)});
  if (!serial.dropped_targets.empty()) rows.push_back({"targets", join(serial.dropped_targets) + " (not used)"});
  printTable(std::cout, rows);
  std::cout << "\n";
}

void printPlan(const Motion& motion) {
  const RobotProblem& problem = *motion.problem;
  double end = 0;
  bool is_free = false;
  for (int k = 0; k < problem.numStages(); ++k) {
    const StageSpec& stage = problem.spec(k);
    if (stage.timing.phase >= 0) is_free = true;
    end += stage.dt * (stage.timing.phase >= 0 ? stage.timing.upper : 1);
  }
  std::cout << "planned: " << motion.schedule.phases.size() << " phases, " << problem.numStages() << " stages, "
            << formatNumber(end, "%.6g") << " s" << (is_free ? " at most" : "") << (motion.cycle ? ", a cycle" : "")
            << "\n";
}

void printResult(const Model& model, const MotionResult& result, const std::vector<std::string>& paths) {
  const FddpSummary& solver = result.solver;
  std::string torques;
  for (size_t i = 0; i < std::min<size_t>(4, result.peak_torques.size()); ++i)
    torques +=
        (i ? ", " : "") + result.peak_torques[i].first + " " + formatNumber(result.peak_torques[i].second, "%.2f");
  const auto pair = [](double position, double angle) {
    return formatNumber(position, "%.2e") + " m, " + formatNumber(angle, "%.2e") + " rad";
  };
  std::cout << "\n" << result.motion << " of " << result.run.robot << ": " << getName(solver.termination);
  if (!solver.message.empty()) std::cout << " (" << solver.message << ")";
  std::cout << "\n";
  std::vector<Row> rows;
  for (const GoalOutcome& outcome : result.goals) rows.push_back({outcome.goal.name, formatOutcome(outcome)});
  rows.insert(rows.end(), {{"cost", formatNumber(solver.cost, "%.6f")},
                           {"iterations", std::to_string(solver.iterations)},
                           {"time", formatNumber(solver.seconds, "%.2f") + " s"},
                           {"centre of mass", formatNumber(result.com_start, "%.4f") + " m high, lowest at " +
                                                  formatNumber(result.com_lowest, "%.4f") + " m"},
                           {"constraints", formatConstraints(solver)},
                           {"closure gap", pair(result.gap_position, result.gap_angle)},
                           {"contact slip", pair(result.slip_position, result.slip_angle)},
                           {makeTorqueLabel(model), torques},
                           {"electrical energy", formatEnergy(result.energy)}});
  if (!result.dead_points.empty()) rows.push_back({"dead points", formatDeadPoints(result)});
  if (result.cycle) rows.push_back({"cycle", formatCycle(result)});
  printTable(std::cout, rows);
  printTimings(result.timings);
  for (const std::string& path : paths) std::cout << "  " << path << "\n";
}

void warnOfGoalsAndDeadPoints(const MotionResult& result) {
  std::cout.flush();
  for (const DeadPointTrace& linkage : result.dead_points)
    if (const DeadPoint& nearest = linkage.getNearest(); nearest.distance < kNearDeadPoint)
      std::cerr << "bielle: warning: linkage of " << linkage.output << ": " << formatDistance(nearest)
                << " (rad, m) from a dead point at "
                << formatNumber(result.record.time[linkage.getNearestNode()], "%.3g")
                << " s, where motor and joint hardly move each other; request less motion towards it, or a larger "
                   "--dead-point-margin\n";
  for (const GoalOutcome& outcome : result.goals)
    if (!outcome.met()) std::cerr << "bielle: warning: " << outcome.goal.name << ": " << formatOutcome(outcome) << "\n";
}

}  // namespace bielle::cli
