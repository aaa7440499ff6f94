#include "cli/program.h"

#include <unistd.h>

#include <algorithm>
#include <exception>
#include <iostream>

#include "bielle/model/error.h"
#include "bielle/results/result.h"
#include "cli/help.h"
#include "formats/companion.h"
#include "formats/process.h"
#include "formats/yaml_entry.h"
#include "model/missing_part.h"
#include "results/number_option.h"
#include "results/standard_output.h"

namespace bielle::cli {
namespace {

int fail(std::string message, int status) {
  std::replace(message.begin(), message.end(), '\n', ' ');
  std::cerr << "bielle: error: " << message << std::endl;
  return status;
}

std::string describeVersion() {
  const BuildInfo build = getBuildInfo();
  return "bielle " + build.bielle + " (Eigen " + build.eigen + ", " + build.compiler + ")";
}

// Explains an error of the command line; for a missing or unknown command, motion or robot it lists the known ones.
std::string describe(const CLI::App& app, const CLI::ParseError& error, int argc, char** argv) {
  const CLI::App* last = &app;
  while (!last->get_subcommands().empty()) last = last->get_subcommands().back();
  std::string known;
  for (const CLI::App* command : last->get_subcommands([](const CLI::App*) { return true; }))
    known += (known.empty() ? "" : ", ") + command->get_name();
  if (known.empty()) return std::string(error.what()) + "; see --help";
  const std::vector<std::string> unknown = app.remaining(true);
  const char* const* named = std::find_first_of(argv + 1, argv + argc, unknown.begin(), unknown.end());
  const bool is_name = named != argv + argc && **named != '-';
  return (is_name ? "there is no '" + std::string(*named) + "'" : error.what()) + "; choose one of: " + known;
}

// All commands in the order of the help, and the companions that have them; the core has the others.
struct CommandEntry {
  const char *name, *help, *companion;
};
constexpr const char* kComplete = "bielle-complete";
constexpr CommandEntry kCommands[] = {
    {"solve", "Make a motion by optimal control", ""},
    {"report", "Show results as a page: replay in 3D, plots, tables", ""},
    {"view", "Show a robot as a page, with a slider for each motor", kComplete},
    {"export", "Write a trajectory in another program's format", kComplete},
    {"convert", "Write a robot in another format", kComplete},
    {"adopt", "Complete a published robot: feet, soles, posture, motors", kComplete},
    {"info", "Describe a robot: joints, closures, motors, feet, mobility", ""},
    {"eval", "Compute accelerations, forces and derivatives at one state", kComplete},
    {"robots", "List the robots known by name", ""},
    {"generate", "Generate a robot from named lengths, angles and masses", kComplete},
    {"design", "Choose lengths of a robot by optimization over its motions", "bielle-design"},
    {"compare", "Compare robots that make the same motions, side by side", "bielle-tasks"},
    {"ratio", "Reduction ratio between motors and a joint along its range", kComplete},
    {"modes", "Frequencies, damping and shapes of small motions about a posture", kComplete},
    {"softness", "How far MuJoCo's loops open, and the settings that keep them closed", kComplete},
    {"identify", "Find lengths, offsets of encoders, masses and friction from a log", "bielle-identify"},
    {"synthesize", "Find linkages that move a joint as requested", "bielle-design"},
    {"lift", "Lift a motion of the serial model to the closed robot", kComplete},
    {"campaign", "Execute motions many times: pushes, grounds, worlds, seeds", "bielle-tasks"},
    {"dataset", "Make many motions, checked and exported, with an index", "bielle-tasks"},
    {"bench", "Measure speed: per node, whole solves, receding horizon, scaling", "bielle-bench"},
    {"validate", "Compare the dynamics with Simbody's (see bielle validate --help)", "bielle-validate"},
    {"check", "Check a motion's files with Simbody (see bielle check --help)", "bielle-check"},
    {"simulate", "Execute a motion in a physics simulation with contact (see bielle simulate --help)",
     "bielle-simulate"},
};

const CommandEntry* findCommand(const std::string& name) {
  const auto entry = std::find_if(std::begin(kCommands), std::end(kCommands),
                                  [&name](const CommandEntry& command) { return command.name == name; });
  return entry == std::end(kCommands) ? nullptr : entry;
}

bool asksForHelp(int argc, char** argv) {
  return std::any_of(argv, argv + argc, [](const std::string& word) { return word == "--help" || word == "-h"; });
}

// These have main functions of their own, which get the arguments alone.
bool isAlone(const std::string& program) {
  return program == "bielle-check" || program == "bielle-simulate" || program == "bielle-validate";
}

// Replaces this process by another program; returns only on failure. `arguments` begins with a name and ends with a null pointer.
int become(const std::string& program, char** arguments) {
  if (const std::string path = obtainCompanion(program); !path.empty()) execvp(path.c_str(), arguments);
  return fail(describeMissingCompanion(program), kBadInput);
}

int becomeCompanion(const CommandEntry& command, int argc, char** argv) {
  const std::string program = command.companion;
  if (asksForHelp(argc, argv) && findCompanion(program) == program)  // asking for help builds nothing
    if (const std::string* help = findHelp({argv + 1, argv + argc})) {
      std::cout << *help;
      return kOk;
    }
  return become(program, isAlone(program) ? argv + 1 : argv);
}

void addCommands(CLI::App& app, const std::vector<OwnCommand>& commands, Action& action) {
  for (const CommandEntry& entry : kCommands) {
    CLI::App& command = *app.add_subcommand(entry.name, entry.help);
    for (const OwnCommand& own : commands)
      if (own.name == std::string(entry.name)) own.add(command, action);
  }
}

int run(int argc, char** argv, const std::vector<OwnCommand>& commands) {
  setCommandLine(argc, argv);
  if (argc == 2 &&
      argv[1] == std::string("--yaml-keys")) {  // of this program alone: scripts/update_help.sh puts them together
    std::cout << describeYamlKeys();
    return kOk;
  }
  if (const CommandEntry* command = argc > 1 ? findCommand(argv[1]) : nullptr)
    if (std::none_of(commands.begin(), commands.end(),
                     [&](const OwnCommand& own) { return own.name == std::string(argv[1]); }))
      return becomeCompanion(*command, argc, argv);

  CLI::App app{"Legged robots driven through linkages: dynamics, and motions by optimal control."};
  app.name("bielle");
  app.set_version_flag("--version", describeVersion());
  app.footer(
      "Examples:\n"
      "  bielle robots\n"
      "  bielle info bipetto\n"
      "  bielle solve squat --robot bipetto --depth 0.7 -o squat\n"
      "Each command has its own --help. Exit status: 0 done, 1 not converged or a failed check, 2 bad input.");
  Action action;
  addCommands(app, commands, action);
  requireFiniteNumbers(app);
  app.callback([&action] {
    if (!action) throw CLI::RequiredError("A command");
  });
  try {
    app.parse(argc, argv);
    return action();
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);
    return fail(describe(app, error, argc, argv), kBadInput);
  } catch (const MissingPart&) {
    return become(kComplete, argv);
  } catch (const InputError& error) {
    return fail(error.what(), kBadInput);
  } catch (const std::exception& error) {
    return fail(error.what(), kFailed);
  }
}

}  // namespace

std::optional<int> runCompanion(const std::string& name, std::vector<std::string> arguments) {
  const std::string program = obtainCompanion(name);
  const auto fail = [&name](const std::string& why) {
    std::cerr << "bielle: error: " << name << " " << why << std::endl;
    return kFailed;
  };
  if (program.empty()) return {};
  arguments.insert(arguments.begin(), program);
  std::cout.flush();
  const int status = waitForProcess(startProcess(arguments));
  if (status == kNotStarted) return fail("cannot be started");
  if (status > kSignalled) return fail("was terminated by signal " + std::to_string(status - kSignalled));
  return status;
}

int runProgram(int argc, char** argv, const std::vector<OwnCommand>& commands) {
  ignoreClosedPipes();
  const int status = run(argc, argv, commands);
  try {
    finishStandardOutput();
  } catch (const InputError& error) {
    if (status == kOk) return fail(error.what(), kBadInput);
  }
  return status;
}

}  // namespace bielle::cli
