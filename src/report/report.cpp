#include "bielle/report/report.h"

#include <filesystem>
#include <map>

#include "bielle/model/error.h"
#include "bielle/results/result.h"
#include "formats/text_file.h"
#include "report/page.h"
#include "report/run.h"

namespace fs = std::filesystem;

namespace bielle {
namespace {

// The shortest ends of the paths that distinguish them.
std::vector<std::string> makeLabels(const std::vector<std::string>& directories) {
  std::vector<fs::path> paths, labels;
  for (const std::string& directory : directories) {
    paths.push_back(fs::absolute(directory).lexically_normal());
    if (!paths.back().has_filename()) paths.back() = paths.back().parent_path();
    labels.push_back(paths.back().filename());
    paths.back() = paths.back().parent_path();
  }
  for (bool is_clear = false; !is_clear;) {
    std::map<fs::path, std::vector<size_t>> uses;
    for (size_t i = 0; i < labels.size(); ++i) uses[labels[i]].push_back(i);
    is_clear = true;
    for (const auto& [label, indices] : uses)
      for (size_t i : indices)
        if (indices.size() > 1 && paths[i].has_filename()) {
          labels[i] = paths[i].filename() / labels[i];
          paths[i] = paths[i].parent_path();
          is_clear = false;
        }
  }
  return {labels.begin(), labels.end()};
}

}  // namespace

std::string makeReport(const std::vector<std::string>& directories) {
  if (directories.empty())
    throw InputError("", "report", "no directories are given", "give one that `bielle solve` wrote");
  const std::vector<std::string> labels = makeLabels(directories);
  Json runs = Json::array();
  for (size_t i = 0; i < directories.size(); ++i) {
    const ReportRun run = readRun(directories[i]);
    runs.push_back({{"label", labels[i]},
                    {"summary", run.summary},
                    {"check", run.check},
                    {"robot", describeRobot(run.robot)},
                    {"motion", describeMotion(run)},
                    {"plan", describePlan(run)}});
  }
  return makePage({{"bielle", getBuildInfo().bielle}, {"runs", runs}});
}

void writeReport(const std::string& path, const std::vector<std::string>& directories) {
  writeTextFile(path, makeReport(directories));
}

}  // namespace bielle
