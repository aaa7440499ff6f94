#include "cli/softness_page.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>

#include "formats/text_file.h"
#include "model/rounded_text.h"
#include "results/plot.h"

namespace fs = std::filesystem;

namespace bielle::cli {
namespace {

constexpr double kImpedance = 0.9999;  // the most that MuJoCo takes
constexpr double kMargin = 0.95;       // of what is promised

double read(const Json& row, const char* key) {
  return row.contains(key) && row.at(key).is_number() ? row.at(key).get<double>() : NAN;
}

std::string escape(const std::string& text) {
  std::string out;
  for (const char c : text) out += c == '<' ? "&lt;" : c == '&' ? "&amp;" : c == '>' ? "&gt;" : std::string(1, c);
  return out;
}

std::vector<std::string> listLoops(const std::vector<Json>& rows) {
  std::vector<std::string> loops;
  for (const Json& row : rows)
    if (const std::string loop = row.at("loop"); std::find(loops.begin(), loops.end(), loop) == loops.end())
      loops.push_back(loop);
  return loops;
}

// Over the time of a motion.
Plot makeMotionPlot(const std::string& loop, const std::vector<Json>& rows, double within) {
  Plot plot{loop, "time [s]", "gap and sag [m, rad]"};
  plot.scale = PlotScale::Logarithmic;
  Curve gap{"gap", getCurveColor(0)}, sag{"sag", getCurveColor(1)}, asked{"asked for", "#7f7f7f"};
  asked.dashed = true;
  for (const Json& row : rows) {
    if (row.at("loop") != loop) continue;
    const double time = row.at("time");
    gap.points.emplace_back(time, std::max(read(row, "gap"), read(row, "angle")));
    sag.points.emplace_back(time, read(row, "sag"));
    asked.points.emplace_back(time, within);
  }
  plot.curves = {gap, sag, asked};
  return plot;
}

Plot makePlot(const std::string& loop, const std::vector<Json>& rows, double within) {
  Plot plot{loop, "position of the joint [rad or m]", "gap under gravity, and with motors at their limits [m, rad]"};
  plot.scale = PlotScale::Logarithmic;
  std::vector<std::string> joints;
  for (const Json& row : rows)
    if (const std::string joint = row.at("joint");
        row.at("loop") == loop && std::find(joints.begin(), joints.end(), joint) == joints.end())
      joints.push_back(joint);
  double first = INFINITY, last = -INFINITY;
  for (size_t j = 0; j < joints.size(); ++j) {
    Curve weight{joints[j], getCurveColor(j), {}, CurveStyle::LinesPoints};
    Curve limit{"at limits", getCurveColor(j), {}, CurveStyle::LinesPoints, true};
    for (const Json& row : rows) {
      if (row.at("loop") != loop || row.at("joint") != joints[j]) continue;
      const double x = row.at("position");
      first = std::min(first, x), last = std::max(last, x);
      weight.points.emplace_back(x, std::max(read(row, "gap"), read(row, "angle")));
      limit.points.emplace_back(x, std::max(read(row, "gap_at_limit"), read(row, "angle_at_limit")));
    }
    plot.curves.push_back(weight);
    plot.curves.push_back(limit);
  }
  if (first == last) first -= 0.1, last += 0.1;
  plot.curves.push_back({"asked for", "#7f7f7f", {{first, within}, {last, within}}, CurveStyle::Lines, true});
  return plot;
}

struct Column {
  const char *key, *title, *format;
};
// Those that a study does not have are left out.
constexpr Column kColumns[] = {{"time", "time [s]", "%.4g"},
                               {"joint", "joint", ""},
                               {"position", "position [rad, m]", "%.4g"},
                               {"gap", "gap [m]", "%.2e"},
                               {"angle", "gap [rad]", "%.2e"},
                               {"sag", "sag [rad, m]", "%.2e"},
                               {"torque_error", "torque error [N m]", "%.2e"},
                               {"gap_at_limit", "gap at the limit [m]", "%.2e"},
                               {"angle_at_limit", "gap at the limit [rad]", "%.2e"},
                               {"sag_at_limit", "sag at the limit [rad, m]", "%.2e"},
                               {"frequency", "frequency [Hz]", "%.3g"},
                               {"frequency_error", "its error", "%.1e"},
                               {"energy_loss", "energy lost [1/s]", "%.2e"},
                               {"stable_step", "largest stable step [s]", "%.3g"},
                               {"state", "", ""}};

std::string makeTable(const std::string& loop, const std::vector<Json>& rows) {
  std::string html = "<table><tr>";
  for (const Column& column : kColumns)
    if (rows.front().contains(column.key)) html += std::string("<th>") + column.title + "</th>";
  html += "</tr>\n";
  for (const Json& row : rows) {
    if (row.at("loop") != loop) continue;
    html += "<tr>";
    for (const Column& column : kColumns) {
      if (!row.contains(column.key)) continue;
      const Json& value = row.at(column.key);
      html += "<td>" +
              (value.is_string() ? escape(value)
               : value.is_null() ? ""
                                 : formatNumber(value, column.format)) +
              "</td>";
    }
    html += "</tr>\n";
  }
  return html + "</table>\n";
}

}  // namespace

SoftnessAdvice advise(const std::vector<Json>& rows, double within, double time_step) {
  double opening = 0;  // over the square of the time constant
  for (const Json& row : rows) {
    const double bias = read(row, "bias");
    opening = std::max(opening, (1 - kImpedance) * read(row, "pull") + (std::isnan(bias) ? 0 : bias));
  }
  SoftnessAdvice advice;
  advice.within = within;
  advice.time_step = time_step;
  if (const double needed = std::sqrt(kMargin * within / opening) / 2; needed < time_step)
    advice.time_step = *parseNumber(formatBelow(needed, 2));
  const double time = 2 * advice.time_step;
  advice.settings = {{time, 1}, {kImpedance, kImpedance, 0.001, 0.5, 2}};
  advice.gap = opening * time * time;
  return advice;
}

std::string formatMjcf(const SoftnessAdvice& advice) {
  const auto join = [](const auto& values) {
    std::string text;
    for (const double value : values) text += (text.empty() ? "" : " ") + formatExact(value);
    return text;
  };
  return "<mujoco>\n  <option timestep=\"" + formatExact(advice.time_step) +
         "\"/>\n  <default>\n    <equality solref=\"" + join(advice.settings.solref) + "\" solimp=\"" +
         join(advice.settings.solimp) + "\"/>\n  </default>\n</mujoco>\n";
}

void writeSoftnessPage(const std::string& directory, const std::string& title, const std::vector<Json>& rows,
                       const SoftnessAdvice& advice) {
  std::string html =
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>" + escape(title) +
      "</title>\n<style>body{font-family:sans-serif;margin:2em;max-width:80em}table{border-collapse:collapse;"
      "font-size:80%}td,th{border:1px solid #ccc;padding:2px "
      "6px;text-align:right}td{white-space:nowrap}pre{background:#f4f4f4;"
      "padding:1em}</style></head><body>\n<h1>" +
      escape(title) + "</h1>\n<p>Within " + formatNumber(advice.within, "%.2g") +
      (rows.front().contains("time") ? " m and rad, along the motion: a gap of "
                                     : " m and rad, gravity and motors at their limits: a gap of ") +
      formatNumber(advice.gap, "%.2g") + " with</p>\n<pre>" + escape(formatMjcf(advice)) + "</pre>\n";
  const fs::path figure = fs::path(directory) / "softness.svg";
  for (const std::string& loop : listLoops(rows)) {
    html += "<h2>" + escape(loop) + "</h2>\n";
    if (drawPlots(figure.string(),
                  {(rows.front().contains("time") ? makeMotionPlot : makePlot)(loop, rows, advice.within)})) {
      const std::string svg = readTextFile(figure.string());
      html += svg.substr(std::min(svg.size(), svg.find("<svg")));
      fs::remove(figure);
    }
    html += makeTable(loop, rows);
  }
  writeTextFile((fs::path(directory) / "softness.html").string(), html + "</body></html>\n");
}

}  // namespace bielle::cli
