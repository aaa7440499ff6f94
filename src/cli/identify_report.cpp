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

std::vector<Row> listRows(const Identified& found) {
  std::vector<Row> rows = {{"", "unit", "before", "after", "change", "+-"}};
  for (const Unknown& unknown : found.estimate.unknowns) {
    Row row = {unknown.name + (unknown.is_offset ? ", offset" : ""), unknown.unit, format(unknown.before), "not seen"};
    if (unknown.is_seen) {
      row.back() = format(unknown.after);
      row.push_back(format(unknown.after - unknown.before, "%+.6f"));
      row.push_back(formatNumber(unknown.deviation, "%.1e"));
    }
    rows.push_back(std::move(row));
  }
  return rows;
}

// The misfit, and what is not seen.
std::vector<std::string> listLines(const LinkageEstimate& estimate) {
  std::vector<std::string> lines = {"misfit " + formatNumber(estimate.misfit_before, "%.3g") + " -> " +
                                    formatNumber(estimate.misfit_after, "%.3g") + " rad or m"};
  for (const Combination& combination : estimate.unseen) {
    std::string text;
    for (const auto& [name, share] : combination)
      text += (text.empty() ? "" : ", ") + name + " by " + formatNumber(share, "%.3g");
    lines.push_back("not seen: " +
                    (combination.size() == 1 ? combination.front().first : "changes of " + text + ", together"));
  }
  return lines;
}

std::string formatTitle(const Identified& found) {
  return "linkage of " + found.task->name + ": " + std::to_string(found.rows) + " rows, " + found.estimate.message;
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
      before.points.emplace_back(found.time[k], found.estimate.left_before(k, static_cast<Eigen::Index>(s)));
      after.points.emplace_back(found.time[k], found.estimate.left_after(k, static_cast<Eigen::Index>(s)));
    }
    plot.curves = {before, after};
    plots.push_back(std::move(plot));
  }
  return plots;
}

}  // namespace

Json describe(const Identified& found) {
  const LinkageEstimate& estimate = found.estimate;
  Json unknowns = Json::array(), unseen = Json::array(), columns = Json::array();
  for (const Unknown& unknown : estimate.unknowns) {
    Json one = {{"name", unknown.name}, {"kind", unknown.is_offset ? "offset" : "length"}, {"unit", unknown.unit}};
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
  for (const LinkageSensor& sensor : found.sensors) columns.push_back(sensor.name);
  return {{"linkage", found.task->name},
          {"columns", columns},
          {"rows", found.rows},
          {"left_out", found.left_out},
          {"unknowns", unknowns},
          {"not_seen", unseen},
          {"misfit_before", estimate.misfit_before},
          {"misfit_after", estimate.misfit_after},
          {"noise_over_assumed", estimate.noise},
          {"iterations", estimate.iterations},
          {"converged", estimate.converged},
          {"ended", estimate.message}};
}

void print(std::ostream& out, const Identified& found) {
  out << formatTitle(found) << "\n";
  printTable(out, listRows(found));
  for (const std::string& line : listLines(found.estimate)) out << "  " << line << "\n";
}

std::string writeIdentifyPage(const std::string& directory, const std::string& title,
                              const std::vector<Identified>& all) {
  std::string html = "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>" + escape(title) +
                     "</"
                     "title>\n<style>body{font-family:sans-serif;margin:2em;max-width:80em}table{border-collapse:"
                     "collapse}td{border:1px "
                     "solid #ccc;padding:2px 6px;text-align:right}</style></head><body>\n<h1>" +
                     escape(title) +
                     "</h1>\n<p>Figures show what is left of each column: reading, less offset and coordinate.</p>\n";
  const std::string figure = (fs::path(directory) / "left.svg").string();
  for (const Identified& found : all) {
    html += "<h2>" + escape(formatTitle(found)) + "</h2>\n<table>\n";
    for (const Row& row : listRows(found)) {
      html += "<tr>";
      for (const std::string& cell : row) html += "<td>" + escape(cell) + "</td>";
      html += "</tr>\n";
    }
    html += "</table>\n";
    for (const std::string& line : listLines(found.estimate)) html += "<p>" + escape(line) + "</p>\n";
    if (drawPlots(figure, makePlots(found))) {
      const std::string svg = readTextFile(figure);
      html += svg.substr(std::min(svg.size(), svg.find("<svg")));
      fs::remove(figure);
    }
  }
  const std::string path = (fs::path(directory) / "report.html").string();
  writeTextFile(path, html + "</body></html>\n");
  return path;
}

}  // namespace bielle::cli
