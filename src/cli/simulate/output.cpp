#include "cli/simulate/output.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>

#include "bielle/report/report.h"
#include "math/quantile.h"
#include "model/number_text.h"
#include "results/npz.h"
#include "results/result_files.h"
#include "worlds/carried_goals.h"
#include "worlds/planned_record.h"

namespace bielle::worlds {
namespace {

// A motion that happened, in the form of a solved one.
MotionResult makeResult(const CarriedOut& carried, const Execution& execution) {
  const Plan& plan = carried.plan;
  MotionResult result;
  const std::string& other = carried.arguments.world_robot;
  result.run = makeRunInfo(other.empty() ? plan.summary.run.robot : other, carried.robot, carried.command);
  result.motion = plan.summary.motion;
  result.formulation = plan.summary.formulation;
  result.options = plan.summary.options;
  const int stages = static_cast<int>(execution.record.u.rows());
  result.schedule.phases.push_back({"simulated", stages, carried.arguments.execution.record_period, {}});
  result.ground = carried.ground;
  result.record = execution.record;
  result.objective = plan.summary.objective;
  setFigures(carried.robot.model, result);
  result.goals = measureCarriedGoals(plan, carried.controller.goals, execution.record);
  result.gap_position = execution.largest_gap;  // also between the rows of the record
  result.slip_position = execution.largest_slip;
  result.slip_angle = execution.largest_tilt.value;
  return result;
}

// The drift of a robot that went nowhere is no share of its way.
Json listEstimation(const EstimationErrors& e) {
  constexpr double kShortestWay = 0.1;  // m
  const Json share = e.way > kShortestWay ? Json(e.drift / e.way) : nullptr;
  return {{"position_error", {{"rms", e.position_rms}, {"max", e.position_max}}},
          {"velocity_error", {{"rms", e.velocity_rms}, {"max", e.velocity_max}}},
          {"tilt_error", {{"rms", e.tilt_rms}, {"max", e.tilt_max}}},
          {"drift", e.drift},
          {"drift_share", share},
          {"contact_errors", e.contact_errors}};
}

const std::pair<const char*, double PredictiveSolve::*> kParts[] = {
    {"prepare", &PredictiveSolve::prepare},   {"predict", &PredictiveSolve::predict},
    {"evaluate", &PredictiveSolve::evaluate}, {"linearize", &PredictiveSolve::linearize},
    {"sweep", &PredictiveSolve::sweep},       {"rollout", &PredictiveSolve::rollout},
    {"policy", &PredictiveSolve::policy}};

// Medians, and what 1 % exceed.
Json listParts(const PredictiveCounts& counts) {
  Json parts;
  for (const auto& [name, part] : kParts)
    parts[name] = {{"median_ms", 1e3 * counts.calcQuantile(0.5, part)},
                   {"p99_ms", 1e3 * counts.calcQuantile(0.99, part)}};
  return parts;
}

// Of times, ms.
struct Quantiles {
  double median = 0, p99 = 0, worst = 0;
};
Quantiles calcUpdateTimes(const Execution& e) {
  const std::vector<double>& times = e.update_seconds;
  return {1e3 * calcQuantile(times, 0.5), 1e3 * calcQuantile(times, 0.99), 1e3 * calcQuantile(times, 1)};
}
Quantiles calcPolicyLatencies(const PredictiveCounts& counts) {
  constexpr auto kLatency = &PredictiveSolve::latency;
  return {1e3 * counts.calcQuantile(0.5, kLatency), 1e3 * counts.calcQuantile(0.99, kLatency),
          1e3 * counts.calcQuantile(1, kLatency)};
}

// From the measurement on, or with what is prepared before it.
Quantiles calcSolveTimes(const PredictiveCounts& counts, bool with_preparation) {
  std::vector<double> times;
  for (const PredictiveSolve& solve : counts.last)
    times.push_back(1e3 * (solve.seconds + (with_preparation ? solve.prepare : 0)));
  return {calcQuantile(times, 0.5), calcQuantile(times, 0.99), calcQuantile(times, 1)};
}

// A row per solve: when its state was measured, s, the milliseconds of the whole and its parts, step and regularization.
void addLog(const PredictiveCounts& counts, Json& json) {
  json["log_columns"] = {"time_s", "whole"};
  for (const auto& [name, part] : kParts) json["log_columns"].push_back(name);
  for (const char* name : {"step", "regularization"}) json["log_columns"].push_back(name);
  const auto round = [](double seconds) { return std::round(1e6 * seconds) / 1e3; };
  json["log"] = Json::array();
  const size_t solves = counts.last.size();
  for (size_t i = 0; i < solves; ++i) {
    const PredictiveSolve& solve = counts.last[(static_cast<size_t>(counts.solves) + i) % solves];  // the oldest first
    Json row = {solve.time, round(solve.seconds)};
    for (const auto& [name, part] : kParts) row.push_back(round(solve.*part));
    row.push_back(solve.step);
    row.push_back(solve.regularization);
    json["log"].push_back(row);
  }
}

Json listSolves(const PredictiveCounts& counts) {
  const Quantiles whole = calcSolveTimes(counts, true);
  Json json = {{"stages", counts.stages},
               {"count", counts.solves},
               {"missed", counts.missed},
               {"failed", counts.failed},
               {"early_landings", counts.early},
               {"late_landings", counts.late},
               {"median_ms", 1e3 * counts.calcQuantile(0.5)},
               {"p99_ms", 1e3 * counts.calcQuantile(0.99)},
               {"worst_ms", 1e3 * counts.calcQuantile(1)},
               {"with_preparation", {{"median_ms", whole.median}, {"p99_ms", whole.p99}, {"worst_ms", whole.worst}}},
               {"parts", listParts(counts)},
               {"step",
                {{"median", counts.calcQuantile(0.5, &PredictiveSolve::step)},
                 {"p1", counts.calcQuantile(0.01, &PredictiveSolve::step)}}},
               {"regularization",
                {{"median", counts.calcQuantile(0.5, &PredictiveSolve::regularization)},
                 {"p99", counts.calcQuantile(0.99, &PredictiveSolve::regularization)}}}};
  addLog(counts, json);
  return json;
}

// Of this process alone, MB: that of getrusage() may be that of the process it comes from.
double readPeakMemory() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);)
    if (line.rfind("VmHWM:", 0) == 0) return std::stod(line.substr(6)) / 1024;  // kB
  return 0;
}

