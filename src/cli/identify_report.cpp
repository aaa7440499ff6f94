#include "cli/identify_report.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <ostream>

#include "cli/table.h"
#include "formats/text_file.h"
#include "results/plot.h"

namespace fs = std::filesystem;

namespace bielle::cli {
namespace {

constexpr Eigen::Index kMostPoints = 600;  // of a curve

// Without the sign of a zero.
std::string format(double value, const char* as = "%.6f") {
  const std::string text = formatNumber(value, as);
  return text.find_first_of("123456789") == std::string::npos ? formatNumber(0, as) : text;
}

std::vector<Row> listRows(const Estimate& estimate) {
  std::vector<Row> rows = {{"", "unit", "before", "after", "change", "+-"}};
  for (const Unknown& unknown : estimate.unknowns) {
    const bool is_offset = unknown.kind == "offset",
               is_place = is_offset || unknown.kind == "length" || unknown.kind == "play";
    const char *const as = is_place ? "%.6f" : "%.5g", *const change = is_place ? "%+.6f" : "%+.3g";
    Row row = {unknown.name + (is_offset ? ", offset" : ""), unknown.unit, format(unknown.before, as), "not seen"};
    if (unknown.is_seen) {
      row.back() = format(unknown.after, as);
      row.push_back(format(unknown.after - unknown.before, change));
      row.push_back(formatNumber(unknown.deviation, "%.1e"));
    }
    rows.push_back(std::move(row));
  }
  return rows;
}

// The misfit, and what is not seen.
std::vector<std::string> listLines(const Estimate& estimate, const std::string& unit) {
  std::vector<std::string> lines = {"misfit " + formatNumber(estimate.misfit_before, "%.3g") + " -> " +
                                    formatNumber(estimate.misfit_after, "%.3g") + " " + unit};
  for (const Combination& combination : estimate.unseen) {
    std::string text;
    for (const auto& [name, share] : combination)
      text += (text.empty() ? "" : ", ") + name + " by " + formatNumber(share, "%.3g");
    lines.push_back("not seen: " +
                    (combination.size() == 1 ? combination.front().first : "changes of " + text + ", together"));
  }
  return lines;
}

constexpr const char *kOfColumns = "rad or m", *kOfTorques = "of the torques";

std::string formatTitle(const Identified& found) {
  return "linkage of " + found.task->name + ": " + std::to_string(found.rows) + " rows, " + found.estimate.message;
}
std::string formatTitle(const IdentifiedLoads& found) {
  return "torques: " + std::to_string(found.instants) + " instants, " + found.estimate.message;
}

// What is alike in both.
Json describe(const Estimate& estimate) {
  Json unknowns = Json::array(), unseen = Json::array();
  for (const Unknown& unknown : estimate.unknowns) {
    Json one = {{"name", unknown.name}, {"kind", unknown.kind}, {"unit", unknown.unit}};
    one["before"] = unknown.before;
    one["after"] = unknown.is_seen ? Json(unknown.after) : Json();
    one["deviation"] = unknown.is_seen ? Json(unknown.deviation) : Json();
    one["seen"] = unknown.is_seen;
    unknowns.push_back(std::move(one));
  }
  for (const Combination& combination : estimate.unseen) {
    Json one = Json::object();
    for (const auto& [name, share] : combination) one[name] = share;
    unseen.push_back(std::move(one));
  }
  return {{"unknowns", unknowns},
          {"not_seen", unseen},
          {"misfit_before", estimate.misfit_before},
          {"misfit_after", estimate.misfit_after},
          {"noise_over_assumed", estimate.noise},
          {"iterations", estimate.iterations},
          {"converged", estimate.converged},
          {"ended", estimate.message}};
}

void print(std::ostream& out, const std::string& title, const Estimate& estimate, const char* unit) {
  out << title << "\n";
  printTable(out, listRows(estimate));
  for (const std::string& line : listLines(estimate, unit)) out << "  " << line << "\n";
}

std::string escape(const std::string& text) {
  std::string out;
  for (const char c : text) out += c == '<' ? "&lt;" : c == '&' ? "&amp;" : c == '>' ? "&gt;" : std::string(1, c);
  return out;
}

// What is left of each column over time.
std::vector<Plot> makePlots(const Identified& found) {
  std::vector<Plot> plots;
  const Eigen::Index step = (found.time.size() - 1) / kMostPoints + 1;
  for (size_t s = 0; s < found.sensors.size(); ++s) {
    const LinkageSensor& sensor = found.sensors[s];
    Plot plot{sensor.name, "time [s]", sensor.is_length ? "left [m]" : "left [rad]"};
    Curve before{"before", "#b0b0b0", {}, CurveStyle::Points}, after{"after", getCurveColor(0), {}, CurveStyle::Points};
    for (Eigen::Index k = 0; k < found.time.size(); k += step) {
      before.points.emplace_back(found.time[k], found.left_before(k, static_cast<Eigen::Index>(s)));
      after.points.emplace_back(found.time[k], found.left_after(k, static_cast<Eigen::Index>(s)));
    }
    plot.curves = {before, after};
    plots.push_back(std::move(plot));
  }
  return plots;
}

std::string formatSection(const std::string& title, const Estimate& estimate, const char* unit) {
  std::string html = "<h2>" + escape(title) + "</h2>\n<table>\n";
  for (const Row& row : listRows(estimate)) {
    html += "<tr>";
    for (const std::string& cell : row) html += "<td>" + escape(cell) + "</td>";
    html += "</tr>\n";
  }
  html += "</table>\n";
  for (const std::string& line : listLines(estimate, unit)) html += "<p>" + escape(line) + "</p>\n";
  return html;
}

}  // namespace

Json describe(const Identified& found) {
  Json columns = Json::array();
  for (const LinkageSensor& sensor : found.sensors) columns.push_back(sensor.name);
  Json json = {{"linkage", found.task->name},
               {"columns", columns},
               {"rows", found.rows},
               {"left_out", found.left_out},
               {"unclear", found.unclear}};
  json.update(describe(found.estimate));
  return json;
}

Json describe(const IdentifiedLoads& found) {
  Json json = {{"instants", found.instants},
               {"left_out", found.left_out},
               {"at_stops", found.at_stops},
               {"too_fast", found.too_fast},
               {"window", found.window}};
  json.update(describe(found.estimate));
  return json;
}

void print(std::ostream& out, const Identified& found) { print(out, formatTitle(found), found.estimate, kOfColumns); }
void print(std::ostream& out, const IdentifiedLoads& found) {
  print(out, formatTitle(found), found.estimate, kOfTorques);
}

std::string writeIdentifyPage(const std::string& directory, const std::string& title,
                              const std::vector<Identified>& all, const IdentifiedLoads* loads) {
  std::string html = "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>" + escape(title) +
                     "</"
                     "title>\n<style>body{font-family:sans-serif;margin:2em;max-width:80em}table{border-collapse:"
                     "collapse}td{border:1px "
                     "solid #ccc;padding:2px 6px;text-align:right}</style></head><body>\n<h1>" +
                     escape(title) +
                     "</h1>\n<p>Figures show what is left of each column: reading, less offset and coordinate.</p>\n";
  const std::string figure = (fs::path(directory) / "left.svg").string();
  for (const Identified& found : all) {
    html += formatSection(formatTitle(found), found.estimate, kOfColumns);
    if (drawPlots(figure, makePlots(found))) {
      const std::string svg = readTextFile(figure);
      html += svg.substr(std::min(svg.size(), svg.find("<svg")));
      fs::remove(figure);
    }
  }
  if (loads) html += formatSection(formatTitle(*loads), loads->estimate, kOfTorques);
  const std::string path = (fs::path(directory) / "report.html").string();
  writeTextFile(path, html + "</body></html>\n");
  return path;
}

}  // namespace bielle::cli
