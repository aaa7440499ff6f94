#include <filesystem>
#include <map>

#include "bielle/io/result.h"
#include "bielle/model/error.h"
#include "bielle/report/report.h"
#include "io/aside_file.h"
#include "report/assets.h"
#include "report/run.h"

namespace fs = std::filesystem;

namespace bielle {
namespace {

// Text of JSON that may stand inside <script>: no element can begin or end in it.
std::string formatInline(const Json& json) {
  const std::string text = json.dump(-1, ' ', true, Json::error_handler_t::replace);
  std::string out;
  out.reserve(text.size());
  for (char c : text) {
    if (c == '<')
      out += "\\u003c";
    else
      out += c;
  }
  return out;
}

// A script that stands inside <script>.
std::string guardScript(std::string script) {
  for (size_t at = 0; (at = script.find("</script", at)) != std::string::npos; at += 2) script.insert(at + 1, "\\");
  return script;
}

// `name` between <!--{ and }--> in the page stands for a text.
std::string fillPage(const std::string& page, const std::map<std::string, std::string>& texts) {
  static const std::string kOpen = "<!--{", kClose = "}-->";
  std::string out;
  size_t at = 0;
  for (size_t open; (open = page.find(kOpen, at)) != std::string::npos;) {
    const size_t close = page.find(kClose, open);
    out.append(page, at, open - at);
    out += texts.at(page.substr(open + kOpen.size(), close - open - kOpen.size()));
    at = close + kClose.size();
  }
  return out.append(page, at);
}

std::string makePage(const Json& data) {
  std::map<std::string, std::string> texts = {{"style", getAsset("style.css")}, {"data", formatInline(data)}};
  for (const char* library : {"three.min.js", "OrbitControls.js", "STLLoader.js", "dygraph.min.js"})
    texts["libraries"] += "<script>" + guardScript(getAsset(library)) + "</script>\n";
  for (const char* script : {"data.js", "robot.js", "scene.js", "camera.js", "transport.js", "plot.js", "plots.js",
                             "tables.js", "film.js", "main.js"})
    texts["scripts"] += "<script>" + guardScript(getAsset(script)) + "</script>\n";
  return fillPage(getAsset("page.html"), texts);
}

// Enough of the ends of the paths to tell them apart.
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
    throw ModelError("", "report", "no directory is given", "give one that `bielle solve` wrote");
  const std::vector<std::string> labels = makeLabels(directories);
  Json runs = Json::array();
  for (size_t i = 0; i < directories.size(); ++i) {
    const ReportRun run = readRun(directories[i]);
    runs.push_back({{"label", labels[i]},
                    {"summary", run.summary},
                    {"check", run.check},
                    {"robot", describeRobot(run.robot)},
                    {"motion", describeMotion(run)}});
  }
  return makePage({{"bielle", getBuildInfo().bielle}, {"runs", runs}});
}

void writeReport(const std::string& path, const std::vector<std::string>& directories) {
  const std::string page = makeReport(directories);
  AsideFile file(path);
  file.write(page);
  file.commit();
}

}  // namespace bielle
