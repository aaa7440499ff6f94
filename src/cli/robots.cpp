// bielle robots: the known names and their files.
#include <iostream>

#include "cli/commands.h"
#include "cli/table.h"

namespace bielle::cli {
namespace {

int listKnownRobots() {
  const std::vector<std::string> directories = getRobotDirectories();
  std::vector<Row> rows;
  for (const std::string& name : listRobots()) rows.push_back({name, findRobotFile(name)});
  printTable(std::cout, rows, "");
  if (!rows.empty()) return kOk;
  std::cerr << "bielle: no robots found in:\n";
  for (const std::string& directory : directories) std::cerr << "  " << directory << "\n";
  return kFailed;
}

}  // namespace

void addRobots(CLI::App& command, Action& action) {
  command.footer(
      "Robots are sought in the directories of $BIELLE_ROBOTS (separated by colons), then in those of Bielle.\n"
      "Examples:\n"
      "  bielle robots\n"
      "  BIELLE_ROBOTS=$HOME/robots bielle robots");
  command.callback([&action] { action = listKnownRobots; });
}

}  // namespace bielle::cli
