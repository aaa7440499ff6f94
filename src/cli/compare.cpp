// bielle compare: robots on the same motions, side by side.
#include "bielle/results/result.h"
#include "cli/case_run.h"
#include "cli/commands.h"
#include "tasks/architecture_report.h"

namespace bielle::cli {
namespace {

using namespace bielle::tasks;

struct CompareArguments {
  std::string spec, directory;
  TaskArguments tasks;
};

// A motion that is also one of the speeds makes the same case.
std::vector<Case> makeCases(const ArchitectureSpec& spec, const std::vector<Contender>& contenders) {
  std::vector<Case> cases;
  for (const Contender& contender : contenders)
    for (const auto* motions : {&spec.motions, &spec.speeds})
      for (const MotionSpec& motion : *motions) cases.push_back(makeArchitectureCase(contender, motion));
  return cases;
}

ArchitectureResults readResults(const ArchitectureSpec& spec, const std::vector<Contender>& contenders,
                                const std::string& directory, const CaseOutcomes& outcomes) {
  ArchitectureResults results;
  for (const Contender& contender : contenders) {
    const auto readAll = [&](const std::vector<MotionSpec>& motions) {
      std::vector<Feat> feats;
      for (const MotionSpec& motion : motions) {
        const std::string name = makeArchitectureCase(contender, motion).name;
        feats.push_back(readFeat(spec, contender, directory + "/" + name + "/" + kMotion, outcomes.at(name)));
      }
      return feats;
    };
    results.motions.push_back(readAll(spec.motions));
    results.speeds.push_back(readAll(spec.speeds));
  }
  return results;
}

int run(const CompareArguments& arguments) {
  const ArchitectureSpec spec = readArchitectureSpec(arguments.spec);
  makeOutputDirectory(arguments.directory);
  const std::vector<Contender> contenders = makeContenders(spec, arguments.directory + "/robots");
  CaseRun cases{arguments.directory + "/cases", makeCases(spec, contenders), {}, arguments.tasks};
  for (const Contender& contender : contenders) cases.robots.push_back(contender.directory);
  return runAndWrite(cases, [&](const CaseOutcomes& outcomes) {
    std::vector<std::string> notes;
    const ArchitectureResults results = readResults(spec, contenders, cases.directory, outcomes);
    const std::vector<std::string> paths = writeArchitectures(arguments.directory, spec, contenders, results, notes);
    printPaths(paths, notes);
  });
}

}  // namespace

void addCompare(CLI::App& command, Action& action) {
  const auto arguments = std::make_shared<CompareArguments>();
  command.add_option("SPEC", arguments->spec, "YAML file: robots, their mass, motions, speeds, groups of motors")
      ->required();
  command
      .add_option("-o,--output", arguments->directory,
                  "directory for compare.md, compare.csv, figures, robots/ and cases/; created if necessary")
      ->required();
  addTaskOptions(command, "cases at a time, each in its own process", arguments->tasks);
  command.footer(
      "SPEC:\n"
      "  robots:                         (name: a robot, or a generator with its parameters)\n"
      "    bipetto: {robot: bipetto}\n"
      "    cleobot: {generator: cleobot, set: {hip_height: 0.48}}\n"
      "  mass: 25.7                      (kg, of every robot, by changing its trunk; default: unchanged)\n"
      "  motions:\n"
      "    - {motion: squat, set: {depth: 0.6}}\n"
      "    - {motion: walk, set: {speed: 0.5}}\n"
      "  speeds: {motion: walk, option: speed, from: 0.3, to: 1.0, step: 0.1}\n"
      "  groups: {hips: [hip], knees and ankles: [knee, ankle, leg]}     (motors by parts of their names)\n"
      "  drives: {motor_constant: 2, regeneration: 0}     (N m/sqrt(W) at the joints, by default by the windings; "
      "share\n"
      "                                                    given back)\n"
      "Peak and rms torques by group, power, mechanical and electrical energy, cost of transport; of the speeds, the\n"
      "largest whose motion converges, meets its goals and passes `bielle check`. Each case runs in its own process;\n"
      "finished cases are kept: after Ctrl-C or a crash, run the same command again to continue.\n"
      "Exit status: 0 done, 1 interrupted or a case failed, 2 bad input.\n"
      "Example:\n"
      "  bielle compare examples/architectures/architectures.yaml -o architectures");
  command.callback([&action, arguments] { action = [=] { return run(*arguments); }; });
}

}  // namespace bielle::cli
