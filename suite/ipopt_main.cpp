// bielle-ipopt: the problem of a solved motion, solved by IPOPT.
#include <CLI/CLI.hpp>
#include <iostream>
#include <map>

#include "bielle/model/error.h"
#include "bielle/results/result.h"
#include "ipopt_solver.h"
#include "results/failure_message.h"
#include "results/remade_motion.h"

using namespace bielle;

namespace {

constexpr int kConverged = 0, kNotConverged = 1, kBadInput = 2;

struct Arguments {
  std::string solved, start, output;
  IpoptOptions options;
};

int run(const Arguments& arguments, const std::vector<std::string>& command) {
  const LoadedRobot robot = loadRobotOf(arguments.solved);
  const MotionSummary summary = readSummary(arguments.solved);
  const Motion motion = remakeMotion(robot.model, summary);
  const std::string& start = arguments.start.empty() ? arguments.solved : arguments.start;
  const ShootingTrajectory guess = makeStart(readResultRecord(start), motion).trajectory;
  makeOutputDirectory(arguments.output);
  const IpoptSolution found = solveByIpopt(motion, guess, arguments.options);
  const FddpSummary& solver = found.solution.summary;
  writeResult(arguments.output, makeResult(makeRunInfo(summary.run.robot, robot, command), found.solution));
  for (const std::string& row : found.dropped) std::cout << "redundant, and left out: " << row << "\n";
  std::cout << motion.name << " of " << summary.run.robot << ": " << solver.message << ", cost " << solver.cost << ", "
            << solver.iterations << " iterations, " << solver.seconds << " s, violation " << solver.violation << "\n";
  return found.solution.converged() ? kConverged : kNotConverged;
}

void addOptions(CLI::App& app, Arguments& arguments) {
  app.add_option("SOLVED", arguments.solved, "directory of a result of `bielle solve`, whose problem is solved again")
      ->required();
  app.add_option("-o,--output", arguments.output, "directory for the result, which `bielle check` and `view` read")
      ->required();
  app.add_option("--start", arguments.start,
                 "directory of a result to start from (default: SOLVED, the optimum itself)");
  app.add_option(
         "--transcription", arguments.options.transcription,
         "multiple-shooting of our steps, or collocation over all joints, closures being constraints of every node")
      ->transform(CLI::CheckedTransformer(
          std::map<std::string, IpoptTranscription>{{"multiple-shooting", IpoptTranscription::MultipleShooting},
                                                    {"collocation", IpoptTranscription::Collocation}}));
  app.add_option("--hessian", arguments.options.hessian, "gauss-newton or l-bfgs")
      ->transform(CLI::CheckedTransformer(std::map<std::string, IpoptHessian>{
          {"gauss-newton", IpoptHessian::GaussNewton}, {"l-bfgs", IpoptHessian::Lbfgs}}));
  app.add_option("--max-iterations", arguments.options.max_iterations)
      ->check(CLI::Range(1, 1000000))
      ->capture_default_str();
  app.add_option("--seconds", arguments.options.seconds, "of processor time, after which it ends with the iteration")
      ->check(CLI::PositiveNumber);
  app.add_option_function<std::vector<std::string>>(
         "--option",
         [&arguments](const std::vector<std::string>& settings) {
           for (const std::string& setting : settings) {
             const size_t equals = setting.find('=');
             if (equals == std::string::npos)
               throw CLI::ValidationError("--option", setting + " is not NAME=VALUE, e.g. tol=1e-8");
             arguments.options.settings.emplace_back(setting.substr(0, equals), setting.substr(equals + 1));
           }
         },
         "NAME=VALUE of an option of IPOPT; may be repeated")
      ->allow_extra_args(false);
  app.add_flag("--quiet", arguments.options.quiet, "do not print IPOPT's iterations");
  std::string footer = "Options of IPOPT that are not at their defaults:\n";
  for (const auto& [name, value] : listIpoptOptions()) footer += "  " + name + "=" + value + "\n";
  app.footer(footer + "Exit status: 0 converged, 1 not, 2 bad input.");
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{
      "Solves the problem of a solved motion with IPOPT, by direct multiple shooting or collocation with exact first "
      "derivatives."};
  app.name("bielle-ipopt");
  app.failure_message(bielle::cli::describeFailure);
  Arguments arguments;
  addOptions(app, arguments);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kConverged : kBadInput;
  }
  try {
    return run(arguments, std::vector<std::string>(argv, argv + argc));
  } catch (const InputError& error) {
    std::cerr << "bielle-ipopt: error: " << error.what() << std::endl;
  }
  return kBadInput;
}
