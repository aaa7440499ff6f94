#include "cli/ratio_report.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <ostream>

#include "cli/ratio_figure.h"
#include "cli/table.h"
#include "formats/aside_file.h"
#include "formats/text_file.h"
#include "model/listing.h"
#include "model/number_text.h"
#include "results/plot.h"

namespace fs = std::filesystem;

namespace bielle::cli {
namespace {

constexpr size_t kTableRows = 24;

// "motor" for one motor and one joint, else "motor/joint".
std::vector<std::string> makeEntryNames(const Linkage& linkage) {
  std::vector<std::string> names;
  for (const std::string& motor : linkage.motor_names)
    for (const std::string& joint : linkage.joint_names) names.push_back(motor + "/" + joint);
  return names;
}

std::vector<double> listEntries(const MatrixXd& R) {
  std::vector<double> entries;
  for (Eigen::Index i = 0; i < R.rows(); ++i)
    for (Eigen::Index j = 0; j < R.cols(); ++j) entries.push_back(R(i, j));
  return entries;
}

Json listFinite(const std::vector<double>& numbers) {  // JSON has no infinity
  Json list = Json::array();
  for (const double x : numbers) list.push_back(std::isfinite(x) ? Json(x) : Json(nullptr));
  return list;
}

Json describeSample(const RatioSample& sample, int swept) {
  Json json = {
      {"s", sample.s},
      {"branch", sample.branch},
      {"joints", listFinite({sample.joints.begin(), sample.joints.end()})},
      {"motors", listFinite({sample.motors.begin(), sample.motors.end()})},
      {"R", listFinite(listEntries(sample.ratio.R))},
      {"dR", sample.dead == DeadPointKind::Output ? Json(nullptr) : listFinite(listEntries(sample.ratio.dR[swept]))},
      {"condition", listFinite({sample.ratio.condition})[0]},
      {"dead", getName(sample.dead)}};
  if (sample.nearest) json["distance"] = listFinite({sample.nearest->distance})[0];
  return json;
}

Json describeSamples(const std::vector<RatioSample>& samples, int swept) {
  Json list = Json::array();
  for (const RatioSample& sample : samples) list.push_back(describeSample(sample, swept));
  return list;
}

std::string formatCsv(const Linkage& linkage, const std::vector<RatioSample>& samples, int swept) {
  std::string text = "s,branch";
  for (const std::string& name : linkage.joint_names) text += ",q." + name;
  for (const std::string& name : linkage.motor_names) text += ",q." + name;
  for (const std::string& name : makeEntryNames(linkage)) text += ",R." + name;
  for (const std::string& name : makeEntryNames(linkage)) text += ",dR." + name;
  const bool has_distances = !samples.empty() && samples.front().nearest;
  text += std::string(",condition") + (has_distances ? ",distance" : "") + ",dead\n";
  for (const RatioSample& sample : samples) {
    text += formatExact(sample.s) + "," + std::to_string(sample.branch);
    for (const double x : sample.joints) text += "," + formatExact(x);
    for (const double x : sample.motors) text += "," + formatExact(x);
    for (const double x : listEntries(sample.ratio.R)) text += "," + formatExact(x);
    const bool infinite = sample.dead == DeadPointKind::Output;
    for (const double x : listEntries(sample.ratio.dR[swept])) text += "," + (infinite ? "" : formatExact(x));
    text += "," + formatExact(sample.ratio.condition);
    if (sample.nearest) text += "," + formatExact(sample.nearest->distance);
    text += std::string(",") + getName(sample.dead) + "\n";
  }
  return text;
}

void printSamples(std::ostream& out, const Linkage& linkage, const std::vector<RatioSample>& samples, int swept) {
  Row header = {"branch"};
  for (const std::string& name : linkage.joint_names) header.push_back(name);
  for (const std::string& name : linkage.motor_names) header.push_back(name);
  const bool one = linkage.size() == 1;
  for (const std::string& name : makeEntryNames(linkage)) header.push_back(one ? "R" : "R " + name);
  if (one) header.push_back("dR");
  if (!one) header.push_back("condition");
  header.insert(header.end(), {"distance", "dead point"});
  std::vector<Row> rows = {header};
  const auto format = [](double x) { return std::isfinite(x) && std::abs(x) < 1e8 ? formatNumber(x, "%.4f") : "inf"; };
  for (const RatioSample& sample : samples) {
    const bool infinite = sample.dead == DeadPointKind::Output;
    Row row = {std::to_string(sample.branch)};
    for (const double x : sample.joints) row.push_back(formatNumber(x, "%.6f"));
    for (const double x : sample.motors) row.push_back(formatNumber(x, "%.6f"));
    for (const double x : listEntries(sample.ratio.R)) row.push_back(format(x));
    if (one) row.push_back(infinite ? "inf" : format(sample.ratio.dR[swept](0, 0)));
    if (!one) row.push_back(format(sample.ratio.condition));
    row.insert(row.end(), {formatDistance(*sample.nearest), getName(sample.dead)});
    rows.push_back(row);
  }
  printTable(out, rows);
}

// Some samples of the main branch, all dead points.
std::vector<RatioSample> thinOut(const std::vector<RatioSample>& samples) {
  size_t main = 0;
  for (const RatioSample& sample : samples) main += sample.branch == 0;
  const size_t stride = std::max<size_t>(1, (main + kTableRows - 1) / kTableRows);
  std::vector<RatioSample> some;
  size_t count = 0;
  for (const RatioSample& sample : samples)
    if (sample.dead != DeadPointKind::None || sample.s == 0 || (sample.branch == 0 && count++ % stride == 0))
      some.push_back(sample);
  return some;
}

}  // namespace

Json describeReport(const RatioReport& report) {
  const RatioSweep& sweep = report.sweep;
  Json json = {{"robot", report.robot},
               {"joints", report.linkage.joint_names},
               {"motors", report.linkage.motor_names},
               {"swept", report.linkage.joint_names[sweep.joint]},
               {"begin", sweep.begin},
               {"end", sweep.end},
               {"full_turn", sweep.full_turn},
               {"balance_error", report.balance_error},
               {"dead_points", describeSamples(sweep.deadPoints(), sweep.joint)},
               {"samples", describeSamples(sweep.samples, sweep.joint)}};
  if (!report.map) return json;
  Json rows = Json::array();
  for (const std::vector<RatioSample>& row : report.map->rows) rows.push_back(describeSamples(row, sweep.joint));
  json["map"] = {{"first", report.map->first},
                 {"second", report.map->second},
                 {"rows", rows},
                 {"dead_points", describeSamples(report.map->dead_points, sweep.joint)}};
  return json;
}

void printReport(std::ostream& out, const RatioReport& report) {
  const RatioSweep& sweep = report.sweep;
  double low = INFINITY, high = -INFINITY;
  std::string start, first, last;  // distances
  for (const RatioSample& sample : sweep.samples) {
    const std::string distance = formatDistance(*sample.nearest);
    if (sample.s == 0 || start.empty()) start = distance;
    if (sample.branch != 0) continue;
    low = std::min(low, sample.joints[sweep.joint]);
    high = std::max(high, sample.joints[sweep.joint]);
    if (first.empty()) first = distance;
    last = distance;
  }
  out << report.robot << ": " << listItems(report.linkage.joint_names) << " driven by "
      << listItems(report.linkage.motor_names) << "\n";
  const std::string ends = sweep.begin == sweep.end ? sweep.end + ", either way" : sweep.begin + "; " + sweep.end;
  printTable(
      out, std::vector<Row>{
               {"range of " + report.linkage.joint_names[sweep.joint],
                formatNumber(low, "%.6f") + " to " + formatNumber(high, "%.6f") + " (rad, or m), first branch"},
               {"ends", sweep.full_turn ? "none: a full turn" : ends},
               {"dead points", std::to_string(sweep.deadPoints().size())},
               {"distance from them", start + " at the start; " + first + " and " + last + " at the ends (rad, or m)"},
               {"virtual work", "largest relative error " + formatNumber(report.balance_error, "%.1e")}});
  out << "\nratio R = motor speed / joint speed" << (report.linkage.isDirect() ? ": the motor sits on the joint" : "")
      << "\n";
  printSamples(out, report.linkage, thinOut(sweep.samples), sweep.joint);
  if (!report.map) return;
  double worst = 1, best = INFINITY;
  size_t reached = 0;
  for (const std::vector<RatioSample>& row : report.map->rows)
    for (const RatioSample& sample : row) {
      worst = std::max(worst, sample.ratio.condition);
      best = std::min(best, sample.ratio.condition);
      ++reached;
    }
  out << "\nmap over both joints, up to the first dead points: " << reached << " postures, condition number of R from "
      << formatNumber(best, "%.3f") << " to " << formatNumber(worst, "%.3f") << "\n";
}

std::vector<std::string> writeReport(const std::string& directory, const RatioReport& report) {
  const auto place = [&directory](const char* name) { return (fs::path(directory) / name).string(); };
  std::vector<std::string> written = {place("ratio.csv"), place("ratio.json")};
  AsideFile csv(written[0]), json(written[1]);
  csv.write(formatCsv(report.linkage, report.sweep.samples, report.sweep.joint));
  json.write(formatJson(describeReport(report)) + "\n");
  csv.commit();
  if (report.map) {
    std::vector<RatioSample> all;
    for (const std::vector<RatioSample>& row : report.map->rows) all.insert(all.end(), row.begin(), row.end());
    writeTextFile(place("map.csv"), formatCsv(report.linkage, all, report.sweep.joint));
    written.push_back(place("map.csv"));
  }
  json.commit();
  written.push_back(drawPlots(place("ratio.svg"), makeRatioPlots(report))
                        ? place("ratio.svg")
                        : "no figure: gnuplot is not installed (Debian: gnuplot-nox)");
  return written;
}

}  // namespace bielle::cli
