// bielle design: lengths of a robot chosen by optimization.
#include <algorithm>
#include <filesystem>
#include <iostream>
#include <numeric>
#include <optional>

#include "bielle/model/error.h"
#include "bielle/report/report.h"
#include "cli/commands.h"
#include "cli/table.h"
#include "cli/task_options.h"
#include "design/figures.h"
#include "design/joint_reach.h"
#include "design/marks.h"
#include "design/page_data.h"
#include "design/run.h"
#include "design/shown_designs.h"
#include "design/spec_parts.h"
#include "formats/text_file.h"
#include "report/page.h"
#include "results/output_place.h"
#include "tasks/design_tasks.h"

namespace bielle::cli {
namespace {

struct DesignArguments {
  DesignArguments() { tasks.jobs = 2; }

  std::string spec, directory, request;
  TaskArguments tasks;
};

// One design, for others that search.
int evaluateRequest(const DesignEvaluator& evaluator, const tasks::DesignRequest& request, const std::string& file) {
  if (request.x.size() != evaluator.robot().start().size())
    throw InputError("", "--evaluate", "it does not have one number for each variable of the design",
                     "give one number for each");
  writeTextFile(file, formatEvaluation(evaluateDesign(evaluator, request.stage, request.x)) + "\n");
  return kOk;
}

// \param engine  of the evaluations, or none: threads here
DesignRun runSearches(const DesignArguments& arguments, const DesignEvaluator& evaluator, const DesignSpec& spec,
                      tasks::TaskEngine* engine) {
  DesignRunOptions options;
  options.directory = arguments.directory;
  options.jobs = arguments.tasks.jobs;
  options.progress = [](const std::string& line) { std::cout << line << std::endl; };
  if (!engine) return runDesign(evaluator, spec, options);
  tasks::DesignTasks tasks(spec, {std::filesystem::read_symlink("/proc/self/exe"), arguments.directory + "/running",
                                  engine, options.progress});
  options.evaluations = &tasks;
  return runDesign(evaluator, spec, options);
}

// By the usual steps of `bielle solve`, with what becomes of each objective.
std::string describeUsual(const DesignEvaluator& evaluator, const DesignRun& run) {
  const bielle::Evaluation& usual = *run.usual;
  const std::string steps = " by the usual steps of `bielle solve`";
  if (usual.status != DesignStatus::Feasible) return getName(usual.status) + steps + ": " + usual.message;
  std::string text = formatNumber(usual.value, "%.4f") + steps;
  if (!run.usual_start || !isMeasured(run.usual_start->status)) return text;
  for (size_t i = 0; i < evaluator.objective().size(); ++i) {
    const double before = run.usual_start->terms[i], after = usual.terms[i];
    text += (i == 0 ? ": " : ", ") + describeTerm(evaluator.objective()[i]) + " " + formatNumber(before, "%.4g") +
            " -> " + formatNumber(after, "%.4g");
    if (before != 0) text += " (" + formatNumber(100 * (after / before - 1), "%+.1f") + " %)";
  }
  return text;
}

// Of a design that does not make its motions, on the standard error.
void warn(const std::string& design, const bielle::Evaluation& evaluation) {
  if (evaluation.status != DesignStatus::Feasible && evaluation.status != DesignStatus::Violated)
    std::cerr << "bielle: warning: " << design << ": " << getName(evaluation.status) << ": " << evaluation.message
              << std::endl;
}

void printRun(const DesignEvaluator& evaluator, const DesignSpec& spec, const DesignRun& run) {
  const int count = std::accumulate(run.counts.begin(), run.counts.end(), 0);
  std::vector<Row> rows = {
      {"value", formatNumber(evaluator.start().value, "%.4f") + " -> " + formatNumber(run.value, "%.4f")}};
  if (run.usual) rows.push_back({"as solved", describeUsual(evaluator, run)});
  rows.insert(
      rows.end(),
      {{"evaluations", std::to_string(count) + ", " + std::to_string(run.replayed) + " of them from the logs; " +
                           formatNumber(run.seconds, "%.0f") + " s of processor time"},
       {"infeasible",
        std::to_string(run.counts[1]) + " loop open, " + std::to_string(run.counts[2]) + " motion failed" +
            (evaluator.start().goals.empty() ? "" : ", " + std::to_string(run.counts[4]) + " goal missed") +
            (spec.constraints.empty() ? "" : ", " + std::to_string(run.counts[3]) + " constraint violated")}});
  const Parametrization& robot = evaluator.robot();
  for (size_t i = 0; i < robot.variables().size(); ++i) {
    const Eigen::Index k = static_cast<Eigen::Index>(i);
    const DesignVariable& variable = robot.variables()[i];
    const std::string from =
        variable.isChoice() ? describeValue(variable, robot.start()[k]) : formatNumber(robot.start()[k], "%.5g");
    const std::string bound = findBound(variable, run.best[k]);
    rows.push_back({variable.name, from + " -> " + describeValue(variable, run.best[k]) +
                                       (bound.empty() ? "" : " (" + bound + " bound)")});
  }
  if (evaluator.start().margin && run.evaluation.margin)
    rows.push_back({"margin", formatNumber(*evaluator.start().margin, "%.3f") + " -> " +
                                  formatNumber(*run.evaluation.margin, "%.3f") + " from dead points"});
  for (const ReachChange& change : listReachChanges(robot.startModel(), robot.make(run.best)))
    rows.push_back({"range", change.before.joint + " " + formatRange(change.before) + " -> " +
                                 formatRange(change.after) + " through its linkage"});
  for (size_t i = 0; i < std::min(spec.constraints.size(), run.evaluation.constraints.size()); ++i)
    if (const std::string text = describeViolation(spec.constraints[i], run.evaluation.constraints[i]); !text.empty())
      rows.push_back({"violated", text});
  if (const double mass = calcMassInLinks(robot, run.best); mass > 0)
    rows.push_back(
        {"motor masses", formatNumber(mass, "%.4g") + " kg of the catalogue, included in the links as they are"});
  if (spec.front) rows.push_back({"front", std::to_string(run.front.size()) + " non-dominated designs"});
  printTable(std::cout, rows);
}

// The page, with the robots and motions that it shows.
std::vector<std::string> writePage(const DesignArguments& arguments, const DesignEvaluator& evaluator,
                                   const DesignRun& run) {
  const std::string& directory = arguments.directory;
  const auto report = [](const std::string& line) { std::cout << line << std::endl; };
  const std::vector<ShownDesign> designs = writeShownDesigns(directory, evaluator, run, arguments.tasks.jobs, report);
  std::vector<std::string> paths;
  for (const ShownDesign& design : designs) {
    paths.push_back(directory + "/" + design.directory);
    for (const std::string& result : design.results)
      if (!result.empty()) writeReport(directory + "/" + result + "/report.html", {directory + "/" + result});
  }
  paths.push_back(directory + "/design.html");
  writeTextFile(paths.back(), makeDesignPage(describeDesignRun(evaluator, run, designs)));
  return paths;
}

int run(const DesignArguments& arguments) {
  requireApart(arguments.directory, {arguments.spec, arguments.request});
  DesignSpec spec = readDesignSpec(arguments.spec);
  std::optional<tasks::DesignRequest> request;
  if (!arguments.request.empty()) {
    request = tasks::readRequest(arguments.request);
    if (!request->robot.empty()) spec.robot.name = request->robot;
  }
  // Before there are threads: the engine blocks signals, which none of them may take.
  auto engine = arguments.tasks.workers.empty() ? nullptr : makeTaskEngine(arguments.tasks);
  requireApart(arguments.directory + "/best", {findRobotDirectory(spec.robot, spec.path)});
  const DesignEvaluator evaluator = makeEvaluator(spec);
  if (request) return evaluateRequest(evaluator, *request, arguments.directory);
  warn("the start design", evaluator.start());
  for (const std::string& warning : listShortMotions(spec, evaluator.start().goals))
    std::cerr << "bielle: warning: " << warning << std::endl;
  DesignRun run = runSearches(arguments, evaluator, spec, engine.get());
  engine.reset();  // signals have their usual effect again
  if (!spec.motions.empty()) {
    run.usual = evaluator.solveUsually(run.best);
    if (run.best != evaluator.robot().start()) run.usual_start = evaluator.solveUsually(evaluator.robot().start());
  }
  std::vector<std::string> paths = writeDesign(arguments.directory, evaluator, spec, run);
  const std::vector<std::string> shown = writePage(arguments, evaluator, run);
  paths.insert(paths.end(), shown.begin(), shown.end());
  printRun(evaluator, spec, run);
  for (const std::string& path : paths) std::cout << "  " << path << "\n";
  std::cout.flush();
  if (run.evaluation.status != DesignStatus::Feasible)
    std::cerr << "bielle: warning: no design is feasible; the best one is the start design\n";
  if (run.usual) warn("the motions of the best design, as `bielle solve` makes them", *run.usual);
  return kOk;
}

}  // namespace

void addDesign(CLI::App& command, Action& action) {
  const auto arguments = std::make_shared<DesignArguments>();
  command.add_option("SPEC", arguments->spec, "YAML file: robot, variables with bounds, motions, objective, search")
      ->required();
  command
      .add_option("-o,--output", arguments->directory,
                  "directory for best/ (a robot), front/ or ranked/ (robots with their motions), design.html, "
                  "design.md, figures and "
                  "the logs; created if necessary")
      ->required();
  addTaskOptions(command, "searches, or designs of a front, at a time, each on one thread; results do not depend on it",
                 arguments->tasks);
  command.add_option("--evaluate", arguments->request,
                     "evaluate only the design in this file, {\"stage\": \"sbplx\", \"x\": [0.05]}, as workers do; -o "
                     "names the file for its line of the log");
  command.footer(
      "SPEC, lengths in m:\n"
      "  robot: bipetto             (or `generator: cleobot`, with variables {name, parameter, bounds})\n"
      "  variables:\n"
      "    - name: crank\n"
      "      bounds: [0.04, 0.06]\n"
      "      length:                (the first is the value; the others change by the same amount)\n"
      "        - {from: motor_knee_right, to: transmission_knee_right, across: [0, 0, 1], stretch: knee_crank_right}\n"
      "        - {from: motor_knee_left, to: transmission_knee_left, across: [0, 0, 1], stretch: knee_crank_left}\n"
      "    - name: motor_x\n"
      "      bounds: [-0.01, 0.01]\n"
      "      shift: [{of: motor_knee_right, along: [1, 0, 0]}, {of: motor_knee_left, along: [1, 0, 0]}]\n"
      "    - {name: gear, ratio: \"*knee*\", bounds: [6, 20]}             (turns of the rotor; * stands for any text "
      "in a motor's name)\n"
      "    - {name: motor, motor: \"*knee*\", choices: [ak80-9, ak10-9], mass: knee_motor_mass}     (mass: "
      "of a generator)\n"
      "  architecture: [four_bar_knee, belt_knee, rsu_ankle, differential_ankle]     (parts of `generator: "
      "leg_biped`)\n"
      "  motions:\n"
      "    - {motion: squat, set: {depth: 0.6}}\n"
      "    - {motion: walk, weight: 0.5, payload: 5}     (share in objectives; kg fixed to the trunk)\n"
      "  mode: reoptimized          (or `kept`: the start design's postures, new motor torques)\n"
      "  margin: 0.1                (the least that a joint moves in a unit motion of its linkage; for motions\n"
      "                              that are kept; for searches with gradients, the start design's motions)\n"
      "  objective:                 (peak_torque, rms_torque, energy, electrical_energy [J], cost, conditioning, "
      "workspace;\n"
      "                              relative to their start values; all motors unless some are named)\n"
      "    - {measure: peak_torque, motors: [motor_knee_left, motor_knee_right], weight: 1}\n"
      "    - {measure: workspace, region: {foot: foot_left, x: [-0.2, 0.2], z: [-0.1, 0.1]}}     (share reached)\n"
      "  constraints:               (on all motions: envelope, heat [at most 1], mass [kg], margin, distance [m], "
      "...)\n"
      "    - {measure: heat}\n"
      "    - {measure: distance, at_least: 0.005}\n"
      "  drives: {motor_constant: 2, regeneration: 0}     (for electrical_energy; N m/sqrt(W) at the joints)\n"
      "  search:\n"
      "    seed: 1\n"
      "    searches: 2              (or starts: [{crank: 0.05}, {crank: 0.055}], one search from each)\n"
      "    stages:                  (crs or isres, then bobyqa or sbplx; except for conditioning and workspace also "
      "slsqp or\n"
      "                              mma: gradients, far fewer evaluations)\n"
      "      - {algorithm: crs, evaluations: 200}\n"
      "      - {algorithm: sbplx, evaluations: 100, tolerance: 1e-3}\n"
      "    pareto:                  (instead of `searches` and `stages`: the front of several objectives)\n"
      "      {algorithm: nsga2, population: 24, generations: 10, refine: {algorithm: slsqp, evaluations: 6}}\n"
      "Every evaluation is logged: after Ctrl-C or a crash, run the same command again to continue; the result is the "
      "same.\n"
      "Designs whose loops do not close, or whose motion fails or misses its goal, are penalized and counted. In the "
      "end the\n"
      "motions of the best one are made by the usual steps of `bielle solve`, and the result is reported.\n"
      "Exit status: 0 done, 1 interrupted (with workers) or a task failed, 2 bad input.\n"
      "Example:\n"
      "  bielle design examples/knee_design/knee.yaml -o knee");
  command.callback([&action, arguments] { action = [=] { return run(*arguments); }; });
}

}  // namespace bielle::cli
