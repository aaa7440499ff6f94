// bielle report DIR...: the page of one or several results.
#include "bielle/report/report.h"

#include <filesystem>
#include <iostream>
#include <memory>

#include "cli/commands.h"

namespace bielle::cli {
namespace {

struct ReportArguments {
  std::vector<std::string> directories;
  std::string output;
};

int report(const ReportArguments& arguments) {
  const auto first = std::filesystem::path(arguments.directories.front());
  const std::string path = arguments.output.empty() ? (first / "report.html").string() : arguments.output;
  writeReport(path, arguments.directories);
  std::cout << path << "\n";
  return kOk;
}

}  // namespace

void addReport(CLI::App& app, Action& action) {
  CLI::App& command = *app.add_subcommand("report", "Show results as a page: replay in 3D, plots, tables");
  const auto arguments = std::make_shared<ReportArguments>();
  command.add_option("directories", arguments->directories, "of `bielle solve`; several are compared")->required();
  command.add_option("-o,--output", arguments->output, "the page; default: report.html in the first directory");
  command.footer(
      "The page holds all it needs: open it with a browser, send it to others, no network. Space plays and pauses.\n"
      "Examples:\n"
      "  bielle report squat\n"
      "  bielle report squat-closed squat-serial -o comparison.html");
  command.callback([&action, arguments] { action = [=] { return report(*arguments); }; });
}

}  // namespace bielle::cli
