#include "simulation/simulate_output.h"

#include <cstdio>
#include <filesystem>
#include <iostream>
#include <nlohmann/json.hpp>

#include "bielle/report/report.h"
#include "io/npz.h"
#include "io/text_file.h"
#include "model/text_file.h"
#include "simulation/planned_record.h"

namespace bielle::simulation {
namespace {

// A motion that happened, in the form of a solved one.
MotionResult makeResult(const SimulateArguments& arguments, const Plan& plan, const Ground& ground,
                        const Execution& execution, const std::vector<std::string>& command) {
  MotionResult result;
  result.run = {plan.summary.robot, plan.robot.file, command};
  result.motion = plan.summary.motion;
  result.formulation = plan.summary.formulation;
  result.options = plan.summary.options;
  const int stages = static_cast<int>(execution.record.u.rows());
  result.schedule.phases.push_back({"simulated", stages, arguments.execution.record_period, {}});
  result.ground = ground;
  result.solver.termination =
      execution.outcome == Outcome::Stood ? FddpTermination::Converged : FddpTermination::Failed;
  result.solver.message = std::string("executed: it ") + getName(execution.outcome);
  result.record = execution.record;
  result.objective = plan.summary.objective;
  setFigures(plan.robot.model, result);
  result.gap_position = execution.largest_gap;  // also between the rows of the record
  result.slip_position = execution.largest_slip;
  return result;
}

nlohmann::ordered_json listBooks(const Execution& e) {
  return {{"energy_start_J", e.start.getEnergy()}, {"energy_end_J", e.end.getEnergy()},
          {"motor_work_J", e.end.motor_work},      {"push_work_J", e.end.push_work},
          {"contact_loss_J", e.end.contact_loss},  {"stop_loss_J", e.end.stop_loss},
          {"other_loss_J", e.end.other_loss},      {"imbalance_J", e.imbalance}};
}

// The drift of a robot that went nowhere is no share of its way.
nlohmann::ordered_json listEstimation(const EstimationErrors& e) {
  constexpr double kShortestWay = 0.1;  // m
  const nlohmann::ordered_json share = e.way > kShortestWay ? nlohmann::ordered_json(e.drift / e.way) : nullptr;
  return {{"position_error", {{"rms", e.position_rms}, {"max", e.position_max}}},
          {"velocity_error", {{"rms", e.velocity_rms}, {"max", e.velocity_max}}},
          {"tilt_error", {{"rms", e.tilt_rms}, {"max", e.tilt_max}}},
          {"drift", e.drift},
          {"drift_share", share},
          {"contact_errors", e.contact_errors}};
}

nlohmann::ordered_json listSolves(const PredictiveCounts& counts) {
  return {{"count", counts.solves},
          {"missed", counts.missed},
          {"failed", counts.failed},
          {"early_landings", counts.early},
          {"late_landings", counts.late},
          {"median_ms", 1e3 * counts.calcQuantile(0.5)},
          {"p99_ms", 1e3 * counts.calcQuantile(0.99)},
          {"worst_ms", 1e3 * counts.calcQuantile(1)}};
}

nlohmann::ordered_json listCommands(const std::vector<TimedCommand>& commands) {
  auto list = nlohmann::ordered_json::array();
  for (const auto& [time, velocity] : commands)
    list.push_back({{"time_s", time},
                    {"forward", velocity.forward},
                    {"sideways", velocity.sideways},
                    {"turning", velocity.turning}});
  return list;
}

nlohmann::ordered_json listPushes(const std::vector<Push>& pushes) {
  auto list = nlohmann::ordered_json::array();
  for (const Push& push : pushes)
    list.push_back({{"time_s", push.time},
                    {"impulse_Ns", push.impulse},
                    {"direction_deg", push.direction},
                    {"duration_s", push.duration}});
  return list;
}

// Adds what happened to the summary of the result.
void extendSummary(const std::string& path, const SimulateArguments& arguments, const Plan& plan, const Execution& e) {
  auto summary = nlohmann::ordered_json::parse(readTextFile(path));
  summary["world"] = arguments.world;
  summary["control"] = arguments.control;
  summary["believed_model"] = getName(plan.belief);
  if (plan.belief != Belief::Closed)
    summary["plan_reachable_until"] =
        plan.reference.first_missed < 0 ? nullptr : nlohmann::ordered_json(plan.reference.first_missed);
  if (plan.predictive) summary["solves"] = listSolves(plan.predictive->getCounts());
  for (const auto& [name, value] : plan.summary.options)
    if (name == "speed") summary["commanded_speed"] = value;
  if (!plan.commands.empty()) {
    summary["commanded_speed"] = calcMeanSpeed(plan.commands, e.duration);
    summary["commands"] = listCommands(plan.commands);
  }
  summary["terrain"] = arguments.terrain;
  summary["sensors"] = arguments.sensors;
  if (arguments.sensors == "real") {
    summary["noise"] = arguments.noise;
    summary["estimator"] = listEstimation(e.estimation);
  }
  summary["robot_errors"] = {{"mass", arguments.errors.mass}, {"rod_m", arguments.errors.rod}};
  summary["delay"] = {{"mean_ms", arguments.delay}, {"jitter_ms", arguments.jitter}};
  summary["seed"] = arguments.seed;
  summary["pushes"] = listPushes(arguments.execution.pushes);
  summary["gain_iterations"] = plan.iterations;
  summary["outcome"] = getName(e.outcome);
  summary["outcome_message"] = e.message;
  summary["fell"] = e.outcome == Outcome::Fell;
  summary["fall_time"] = e.outcome == Outcome::Fell ? nlohmann::ordered_json(e.duration) : nullptr;
  summary["duration"] = e.duration;
  summary["distance"] = e.distance;
  summary["mean_speed"] = e.getMeanSpeed();
  summary["largest_deviation"] = e.largest_deviation;
  summary["largest_gap"] = e.largest_gap;
  summary["largest_joint_deviation"] = e.largest_joint_deviation;
  summary["largest_slip"] = e.largest_slip;
  summary["energy_balance"] = e.energy_balance;
  summary["books"] = listBooks(e);
  summary["saturated_share"] = e.saturated_share;
  summary["real_time_factor"] = e.real_time_factor;
  if (arguments.execution.real_time) summary["largest_lag_ms"] = 1e3 * e.largest_lag;
  writeTextFile(path, summary.dump(2) + "\n");
}

}  // namespace

void print(const SimulateArguments& arguments, const Plan& plan, const Execution& e) {
  std::cout << plan.summary.motion << " of " << plan.summary.robot << " in world " << arguments.world << ", control "
            << arguments.control;
  if (plan.belief != Belief::Closed) std::cout << " with model " << getName(plan.belief);
  std::cout << ": it " << getName(e.outcome);
  if (!e.message.empty()) std::cout << " (" << e.message << ")";
  char text[600];
  std::snprintf(text, sizeof text,
                "\n"
                "  duration            %.3f s\n"
                "  distance            %.3f m, %.3f m/s\n"
                "  trunk deviation     %.4f m at most\n"
                "  closures            gap %.1e m at most\n"
                "  soles               slip %.1e m at most\n"
                "  energy balance      %.1e J, %.1e of the energy exchanged\n"
                "  torques             %.2f %% saturated\n"
                "  speed               %.2g times real time\n",
                e.duration, e.distance, e.getMeanSpeed(), e.largest_deviation, e.largest_gap, e.largest_slip,
                e.imbalance, e.energy_balance, 100 * e.saturated_share, e.real_time_factor);
  std::cout << text;
  if (plan.reference.first_missed >= 0)
    std::cout << "  the linkages cannot follow the plan from " << plan.reference.first_missed
              << " s on: " << plan.reference.message << "\n";
  if (plan.predictive) {
    const PredictiveCounts& c = plan.predictive->getCounts();
    std::snprintf(text, sizeof text,
                  "  solves              %d, %d failed; median %.1f ms, 99 %% %.1f ms, worst %.1f ms\n"
                  "                      %d stages began without a new policy%s\n",
                  c.solves, c.failed, 1e3 * c.calcQuantile(0.5), 1e3 * c.calcQuantile(0.99), 1e3 * c.calcQuantile(1),
                  c.missed, arguments.execution.real_time ? "" : " (if run in real time)");
    std::cout << text;
  }
  if (arguments.sensors != "real") return;
  const EstimationErrors& s = e.estimation;
  std::snprintf(text, sizeof text,
                "  estimated trunk     rms error %.4f m, %.4f m/s, tilt %.4f rad\n"
                "  drift               %.4f m of %.3f m\n"
                "  contacts            wrong for %.2f %% of the time\n",
                s.position_rms, s.velocity_rms, s.tilt_rms, s.drift, s.way, 100 * s.contact_errors);
  std::cout << text;
}

std::vector<std::string> write(const SimulateArguments& arguments, const Plan& plan, const Ground& ground,
                               const Execution& execution, const std::vector<std::string>& command) {
  const MotionResult result = makeResult(arguments, plan, ground, execution, command);
  const std::filesystem::path output = arguments.output;
  const std::string summary = (output / "summary.json").string();
  if (arguments.summary_only) {
    writeSummary(arguments.output, result);
    extendSummary(summary, arguments, plan, execution);
    return {summary};
  }
  std::vector<std::string> paths = writeResult(arguments.output, result);
  extendSummary(summary, arguments, plan, execution);
  paths.push_back((output / "plan.npz").string());
  writeNpz(paths.back(), makePlannedRecord(plan.robot.model, plan.getReference(), execution.record));
  if (!arguments.no_report) {
    paths.push_back((output / "report.html").string());
    writeReport(paths.back(), {arguments.output});
  }
  return paths;
}

}  // namespace bielle::simulation
