#include "report/page.h"

#include <map>
#include <vector>

#include "bielle/results/result.h"
#include "report/assets.h"

namespace bielle {
namespace {

// JSON text that is safe inside <script>: no element can begin or end in it.
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

// A script that is safe inside <script>.
std::string guardScript(std::string script) {
  for (size_t at = 0; (at = script.find("</script", at)) != std::string::npos; at += 2) script.insert(at + 1, "\\");
  return script;
}

// Replaces `name` between <!--{ and }--> in the page by a text.
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

std::string joinScripts(const std::vector<const char*>& names) {
  std::string out;
  for (const char* name : names) out += "<script>" + guardScript(getAsset(name)) + "</script>\n";
  return out;
}

std::string makeHead(const std::string& style) { return fillPage(getAsset("head.html"), {{"style", style}}); }

}  // namespace

std::string makePage(const Json& data) {
  std::map<std::string, std::string> texts = {{"head", makeHead(getAsset("style.css"))}, {"data", formatInline(data)}};
  texts["libraries"] = joinScripts({"three.min.js", "OrbitControls.js", "STLLoader.js", "dygraph.min.js"});
  texts["scripts"] =
      joinScripts({"data.js", "shapes.js", "robot.js", "scene.js", "camera.js", "transport.js", "plot.js", "plots.js",
                   "tables.js", "film.js", "view.js", "modes.js", "live.js", "main.js"});
  return fillPage(getAsset("page.html"), texts);
}

std::string makeDesignPage(Json data) {
  data["bielle"] = getBuildInfo().bielle;
  return fillPage(getAsset("designs.html"), {{"head", makeHead(getAsset("style.css") + getAsset("designs.css"))},
                                             {"data", formatInline(data)},
                                             {"scripts", joinScripts({"data.js", "tables.js", "designs.js"})}});
}

std::string makeDatasetPage(const Json& data) {
  return fillPage(getAsset("dataset.html"), {{"head", makeHead(getAsset("style.css") + getAsset("dataset.css"))},
                                             {"data", formatInline(data)},
                                             {"scripts", joinScripts({"data.js", "dataset.js"})}});
}

}  // namespace bielle