Json listTimes(const PredictiveCounts& counts, const Execution& e) {
  const auto list = [](const Quantiles& q) {
    return Json{{"median_ms", q.median}, {"p99_ms", q.p99}, {"worst_ms", q.worst}};
  };
  return {{"update", list(calcUpdateTimes(e))},
          {"new_policy", list(calcPolicyLatencies(counts))},
          {"largest_lag_ms", 1e3 * e.largest_lag},
          {"peak_memory_MB", readPeakMemory()}};
}

Json listMapCounts(const GeneratedMaps::Counts& counts) {
  return {{"measured", counts.measured},
          {"clamped", counts.clamped},
          {"not_reached", counts.not_reached},
          {"largest_difference", counts.largest_difference}};
}

Json listCommands(const std::vector<TimedCommand>& commands) {
  auto list = Json::array();
  for (const auto& [time, velocity] : commands)
    list.push_back({{"time_s", time},
                    {"forward", velocity.forward},
                    {"sideways", velocity.sideways},
                    {"turning", velocity.turning}});
  return list;
}

// The mean speed in the steps in which the plan's own counts: without the time that the robot stands, starts and stops. Empty
// where a plan has none, or the motion did not come that far.
std::optional<double> findSteadySpeed(const std::vector<GoalOutcome>& outcomes) {
  for (const GoalOutcome& outcome : outcomes)
    if (outcome.goal.kind == GoalKind::Speed && std::isfinite(outcome.achieved)) return outcome.achieved;
  return {};
}

std::string describeSteadySpeed(const std::vector<GoalOutcome>& outcomes) {
  const std::optional<double> speed = findSteadySpeed(outcomes);
  return speed ? " with the time that it stands, " + formatNumber(*speed, "%.3f") + " m/s in its steady steps" : "";
}

std::string describeExtension(const Execution& e) {
  return e.extension > 0 ? ", " + formatNumber(e.extension, "%.3f s") + " longer, to see whether it stands" : "";
}

