// bielle-paper study: the paper's comparison, case by case.
#include <algorithm>
#include <filesystem>
#include <iostream>
#include <map>
#include <thread>

#include "bielle/model/error.h"
#include "bielle/results/result.h"
#include "model/number_text.h"
#include "paper/commands.h"
#include "paper/report.h"
#include "tasks/local_tasks.h"

namespace fs = std::filesystem;

namespace bielle::paper {
namespace {

struct StudyArguments {
  std::string name, directory = "study", robot = "bipetto";
  std::vector<double> values;
  int jobs = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
};

std::vector<Study> chooseStudies(const StudyArguments& arguments) {
  std::vector<Study> chosen;
  for (const Study& study : getStudies())
    if (arguments.name == "all" || arguments.name == study.name) chosen.push_back(study);
  if (arguments.values.empty()) return chosen;
  if (arguments.name == "all" || chosen[0].motion.empty())
    throw InputError("", "--values", "'" + arguments.name + "' is not a study of one parameter",
                     "give values to squat, speed, walk, stairs or jump");
  chosen[0].values = arguments.values;
  return chosen;
}

using CaseOutcomes = std::map<std::string, tasks::CaseOutcome>;  // by the name of the case

StudyResult readStudy(const Study& study, const ComparedRobot& robot, const std::string& directory,
                      const CaseOutcomes& outcomes) {
  StudyResult result{study, {}, {}};
  for (const double value : study.values)
    result.comparisons.push_back(readComparison(study, value, robot, directory,
                                                outcomes.at(makeClosedCase(study, value, "").name),
                                                outcomes.at(makeSerialCase(study, value, "").name)));
  if (study.motion.empty()) result.ratio = readRatio(directory + "/" + makeRatioCase("").name + "/" + kRatio);
  return result;
}

std::string describeCommand(const StudyArguments& arguments) {
  std::string text = "bielle-paper study " + arguments.name + " --robot " + arguments.robot;
  if (!arguments.values.empty()) text += " --values";
  for (const double value : arguments.values) text += formatNumber(value, " %.6g");
  return text;
}

// What results depend on: the robot, and both programs.
std::string makeIdentity(const fs::path& program, const std::string& robot) {
  std::vector<fs::path> files = tasks::listRobotFiles(robot);
  files.push_back(program);
  files.push_back(program.parent_path() / "bielle");
  return tasks::makeIdentity(files);
}

int run(const StudyArguments& arguments) {
  const std::vector<Study> studies = chooseStudies(arguments);
  const ComparedRobot robot = loadComparedRobot(arguments.robot);
  makeOutputDirectory(arguments.directory);
  std::vector<tasks::Case> cases;
  for (const Study& study : studies)
    for (const tasks::Case& one : makeCases(study, arguments.robot))
      if (std::none_of(cases.begin(), cases.end(), [&](const auto& other) { return other.name == one.name; }))
        cases.push_back(one);
  const std::string directory = arguments.directory + "/cases";
  tasks::RunOptions options;
  options.program = fs::read_symlink("/proc/self/exe");
  options.identity = makeIdentity(options.program, robot.robot.directory);
  options.progress = [](const std::string& line) { std::cout << line << std::endl; };
  tasks::LocalTasks engine(arguments.jobs);
  options.engine = &engine;
  const tasks::RunOutcome outcome = tasks::runCases(directory, cases, options);
  if (outcome.interrupted) {
    std::cerr << "bielle: error: interrupted; run the same command again to continue" << std::endl;
    return 1;
  }
  CaseOutcomes outcomes;
  bool complete = true;
  for (size_t i = 0; i < cases.size(); ++i) {
    outcomes[cases[i].name] = outcome.cases[i];
    complete &= outcome.cases[i].complete;
  }
  std::vector<StudyPage> pages;
  for (const Study& study : studies) {
    pages.push_back(writeStudy(arguments.directory, readStudy(study, robot, directory, outcomes), robot));
    for (const std::string& path : pages.back().files) std::cout << "  " << path << "\n";
    for (const std::string& note : pages.back().notes) std::cerr << "bielle: warning: " << note << "\n";
  }
  if (arguments.name == "all")
    std::cout << "  " << writeReport(arguments.directory, arguments.robot, describeCommand(arguments), pages) << "\n";
  if (!complete) std::cerr << "bielle: error: some cases failed; run the same command again to retry them" << std::endl;
  return complete ? 0 : 1;
}

}  // namespace

void addStudy(CLI::App& app, Action& action) {
  CLI::App& command = *app.add_subcommand("study", "Every motion with both models, and the paper's claims about them");
  const auto arguments = std::make_shared<StudyArguments>();
  std::vector<std::string> names = {"all"};
  std::string list;
  for (const Study& study : getStudies()) {
    names.push_back(study.name);
    list +=
        "  " + study.name + std::string(10 - study.name.size(), ' ') + study.title + " (section " + study.section + ")";
    if (study.values.size() > 1)
      list += ": " + study.parameter + formatNumber(study.values.front(), " %.6g to ") +
              formatNumber(study.values.back(), "%.6g, ") + std::to_string(study.values.size()) + " values";
    list += "\n";
  }
  command.add_option("NAME", arguments->name, "one of the studies below, or all")
      ->required()
      ->check(CLI::IsMember(names));
  command.add_option("-o,--output", arguments->directory, "directory for NAME.csv, NAME.md, figures and cases/")
      ->capture_default_str();
  command.add_option("--jobs", arguments->jobs, "cases at a time, each in its own process")
      ->check(CLI::Range(1, 1024))
      ->capture_default_str();
  command
      .add_option("--robot", arguments->robot, "name, directory or file of a robot with an approximate serial model")
      ->capture_default_str();
  command.add_option("--values", arguments->values, "values of the parameter of one study, instead of its own");
  command.footer("Studies:\n" + list +
                 "Every motion is solved twice: with the closed model, and with the approximate serial model, then "
                 "lifted to the closed\n"
                 "one. Finished cases are kept: after Ctrl-C, a crash or a change of --values, run the same command "
                 "again for the missing\n"
                 "ones. A motion that does not converge or cannot be lifted is a result.\n"
                 "Examples:\n"
                 "  bielle-paper study squat -o study --jobs 2\n"
                 "  bielle-paper study squat --values 0.6 0.62 0.64\n"
                 "  bielle-paper study all");
  command.callback([&action, arguments] { action = [=](const CommandLine&) { return run(*arguments); }; });
}

}  // namespace bielle::paper
