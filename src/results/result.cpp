#include "bielle/results/result.h"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>

#include "bielle/dynamics/kinematics.h"
#include "bielle/model/error.h"
#include "formats/aside_file.h"
#include "formats/text_file.h"
#include "math/largest.h"
#include "motion/periodic_motion.h"
#include "results/ground_json.h"
#include "results/json_text.h"
#include "results/result_files.h"

namespace fs = std::filesystem;

namespace bielle {
namespace {

Json listOptionValues(const OptionValues& options) {
  Json out = Json::object();
  for (const auto& [name, value] : options)
    std::visit([&out, &name = name](const auto& held) { out[name] = held; }, value);
  return out;
}

Json listByName(const std::vector<std::pair<std::string, double>>& values) {
  Json json = Json::object();
  for (const auto& [name, value] : values) json[name] = value;
  return json;
}

Json makeEnergy(const MotionResult& result) {
  Json motors = Json::object();
  for (size_t m = 0; m < result.record.u_names.size(); ++m)
    motors[result.record.u_names[m]] = result.energy.by_motor[static_cast<Eigen::Index>(m)];
  return {{"total_J", result.energy.total},
          {"motors_J", motors},
          {"regeneration", result.energy.regeneration},
          {"motors_of_assumed_loss", result.energy.num_assumed},
          {"assumed_loss_W_per_Nm2", kDefaultTorqueLoss},
          {"distance_m", result.energy.distance},
          {"cost_of_transport", result.energy.cost_of_transport}};
}

Json makePhases(const MotionResult& result) {
  Json phases = Json::array();
  int start = 0;
  for (const ContactPhase& phase : result.schedule.phases) {
    Json contacts = Json::array();
    for (const ContactTarget& target : phase.contacts) {
      const Vector3d& p = target.X_WT.p;
      const Eigen::Quaterniond r(target.X_WT.R);
      contacts.push_back({{"name", result.record.contact_names[target.contact]},
                          {"position", {p.x(), p.y(), p.z()}},
                          {"quaternion", {r.x(), r.y(), r.z(), r.w()}}});
    }
    phases.push_back({{"name", phase.name},
                      {"start_node", start},
                      {"nodes", phase.nodes},
                      {"time_step_s", phase.dt},
                      {"contacts", contacts}});
    start += phase.nodes;
  }
  return phases;
}

Json makeTimings(const MotionResult& result) {
  Json timings = Json::array();
  for (const PhaseTiming& timing : result.timings)
    timings.push_back({{"phase", timing.phase},
                       {"start_node", timing.start_node},
                       {"nominal_s", timing.nominal},
                       {"chosen_s", timing.chosen},
                       {"lower_s", timing.lower},
                       {"upper_s", timing.upper}});
  return timings;
}

Json makeDeadPoints(const MotionResult& result) {
  Json linkages = Json::array();
  for (const DeadPointTrace& linkage : result.dead_points) {
    const auto [kind, distance] = linkage.getNearest();
    const bool far = kind == DeadPointKind::None;
    linkages.push_back({{"linkage", linkage.output},
                        {"distance", far ? Json() : Json(distance)},
                        {"of", getName(kind)},
                        {"time_s", result.record.time[linkage.getNearestNode()]}});
  }
  return linkages;
}

// Null of a motion that does not repeat.
Json makePeriodic(const MotionResult& result) {
  if (!result.cycle) return {};
  const VectorXd& cycle = result.record.cycle;
  const std::optional<double>& floquet = result.cycle->floquet_multiplier;
  return {{"period_s", cycle[0]},
          {"offset", {{"x_m", cycle[1]}, {"y_m", cycle[2]}, {"yaw_rad", cycle[3]}}},
          {"closing_error", result.cycle->closing_error},
          {"floquet_multiplier", floquet ? Json(*floquet) : Json()}};
}

Json makeConstraints(const FddpSummary& solver) {
  return {{"largest_violation", solver.violation},
          {"complementarity", solver.complementarity},
          {"largest_multiplier", solver.multiplier},
          {"penalty", solver.penalty},
          {"multiplier_updates", solver.multiplier_updates}};
}

// What the iterations did, and how long, summed over the threads.
Json makeWork(const FddpSummary& solver) {
  return {{"linearizations", solver.linearizations},
          {"sweeps", solver.sweeps},
          {"rollouts", solver.rollouts},
          {"searches", solver.searches},
          {"seconds",
           {{"evaluate", solver.evaluate_seconds},
            {"linearize", solver.linearize_seconds},
            {"sweep", solver.sweep_seconds},
            {"rollout", solver.rollout_seconds - solver.search_seconds},
            {"search", solver.search_seconds}}}};
}

}  // namespace

Json listGoals(const std::vector<GoalOutcome>& outcomes) {
  const auto list = [](const Vector3d& p) { return Json{p.x(), p.y(), p.z()}; };
  Json goals = Json::array();
  for (const GoalOutcome& outcome : outcomes) {
    const Goal& goal = outcome.goal;
    Json json = {{"name", goal.name},           {"kind", getName(goal.kind)},  {"unit", getUnit(goal.kind)},
                 {"requested", goal.requested}, {"tolerance", goal.tolerance}, {"achieved", outcome.achieved},
                 {"met", outcome.met()},        {"first_node", goal.first},    {"last_node", goal.last}};
    if (goal.kind == GoalKind::Speed || goal.kind == GoalKind::Displacement) json["direction"] = list(goal.direction);
    if (!goal.contacts.empty()) json["contacts"] = goal.contacts;
    for (const Foothold& foothold : goal.footholds)
      json["footholds"].push_back(
          {{"contact", foothold.contact}, {"node", foothold.node}, {"position", list(foothold.position)}});
    goals.push_back(json);
  }
  return goals;
}

Json makeSummary(const MotionResult& result) {
  const BuildInfo build = getBuildInfo();
  Json log = Json::array();
  for (const FddpIteration& line : result.solver.log)
    log.push_back({line.iteration, line.cost, line.gap, line.violation, line.gradient, line.step, line.regularization,
                   line.seconds});
  const VectorXd& time = result.record.time;
  return {{"motion", result.motion},
          {"robot", result.run.robot},
          {"robot_file", result.run.robot_file},
          {"robot_fingerprint", calcFingerprint(result.run.mechanism)},
          {"model", getName(result.run.model)},
          {"serial_armature", result.run.serial_armature},
          {"formulation", getName(result.formulation)},
          {"step", getName(result.step)},
          {"command", result.run.command},
          {"goals", listGoals(result.goals)},
          {"options", listOptionValues(result.options)},
          {"versions", {{"bielle", build.bielle}, {"eigen", build.eigen}, {"compiler", build.compiler}}},
          {"converged", result.converged()},
          {"interrupted", result.interrupted()},
          {"termination", getName(result.solver.termination)},
          {"message", result.solver.message},
          {"acceptable", result.solver.acceptable},
          {"cost", result.solver.cost},
          {"iterations", result.solver.iterations},
          {"seconds", result.solver.seconds},
          {"work", makeWork(result.solver)},
          {"solver_gap", result.solver.gap},
          {"constraints", makeConstraints(result.solver)},
          {"nodes", time.size()},
          {"duration_s", time[time.size() - 1]},
          {"closure_gap", {{"position_m", result.gap_position}, {"angle_rad", result.gap_angle}}},
          {"contact_slip", {{"position_m", result.slip_position}, {"angle_rad", result.slip_angle}}},
          {"dead_points", makeDeadPoints(result)},
          {"com_height", {{"start_m", result.com_start}, {"lowest_m", result.com_lowest}}},
          {"peak_torques", listByName(result.peak_torques)},
          {"rms_torques", listByName(result.rms_torques)},
          {"continuous_torques", listByName(result.continuous_torques)},
          {"objective",
           {{"kind", getName(result.objective.objective)},
            {"regularization", result.objective.getRegularization()},
            {"scale", result.objective.scale.value_or(1)}}},
          {"electrical_energy", makeEnergy(result)},
          {"phases", makePhases(result)},
          {"free_timings", makeTimings(result)},
          {"periodic", makePeriodic(result)},
          {"ground", describeGround(result.ground)},
          {"log_columns", {"iteration", "cost", "gap", "violation", "gradient", "step", "regularization", "seconds"}},
          {"log", log}};
}

void setFigures(const Model& model, MotionResult& result) {
  const MotionRecord& record = result.record;
  result.peak_torques.clear();
  for (size_t m = 0; m < record.u_names.size(); ++m)
    result.peak_torques.emplace_back(record.u_names[m], calcLargest(record.u.col(m)));
  std::stable_sort(result.peak_torques.begin(), result.peak_torques.end(),
                   [](const auto& a, const auto& b) { return a.second > b.second; });
  const VectorXd rms = calcRmsEfforts(model, record);
  result.rms_torques.clear();
  result.continuous_torques.clear();
  for (int m = 0; m < model.nu(); ++m) {
    const Motor& motor = model.motors()[m];
    result.rms_torques.emplace_back(motor.name, rms[m]);
    if (std::isfinite(motor.continuous_effort))
      result.continuous_torques.emplace_back(motor.name, motor.continuous_effort);
  }
  result.energy = calcElectricalEnergy(model, record, result.objective.regeneration);
  result.gap_position = calcLargest(record.gap.col(0));
  result.gap_angle = calcLargest(record.gap.col(1));
  result.com_start = record.com(0, 2);
  result.com_lowest = record.com.col(2).minCoeff();
  result.dead_points = traceDeadPoints(model, record.q);
}

MotionResult makeResult(const RunInfo& run, const Solution& solution) {
  const Motion& motion = solution.motion;
  const ShootingTrajectory& trajectory = solution.trajectory;
  MotionResult result;
  result.run = run;
  result.motion = motion.name;
  result.formulation = motion.problem->formulation();
  result.step = motion.problem->spec(0).step;
  result.options = motion.options;
  result.schedule = motion.schedule;
  result.timings = listTimings(*motion.problem, motion.schedule, trajectory);
  int node = 0;
  for (ContactPhase& phase : result.schedule.phases) {
    if (phase.nodes > 0) phase.dt *= motion.problem->getTimeScale(node, trajectory.xs[node], trajectory.us[node]);
    node += phase.nodes;
  }
  result.ground = motion.ground;
  result.solver = solution.summary;
  result.record = makeRecord(motion, trajectory);
  result.record.multipliers = solution.multipliers;
  result.objective = motion.problem_options.objective;
  if (motion.cycle)
    result.cycle = {
        calcClosingError(motion.problem->model(), *motion.cycle, trajectory.xs.front(), trajectory.xs.back()),
        solution.floquet_multiplier};
  setFigures(motion.problem->model(), result);
  const MotionTrack track = makeTrack(motion.problem->model(), result.record);
  for (const Goal& goal : motion.goals) result.goals.push_back({goal, measureGoal(goal, track)});
  const Slip slip = calcSlip(motion, track);
  result.slip_position = slip.position;
  result.slip_angle = slip.angle;
  return result;
}

void makeOutputDirectory(const std::string& directory) {
  const auto fail = [&directory](const std::string& why) {
    throw InputError(directory, "directory", "results cannot be written there: " + why,
                     "give another one, or correct its permissions");
  };
  std::error_code error;
  fs::create_directories(directory, error);
  if (error) fail(error.message());
  if (!fs::is_directory(directory, error)) fail("it is a file");
  if (access(directory.c_str(), W_OK | X_OK) != 0) fail(std::strerror(errno));
}

std::vector<std::string> writeResult(const std::string& directory, const MotionResult& result) {
  return writeResult(directory, result.record, result.run.mechanism, makeSummary(result));
}

std::vector<std::string> writeResult(const std::string& directory, const MotionRecord& record,
                                     const RobotText& mechanism, const Json& json) {
  makeOutputDirectory(directory);
  std::vector<std::string> paths;
  for (const char* name : {"trajectory.csv", "trajectory.npz", "summary.json"})
    paths.push_back((fs::path(directory) / name).string());
  AsideFile csv(paths[0]), npz(paths[1]), summary(paths[2]), urdf((fs::path(directory) / kMechanismUrdf).string()),
      yaml((fs::path(directory) / kMechanismYaml).string());
  csv.write(formatCsv(record));
  npz.write(formatNpz(record));
  summary.write(formatJson(json) + "\n");
  urdf.write(mechanism.urdf);
  yaml.write(mechanism.yaml);
  // Files derived from the old summary are removed before it, and the new summary is written last, so that an
  // interruption never leaves a mixture of two results.
  std::error_code error;
  for (const char* name :
       {"report.html", "lift.json", "check.json", "plan.npz", "summary.json", kMechanismUrdf, kMechanismYaml})
    fs::remove(fs::path(directory) / name, error);
  if (!mechanism.urdf.empty())
    for (AsideFile* file : {&urdf, &yaml}) file->commit();
  for (AsideFile* file : {&csv, &npz, &summary}) file->commit();
  return paths;
}

void writeSummary(const std::string& directory, const MotionResult& result) {
  writeSummary(directory, makeSummary(result));
}

void writeSummary(const std::string& directory, const Json& summary) {
  makeOutputDirectory(directory);
  writeTextFile((fs::path(directory) / "summary.json").string(), formatJson(summary) + "\n");
}

std::vector<std::string> listResultFiles(const std::string& directory) {
  std::vector<std::string> paths;
  for (const char* name :
       {"trajectory.npz", "trajectory.csv", "summary.json", "check.json", "plan.npz", kMechanismUrdf, kMechanismYaml})
    paths.push_back((fs::path(directory) / name).string());
  return paths;
}

BuildInfo getBuildInfo() {
#ifdef __clang__
  const std::string compiler = __VERSION__;
#else
  const std::string compiler = "GCC " __VERSION__;
#endif
  return {BIELLE_VERSION,
          std::to_string(EIGEN_WORLD_VERSION) + "." + std::to_string(EIGEN_MAJOR_VERSION) + "." +
              std::to_string(EIGEN_MINOR_VERSION),
          compiler};
}

}  // namespace bielle