// The summary of a result, with what happened in place of how it was solved.
Json makeSummary(const MotionResult& result, const CarriedOut& carried, const Execution& e) {
  const SimulateArguments& arguments = carried.arguments;
  const Plan& plan = carried.plan;
  Json summary = makeHappenedSummary(result);
  summary["world"] = arguments.world;
  summary["integration"] = listIntegration(e.integration);
  summary["warnings"] = carried.warnings;
  summary["control"] = getName(arguments.control.control);
  summary["believed_model"] = getName(plan.belief);
  if (plan.belief != Belief::Closed) summary["maps"] = carried.controller.maps ? "generated" : "library";
  if (carried.controller.maps) summary["map_counts"] = listMapCounts(carried.controller.maps->counts());
  if (plan.belief != Belief::Closed)
    summary["plan_reachable_until"] = plan.lifted.first_missed < 0 ? nullptr : Json(plan.lifted.first_missed);
  if (carried.controller.prediction) summary["solves"] = listSolves(carried.controller.prediction->counts());
  // Of feet that carry: how far they turn from the ground and sink into it.
  summary["contact_slip"]["depth_m"] = e.largest_depth.value;
  for (const auto& [name, value] : plan.summary.options)
    if (const double* speed = std::get_if<double>(&value); name == "speed" && speed)
      summary["commanded_speed"] = *speed;
  if (!plan.commands.empty()) {
    summary["commanded_speed"] = calcMeanSpeed(plan.commands, e.duration);
    summary["commands"] = listCommands(plan.commands);
  }
  summary["terrain"] = arguments.terrain;
  summary["sensors"] = getName(arguments.sensors);
  if (arguments.sensors == Sensing::Real) {
    summary["noise"] = arguments.noise;
    summary["estimator"] = listEstimation(e.estimation);
  }
  if (const Payload payload = makePayload(arguments); payload.mass > 0) {
    summary["payload"] = {{"mass_kg", payload.mass}, {"link", payload.link}};
    if (payload.at) summary["payload"]["at_m"] = {payload.at->x(), payload.at->y(), payload.at->z()};
  }
  for (const Play& play : makeWear(arguments, carried.robot).plays) summary["play"][play.name] = play.size;
  summary["robot_errors"] = {{"mass", arguments.errors.mass}, {"rod_m", arguments.errors.rod}};
  summary["delay"] = {{"mean_ms", arguments.delay}, {"jitter_ms", arguments.jitter}};
  summary["seed"] = arguments.seed;
  summary["pushes"] = listPushes(arguments.execution.pushes);
  summary["gain_iterations"] = plan.iterations;
  summary["outcome"] = getName(e.outcome);
  summary["outcome_message"] = e.message;
  summary["fell"] = e.outcome == Outcome::Fell;
  summary["fall_time"] = e.outcome == Outcome::Fell ? Json(e.duration) : nullptr;
  summary["duration"] = e.duration;
  summary["extension"] = e.extension;
  summary["distance"] = e.distance;
  summary["mean_speed"] = e.meanSpeed();
  if (!plan.goals.empty()) summary["plan"] = {{"goals", listGoals(carried.planned)}};
  const std::optional<double> steady = findSteadySpeed(result.goals);
  summary["steady_speed"] = steady ? Json(*steady) : Json();
  summary["largest_deviation"] = e.largest_deviation;
  summary["largest_gap"] = e.largest_gap;
  summary["largest_joint_deviation"] = e.largest_joint_deviation;
  summary["largest_slip"] = e.largest_slip;
  summary["largest_tilt"] = e.largest_tilt.value;
  summary["largest_depth"] = e.largest_depth.value;
  summary["energy_balance"] = e.energy_balance;
  summary["books"] = listBooks(e);
  summary["saturated_share"] = e.saturated_share;
  summary["real_time_factor"] = e.realTimeFactor();
  summary["seconds"] = {{"whole", e.whole_seconds}, {"world", e.world_seconds}, {"control", e.control_seconds}};
  if (arguments.execution.real_time) summary["real_time"] = listTimes(carried.controller.prediction->counts(), e);
  return summary;
}

