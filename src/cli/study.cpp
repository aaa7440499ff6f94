// bielle study: the paper's comparison, case by case.
#include <iostream>
#include <sstream>

#include "bielle/io/result.h"
#include "bielle/model/error.h"
#include "cli/case_run.h"
#include "cli/commands.h"
#include "study/report.h"

namespace bielle::cli {
namespace {

using namespace bielle::study;

struct StudyArguments {
  std::string name, directory = "study", robot = "bipetto";
  std::vector<double> values;
  TaskArguments tasks;
};

std::vector<Study> chooseStudies(const StudyArguments& arguments) {
  std::vector<Study> chosen;
  for (const Study& study : getStudies())
    if (arguments.name == "all" || arguments.name == study.name) chosen.push_back(study);
  if (arguments.values.empty()) return chosen;
  if (arguments.name == "all" || chosen[0].motion.empty())
    throw ModelError("", "--values", "'" + arguments.name + "' is not a study of one parameter",
                     "give values to squat, speed, walk, stairs or jump");
  chosen[0].values = arguments.values;
  return chosen;
}

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
  std::string text = "bielle study " + arguments.name + " --robot " + arguments.robot;
  if (!arguments.values.empty()) text += " --values";
  for (const double value : arguments.values) {
    std::ostringstream number;
    number << value;
    text += " " + number.str();
  }
  return text;
}

int run(const StudyArguments& arguments) {
  const std::vector<Study> studies = chooseStudies(arguments);
  const ComparedRobot robot = loadComparedRobot(arguments.robot);
  makeOutputDirectory(arguments.directory);
  CaseRun cases{arguments.directory + "/cases", {}, {robot.robot.directory}, arguments.tasks};
  for (const Study& study : studies)
    for (const Case& one : makeCases(study, arguments.robot)) cases.cases.push_back(one);
  return runAndWrite(cases, [&](const CaseOutcomes& outcomes) {
    std::vector<StudyPage> pages;
    for (const Study& study : studies) {
      pages.push_back(writeStudy(arguments.directory, readStudy(study, robot, cases.directory, outcomes), robot));
      printPaths(pages.back().files, pages.back().notes);
    }
    if (arguments.name == "all")
      std::cout << "  " << writeReport(arguments.directory, arguments.robot, describeCommand(arguments), pages) << "\n";
  });
}

}  // namespace

void addStudy(CLI::App& app, Action& action) {
  CLI::App& command = *app.add_subcommand("study", "Reproduce the paper's comparison of closed and serial models");
  const auto arguments = std::make_shared<StudyArguments>();
  std::vector<std::string> names = {"all"};
  std::string list;
  for (const Study& study : getStudies()) {
    names.push_back(study.name);
    list +=
        "  " + study.name + std::string(10 - study.name.size(), ' ') + study.title + " (section " + study.section + ")";
    if (study.values.size() > 1) {
      std::ostringstream range;
      range << ": " << study.parameter << " " << study.values.front() << " to " << study.values.back() << ", "
            << study.values.size() << " values";
      list += range.str();
    }
    list += "\n";
  }
  command.add_option("NAME", arguments->name, "one of the studies below, or all")
      ->required()
      ->check(CLI::IsMember(names));
  command.add_option("-o,--output", arguments->directory, "directory for NAME.csv, NAME.md, figures and cases/")
      ->capture_default_str();
  addTaskOptions(command, "cases at a time, each in its own process", arguments->tasks);
  command
      .add_option("--robot", arguments->robot,
                  "name, directory, .urdf, .yaml or MuJoCo .xml file of a robot with an approximate serial model")
      ->capture_default_str();
  command.add_option("--values", arguments->values, "values of the parameter of one study, instead of its own");
  command.footer("Studies:\n" + list +
                 "Every motion is solved twice: with the closed model, and with the approximate serial model, then "
                 "lifted to the closed\n"
                 "one. Each case runs in its own process. Finished cases are kept: after Ctrl-C, a crash or a change "
                 "of --values,\n"
                 "run the same command again for the missing ones. A motion that does not converge or cannot be lifted "
                 "is a result.\n"
                 "Exit status: 0 done, 1 interrupted or a case failed, 2 bad input.\n"
                 "Examples:\n"
                 "  bielle study squat -o study --jobs 2\n"
                 "  bielle study squat --values 0.6 0.62 0.64\n"
                 "  bielle study all");
  command.callback([&action, arguments] { action = [=] { return run(*arguments); }; });
}

}  // namespace bielle::cli
