// bielle-paper: the comparison of "Optimal Control of Walkers with Parallel Actuation", repeated.
#include <unistd.h>

#include <filesystem>
#include <iostream>

#include "bielle/model/error.h"
#include "paper/commands.h"
#include "results/number_option.h"

namespace {

using namespace bielle::paper;

int fail(const std::string& message, int status) {
  std::cerr << "bielle: error: " << message << std::endl;
  return status;
}

// The command `bielle` beside this program takes its place.
int becomeBielle(char** argv) {
  const std::string program = std::filesystem::read_symlink("/proc/self/exe").parent_path() / "bielle";
  execv(program.c_str(), argv);
  return fail(program + " cannot be started", 2);
}

int run(int argc, char** argv) {
  CLI::App app{"The comparison of closed and serial models in \"Optimal Control of Walkers with Parallel Actuation\"."};
  app.name("bielle-paper");
  app.footer("All other commands are those of `bielle`, so that each run of a study is one of this program.");
  Action action;
  addStudy(app, action);
  addMotions(app, action);
  addLift(app, action);
  bielle::requireFiniteNumbers(app);
  app.require_subcommand(1);
  const std::string first = argc > 1 ? argv[1] : "-";
  const auto own = app.get_subcommands([&first](const CLI::App* command) { return command->get_name() == first; });
  if (first[0] != '-' && own.empty()) return becomeBielle(argv);
  try {
    app.parse(argc, argv);
    return action({argv, argv + argc});
  } catch (const CLI::ParseError& error) {
    return error.get_exit_code() == 0 ? app.exit(error) : fail(error.what(), 2);
  } catch (const bielle::InputError& error) {
    return fail(error.what(), 2);
  } catch (const std::exception& error) {
    return fail(error.what(), 1);
  }
}

}  // namespace

int main(int argc, char** argv) { return run(argc, argv); }