// Files that cannot be written leave those of before, which still say that the motion is running. The word is changed where it
// is, which a full disk permits.
void markAsFailed(const std::filesystem::path& directory) {
  const std::string failed = "\"failed\" ";
  for (const char* name : {"summary.json", "report.html"}) {
    std::fstream file(directory / name, std::ios::binary | std::ios::in | std::ios::out);
    const std::string text{std::istreambuf_iterator<char>(file), {}};
    for (const std::string running : {"\"outcome\": \"running\"", "\"outcome\":\"running\""}) {
      const size_t at = text.find(running);
      if (at == std::string::npos) continue;
      file.clear();
      file.seekp(static_cast<std::streamoff>(at + running.size() - failed.size()));
      file << failed << std::flush;
    }
  }
}

std::vector<std::string> writeFiles(const CarriedOut& carried, const MotionResult& result, const Json& summary) {
  const SimulateArguments& arguments = carried.arguments;
  const std::filesystem::path output = arguments.output;
  if (arguments.summary_only) {
    writeSummary(arguments.output, summary);
    return {(output / "summary.json").string()};
  }
  std::vector<std::string> paths = writeResult(arguments.output, result.record, result.run.mechanism, summary);
  paths.push_back((output / "plan.npz").string());
  writeNpz(paths.back(), makePlannedRecord(carried.plan.robot.model, carried.plan.reference(), result.record));
  if (!arguments.no_report) {
    paths.push_back((output / "report.html").string());
    writeReport(paths.back(), {arguments.output});
  }
  return paths;
}

// From a measurement to its torques, and to the first ones by the policy that is solved from it.
void printTimes(const PredictiveCounts& counts, const Execution& e) {
  char text[500];
  const Quantiles update = calcUpdateTimes(e), policy = calcPolicyLatencies(counts);
  std::snprintf(text, sizeof text,
                "  until torques       median %.3f ms, 99 %% %.3f ms, worst %.3f ms\n"
                "  until a new policy  median %.1f ms, 99 %% %.1f ms, worst %.1f ms\n"
                "  behind the clock    %.1f ms at most\n"
                "  memory              %.0f MB at most\n",
                update.median, update.p99, update.worst, policy.median, policy.p99, policy.worst, 1e3 * e.largest_lag,
                readPeakMemory());
  std::cout << text;
}

void printEstimation(const EstimationErrors& s) {
  char text[500];
  std::snprintf(text, sizeof text,
                "  estimated trunk     rms error %.4f m, %.4f m/s, tilt %.4f rad\n"
                "  drift               %.4f m of %.3f m\n"
                "  contacts            wrong for %.2f %% of the time\n",
                s.position_rms, s.velocity_rms, s.tilt_rms, s.drift, s.way, 100 * s.contact_errors);
  std::cout << text;
}

}  // namespace

Json listBooks(const Execution& e) {
  return {{"energy_start_J", e.start.energy()},   {"energy_end_J", e.end.energy()},
          {"motor_work_J", e.end.motor_work},     {"push_work_J", e.end.push_work},
          {"contact_loss_J", e.end.contact_loss}, {"stop_loss_J", e.end.stop_loss},
          {"other_loss_J", e.end.other_loss},     {"imbalance_J", e.imbalance}};
}

Json listIntegration(const Integration& integration) {
  const auto orNull = [](double value) { return value > 0 ? Json(value) : Json(); };
  return {{"integrator", integration.integrator},
          {"longest_step_s", integration.longest_step},
          {"shortest_step_s", integration.shortest_step},
          {"tolerance", orNull(integration.tolerance)},
          {"closure_tolerance", orNull(integration.closure_tolerance)}};
}

void tell(const std::vector<std::string>& warnings) {
  for (const std::string& warning : warnings) std::cerr << "bielle: warning: " << warning << "\n";
}

void noteOpenLoops(const std::string& world, const Execution& execution, std::vector<std::string>& warnings) {
  constexpr double kOpen = 1e-3;  // m
  if (execution.largest_gap <= kOpen) return;
  warnings.push_back("world " + world + ": closures opened by up to " + formatNumber(execution.largest_gap, "%.2g") +
                     " m: its loops are too soft for this motion" +
                     (world == "bielle" ? "" : "; world bielle closes them to rounding"));
  tell({warnings.back()});
}

Json listPushes(const std::vector<Push>& pushes) {
  auto list = Json::array();
  for (const Push& push : pushes)
    list.push_back({{"time_s", push.time},
                    {"impulse_Ns", push.impulse},
                    {"direction_deg", push.direction},
                    {"duration_s", push.duration}});
  return list;
}

