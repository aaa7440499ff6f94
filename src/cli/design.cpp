// bielle design: lengths of a robot chosen by optimization.
#include <iostream>

#include "bielle/io/motion_registry.h"
#include "bielle/model/error.h"
#include "cli/commands.h"
#include "cli/table.h"
#include "design/run.h"

namespace bielle::cli {
namespace {

struct DesignArguments {
  std::string spec, directory;
  int jobs = 2;
};

// Every call makes its own request, because several threads make plans.
DesignMotion makeDesignMotion(const std::string& file, const MotionSpec& motion) {
  const auto make = [file, motion] {
    const MotionRequest request = findMotion(file, motion.motion).makeRequest();
    for (const auto& [name, value] : motion.settings) setOption(request.options, name, value);
    return request;
  };
  make();  // names are checked now
  return {motion.motion, [make](const Model& model, const VectorXd& q0) { return make().plan(model, q0); }};
}

int run(const DesignArguments& arguments) {
  const DesignSpec spec = readDesignSpec(arguments.spec);
  const Parametrization robot = makeParametrization(spec);
  std::vector<DesignMotion> motions;
  for (const MotionSpec& motion : spec.motions) motions.push_back(makeDesignMotion(spec.path, motion));
  EvaluationOptions options;
  options.mode = spec.mode;
  options.drives = spec.drives;
  options.margin = spec.margin;
  const DesignEvaluator evaluator(robot, motions, spec.objective, options);

  DesignRunOptions run_options;
  run_options.directory = arguments.directory;
  run_options.jobs = arguments.jobs;
  run_options.progress = [](const std::string& line) { std::cout << line << std::endl; };
  const DesignRun run = runDesign(evaluator, spec, run_options);

  const int count = run.counts[0] + run.counts[1] + run.counts[2];
  std::vector<Row> rows = {
      {"value", formatNumber(evaluator.start().value, "%.4f") + " -> " + formatNumber(run.value, "%.4f")},
      {"evaluations", std::to_string(count) + ", " + std::to_string(run.replayed) + " of them from the logs; " +
                          formatNumber(run.seconds, "%.0f") + " s of processor time"},
      {"infeasible",
       std::to_string(run.counts[1]) + " loop open, " + std::to_string(run.counts[2]) + " motion failed"}};
  for (size_t i = 0; i < robot.variables().size(); ++i) {
    const Eigen::Index k = static_cast<Eigen::Index>(i);
    rows.push_back({robot.variables()[i].name, formatNumber(robot.start()[k], "%.5g") + " -> " +
                                                   formatNumber(run.best[k], "%.5g") + " " +
                                                   robot.variables()[i].unit});
  }
  printTable(std::cout, rows);
  for (const std::string& path : writeDesign(arguments.directory, evaluator, spec, run))
    std::cout << "  " << path << "\n";
  return kOk;
}

}  // namespace

void addDesign(CLI::App& app, Action& action) {
  CLI::App& command = *app.add_subcommand("design", "Choose lengths of a robot by optimization over its motions");
  const auto arguments = std::make_shared<DesignArguments>();
  command.add_option("SPEC", arguments->spec, "YAML file: robot, variables with bounds, motions, objective, search")
      ->required();
  command
      .add_option("-o,--output", arguments->directory,
                  "directory for best/ (a robot), design.md, figures and the logs; made if need be")
      ->required();
  command.add_option("--jobs", arguments->jobs, "searches at a time, one thread each; results do not depend on it")
      ->check(CLI::Range(1, 1024))
      ->capture_default_str();
  command.footer(
      "SPEC, lengths in m:\n"
      "  robot: bipetto             (or `generator: cleobot`, with variables {name, parameter, bounds})\n"
      "  variables:\n"
      "    - name: crank\n"
      "      bounds: [0.04, 0.06]\n"
      "      length:                (of several the first is the value, the others change by as much)\n"
      "        - {from: motor_knee_right, to: transmission_knee_right, across: [0, 0, 1], stretch: knee_crank_right}\n"
      "        - {from: motor_knee_left, to: transmission_knee_left, across: [0, 0, 1], stretch: knee_crank_left}\n"
      "    - name: motor_x\n"
      "      bounds: [-0.01, 0.01]\n"
      "      shift: [{of: motor_knee_right, along: [1, 0, 0]}, {of: motor_knee_left, along: [1, 0, 0]}]\n"
      "  motions:\n"
      "    - {motion: squat, set: {depth: 0.6}}\n"
      "  mode: reoptimized          (or `kept`: postures of the start design, motor torques computed anew)\n"
      "  margin: 0.1                (the least that a joint moves in a unit motion of its linkage; for motions that "
      "are\n"
      "                              kept, or for searches with gradients those of the start design)\n"
      "  objective:                 (peak_torque, rms_torque, energy, electrical_energy [J], cost, conditioning, "
      "workspace;\n"
      "                              over their start values; all motors when none are named)\n"
      "    - {measure: peak_torque, motors: [motor_knee_left, motor_knee_right], weight: 1}\n"
      "    - {measure: workspace, region: {foot: foot_left, x: [-0.2, 0.2], z: [-0.1, 0.1]}}     (share that is "
      "reached)\n"
      "  drives: {motor_constant: 2, regeneration: 0}     (for electrical_energy; N m/sqrt(W) at the joints)\n"
      "  search:\n"
      "    seed: 1\n"
      "    searches: 2\n"
      "    stages:                  (crs or isres, then bobyqa or sbplx; but for conditioning and workspace also slsqp "
      "or\n"
      "                              mma: gradients, far fewer evaluations)\n"
      "      - {algorithm: crs, evaluations: 200}\n"
      "      - {algorithm: sbplx, evaluations: 100, tolerance: 1e-3}\n"
      "Every evaluation is logged: after Ctrl-C or a crash the same command goes on from there and ends the same way.\n"
      "Designs whose loops do not close, or whose motion fails, are penalized and counted.\n"
      "Exit status: 0 done, 2 bad input.\n"
      "Example:\n  bielle design examples/knee_design/knee.yaml -o knee");
  command.callback([&action, arguments] { action = [=] { return run(*arguments); }; });
}

}  // namespace bielle::cli
