// bielle-loops: the benchmarks of the multibody field that have loops, in every engine.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <iostream>
#include <nlohmann/json.hpp>

#include "bielle/formats/reader.h"
#include "bielle/formats/robot_writer.h"
#include "bielle/model/error.h"
#include "loops/dynamics_time.h"
#include "loops/trial.h"
#include "results/number_option.h"

namespace {

using namespace bielle::loops;
using nlohmann::ordered_json;

struct Arguments {
  std::vector<std::string> problems, engines;
  TrialOptions trial;
  std::vector<double> settings, times;
  std::vector<std::string> robots;
  double run = 0.02;
  std::string directory;
};

ordered_json makeJson(const Problem& problem, const Engine& engine, const Trial& trial) {
  ordered_json errors = ordered_json::object();
  for (size_t i = 0; i < trial.errors.size(); ++i) errors[bielle::formatNumber(problem.times[i])] = trial.errors[i];
  return {{"problem", problem.name}, {"engine", engine.name}, {"setting", trial.setting},
          {"errors", errors},        {"cpu", trial.cpu},      {"gap", trial.gap},
          {"drift", trial.drift},    {"until", trial.until},  {"end", trial.end}};
}

// A line of JSON per trial, as soon as it is done.
int printTrials(const Arguments& arguments) {
  for (const std::string& name : arguments.problems.empty() ? listProblems() : arguments.problems) {
    const Problem problem = makeProblem(name);
    for (const Engine& engine : getEngines()) {
      const auto& chosen = arguments.engines;
      if (!chosen.empty() && std::find(chosen.begin(), chosen.end(), engine.name) == chosen.end()) continue;
      std::vector<Trial> trials;
      for (const double setting : arguments.settings)
        trials.push_back(runTrial(problem, engine, setting, arguments.trial));
      if (trials.empty()) trials = runTrials(problem, engine, arguments.trial);
      for (const Trial& trial : trials) std::cout << makeJson(problem, engine, trial) << std::endl;
    }
  }
  return 0;
}

int listAll() {
  ordered_json out = {{"problems", ordered_json::array()}, {"engines", ordered_json::array()}};
  for (const std::string& name : listProblems()) {
    const Problem problem = makeProblem(name);
    const bielle::Model& model = problem.model;
    ordered_json outputs = ordered_json::array();
    for (int i = 0; i < problem.judged; ++i) outputs.push_back(problem.outputs[i].name);
    out["problems"].push_back({{"name", name},
                               {"title", problem.title},
                               {"bodies", model.numBodies() - 1},
                               {"velocities", model.nv()},
                               {"rows", model.numClosureRows()},
                               {"duration", problem.duration},
                               {"times", problem.times},
                               {"judged", outputs},
                               {"invariant", problem.invariant}});
  }
  for (const Engine& engine : getEngines())
    out["engines"].push_back({{"name", engine.name}, {"title", engine.title}, {"setting", engine.setting}});
  std::cout << out.dump(2) << std::endl;
  return 0;
}

// The true motion.
int printMotion(const Arguments& arguments) {
  for (const std::string& name : arguments.problems) {
    const Problem problem = makeProblem(name);
    for (const double time : arguments.times.empty() ? problem.times : arguments.times) {
      const Motion motion = problem.calcMotion(time);
      const bielle::VectorXd outputs = problem.calcOutputs(motion.q, motion.v);
      ordered_json line = {{"problem", name}, {"time", time}};
      for (size_t i = 0; i < problem.outputs.size(); ++i)
        line[problem.outputs[i].name + " [" + problem.outputs[i].unit + "]"] = outputs[i];
      std::cout << line << std::endl;
    }
  }
  return 0;
}

int writeRobots(const Arguments& arguments) {
  for (const std::string& name : arguments.problems) {
    const std::string directory = arguments.directory.empty() ? name : arguments.directory + "/" + name;
    writeRobot(makeProblem(name).model, directory, "Written by `bielle-loops robot " + name + "`.");
    std::cout << directory << std::endl;
  }
  return 0;
}

// What the dynamics of robots cost.
int printTimes(const Arguments& arguments) {
  bielle::LoadOptions options;
  options.base = bielle::BaseKind::Fixed;
  for (const std::string& path : arguments.robots) {
    const bielle::Model model = bielle::loadRobot(path, options).model;
    const DynamicsTimes times = measureDynamics(model, arguments.run);
    std::cout << ordered_json{{"robot", model.name()},
                              {"bodies", model.numBodies() - 1},
                              {"velocities", model.nv()},
                              {"rows", model.numClosureRows()},
                              {"mobility", times.mobility},
                              {"accelerations", times.accelerations},
                              {"derivatives", times.derivatives},
                              {"step", times.step},
                              {"linearization", times.linearization}}
              << std::endl;
  }
  return 0;
}

void checkNames(const Arguments& arguments) {
  for (const std::string& name : arguments.engines) getEngine(name);
}

int run(int argc, char** argv) {
  CLI::App app{"The benchmarks of the multibody field that have loops, in every engine."};
  app.name("bielle-loops");
  app.require_subcommand(1);
  Arguments arguments;
  const std::string known = "fourbars_N, squeezer, bricard, slider_crank, spatial_fourbar, governor";
  CLI::App& list = *app.add_subcommand("list", "What there is, as JSON");
  CLI::App& trials = *app.add_subcommand("run", "Problems in engines: a line of JSON per trial");
  trials.add_option("PROBLEM", arguments.problems, known + "; all of them with two four-bars by default");
  trials.add_option("--engine", arguments.engines, "only these");
  trials.add_option("--setting", arguments.settings, "these instead of those of the engine from coarse to fine")
      ->check(bielle::isPositive());
  trials.add_option("--limit", arguments.trial.limit, "processor time of a trial, s")
      ->check(bielle::isPositive())
      ->capture_default_str();
  trials.add_option("--duration", arguments.trial.duration, "only that much of the motions, s")
      ->check(bielle::isPositive());
  CLI::App& motion = *app.add_subcommand("motion", "The true motion");
  motion.add_option("PROBLEM", arguments.problems, known)->required();
  motion.add_option("--at", arguments.times, "times, s")->check(bielle::isNotNegative());
  CLI::App& robot = *app.add_subcommand("robot", "The mechanisms as robots for `bielle`: directories of their names");
  robot.add_option("PROBLEM", arguments.problems, known)->required();
  robot.add_option("-o,--output", arguments.directory, "where they go");
  CLI::App& dynamics = *app.add_subcommand("dynamics", "What the dynamics of robots on a fixed base cost, s");
  dynamics.add_option("ROBOT", arguments.robots, "name, directory or file")->required();
  dynamics.add_option("--run", arguments.run, "processor time of one of ten runs, the least of which is told, s")
      ->check(bielle::isPositive())
      ->capture_default_str();
  bielle::requireFiniteNumbers(app);
  try {
    app.parse(argc, argv);
    checkNames(arguments);
    if (list.parsed()) return listAll();
    if (trials.parsed()) return printTrials(arguments);
    if (motion.parsed()) return printMotion(arguments);
    if (dynamics.parsed()) return printTimes(arguments);
    return writeRobots(arguments);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);
    std::cerr << "bielle: error: " << error.what() << std::endl;
    return 2;
  } catch (const bielle::InputError& error) {
    std::cerr << "bielle: error: " << error.what() << std::endl;
    return 2;
  } catch (const std::exception& error) {
    std::cerr << "bielle: error: " << error.what() << std::endl;
    return 1;
  }
}

}  // namespace

int main(int argc, char** argv) { return run(argc, argv); }