void print(const CarriedOut& carried, const std::string& reason, const Execution& e) {
  const SimulateArguments& arguments = carried.arguments;
  const Plan& plan = carried.plan;
  std::cout << plan.summary.motion << " of " << plan.summary.run.robot << " in world " << arguments.world
            << ", control " << getName(arguments.control.control);
  if (!reason.empty()) std::cout << " (" << reason << ")";
  if (plan.belief != Belief::Closed) std::cout << " with model " << getName(plan.belief);
  if (carried.controller.maps) std::cout << " and generated maps";
  std::cout << (e.outcome == Outcome::Undecided ? ": " : ": it ") << getName(e.outcome);
  if (!e.message.empty()) std::cout << " (" << e.message << ")";
  const std::vector<GoalOutcome> goals = measureCarriedGoals(plan, carried.controller.goals, e.record);
  char text[1000];
  std::snprintf(text, sizeof text,
                "\n"
                "  duration            %.3f s%s\n"
                "  distance            %.3f m, %.3f m/s%s\n"
                "  trunk deviation     %.4f m at most\n"
                "  closures            gap %.1e m at most\n"
                "  soles               slip %.1e m, tilt %.1e rad, depth %.1e m at most\n"
                "  energy balance      %.1e J, %.1e of the energy exchanged\n"
                "  torques             %.2f %% saturated\n"
                "  computing time      %.2f s, %.2g times real time; world %.2f s, control %.2f s\n",
                e.duration, describeExtension(e).c_str(), e.distance, e.meanSpeed(), describeSteadySpeed(goals).c_str(),
                e.largest_deviation, e.largest_gap, e.largest_slip, e.largest_tilt.value, e.largest_depth.value,
                e.imbalance, e.energy_balance, 100 * e.saturated_share, e.whole_seconds, e.realTimeFactor(),
                e.world_seconds, e.control_seconds);
  std::cout << text;
  for (const Push& push : arguments.execution.pushes)
    std::cout << "  push                " << formatNumber(push.impulse) << " N s at " << formatNumber(push.time)
              << " s, for " << formatNumber(push.duration) << " s, direction " << formatNumber(push.direction)
              << " degrees\n";
  if (carried.controller.maps) {
    const GeneratedMaps::Counts& c = carried.controller.maps->counts();
    std::snprintf(text, sizeof text,
                  "  maps                joints within %.1e of the measured ones; %ld of %ld linkages clamped, %ld not "
                  "reached\n",
                  c.largest_difference, c.clamped, c.measured, c.not_reached);
    std::cout << text;
  }
  if (plan.lifted.first_missed >= 0)
    std::cout << "  the linkages cannot follow the plan from " << plan.lifted.first_missed
              << " s on: " << plan.lifted.message << "\n";
  if (carried.controller.prediction) {
    const PredictiveCounts& c = carried.controller.prediction->counts();
    const Quantiles after = calcSolveTimes(c, false), whole = calcSolveTimes(c, true);
    std::snprintf(text, sizeof text,
                  "  solves              %d, %d failed; median %.1f ms, 99 %% %.1f ms, worst %.1f ms\n"
                  "                      with their preparation %.1f ms, %.1f ms, %.1f ms\n"
                  "                      %d of %d stages %s\n",
                  c.solves, c.failed, after.median, after.p99, after.worst, whole.median, whole.p99, whole.worst,
                  c.missed, c.stages,
                  arguments.execution.real_time || arguments.solve_time > 0
                      ? "had no solve of their own"
                      : "had a solve that would be late in real time");
    std::cout << text;
    if (arguments.execution.real_time) printTimes(c, e);
  }
  if (arguments.sensors == Sensing::Real) printEstimation(e.estimation);
  std::cout.flush();
  tell(listDifferences(carried.planned, goals));
}

std::vector<std::string> write(const CarriedOut& carried, const Execution& execution) {
  try {
    const MotionResult result = makeResult(carried, execution);
    return writeFiles(carried, result, makeSummary(result, carried, execution));
  } catch (...) {
    markAsFailed(carried.arguments.output);
    throw;
  }
}

}  // namespace bielle::worlds
