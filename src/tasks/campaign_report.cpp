#include "tasks/campaign_report.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <numeric>
#include <optional>

#include "formats/text_file.h"
#include "model/number_text.h"
#include "results/plot.h"
#include "tasks/cells.h"

namespace fs = std::filesystem;

namespace bielle::tasks {
namespace {

constexpr const char *kImpulse = "push impulse", *kDirection = "push direction", *kTime = "push time",
                     *kPhase = "push phase";
constexpr size_t kLeastDirections = 3;  // of a map

// Values of a column in the order of the runs.
std::vector<std::string> listAxisValues(const CampaignResults& results, size_t column) {
  std::vector<std::string> values;
  for (const CampaignRun& run : results.runs)
    if (std::find(values.begin(), values.end(), run.values[column]) == values.end())
      values.push_back(run.values[column]);
  return values;
}

std::optional<size_t> findAxis(const CampaignResults& results, const char* name) {
  const auto found = std::find(results.columns.begin(), results.columns.end(), name);
  if (found == results.columns.end()) return std::nullopt;
  return static_cast<size_t>(found - results.columns.begin());
}

// Columns with several values, neither impulses nor directions: what tells the rows of a table, the curves of a map apart.
std::vector<size_t> listVaried(const CampaignResults& results) {
  std::vector<size_t> varied;
  for (size_t i = 0; i < results.columns.size(); ++i)
    if (results.columns[i] != kImpulse && results.columns[i] != kDirection && listAxisValues(results, i).size() > 1)
      varied.push_back(i);
  return varied;
}

std::string formatField(const Json& value) {
  return value.is_string() ? quoteCsv(value.get<std::string>()) : value.is_null() ? "" : value.dump();
}

std::string formatCsv(const CampaignResults& results) {
  TextStream csv;
  for (const std::string& column : results.columns) csv << quoteCsv(column) << ",";
  std::vector<std::string> fields;
  for (const CampaignRun& run : results.runs)
    if (run.result.size() > fields.size()) {
      fields.clear();
      for (const auto& [name, value] : run.result.items()) fields.push_back(name);
    }
  for (const std::string& field : fields) csv << field << ",";
  csv << "options\n";
  for (const CampaignRun& run : results.runs) {
    for (const std::string& value : run.values) csv << quoteCsv(value) << ",";
    for (const std::string& field : fields) csv << formatField(run.result.value(field, Json())) << ",";
    csv << quoteCsv(run.command) << "\n";
  }
  return csv.str();
}

struct Share {
  int runs = 0, stood = 0;
  void add(const CampaignRun& run) {
    ++runs;
    stood += run.stood();
  }
};

std::map<std::string, Share> countByValue(const CampaignResults& results, size_t column) {
  std::map<std::string, Share> shares;
  for (const CampaignRun& run : results.runs) shares[run.values[column]].add(run);
  return shares;
}

std::string formatImpulse(const SurvivedImpulse& found) {
  return (found.bounded ? "" : "≥ ") + formatExact(found.impulse);
}

std::vector<std::string> pick(const std::vector<std::string>& values, const std::vector<size_t>& columns) {
  std::vector<std::string> picked;
  for (const size_t column : columns) picked.push_back(values[column]);
  return picked;
}

// Survived impulses by the values of the varied columns, in the order of the runs: curves of a map, rows of a table.
using Groups = std::vector<std::pair<std::vector<std::string>, std::vector<SurvivedImpulse>>>;
Groups groupImpulses(const CampaignResults& results, const std::vector<size_t>& varied) {
  Groups groups;
  for (const SurvivedImpulse& found : findSurvivedImpulses(results)) {
    const std::vector<std::string> key = pick(found.values, varied);
    auto group = std::find_if(groups.begin(), groups.end(), [&key](const auto& g) { return g.first == key; });
    if (group == groups.end()) group = groups.insert(groups.end(), {key, {}});
    group->second.push_back(found);
  }
  return groups;
}

void printLine(std::ostream& page, const std::vector<std::string>& cells) {
  page << "|";
  for (const std::string& cell : cells) page << " " << cell << " |";
  page << "\n";
}

void printHead(std::ostream& page, const std::vector<std::string>& cells) {
  printLine(page, cells);
  page << "|";
  for (size_t i = 0; i < cells.size(); ++i) page << "---|";
  page << "\n";
}

void printShares(std::ostream& page, const CampaignResults& results) {
  for (size_t i = 0; i < results.columns.size(); ++i) {
    const std::vector<std::string> values = listAxisValues(results, i);
    // Of a search, which tries many impulses that are too large on purpose, shares would mean nothing.
    if (values.size() < 2 || results.searched) continue;
    const std::map<std::string, Share> shares = countByValue(results, i);
    page << "\n";
    printHead(page, {results.columns[i], "stood", "of"});
    for (const std::string& value : values)
      printLine(page, {value, std::to_string(shares.at(value).stood), std::to_string(shares.at(value).runs)});
  }
}

void printImpulses(std::ostream& page, const CampaignResults& results) {
  const Groups groups = groupImpulses(results, listVaried(results));
  if (groups.empty()) return;
  const std::optional<size_t> direction = findAxis(results, kDirection);
  const std::vector<std::string> directions =
      direction ? listAxisValues(results, *direction) : std::vector<std::string>{"0"};
  std::vector<std::string> head;
  for (const size_t column : listVaried(results)) head.push_back(results.columns[column]);
  for (const std::string& value : directions) head.push_back(value + "°");
  page << "\nLargest impulse without a fall, N s, by direction (0: along x, 90: along y):\n\n";
  printHead(page, head);
  for (const auto& [key, impulses] : groups) {
    std::vector<std::string> cells = key;
    for (const std::string& value : directions) {
      const auto found = std::find_if(impulses.begin(), impulses.end(), [&](const SurvivedImpulse& one) {
        return !direction || one.values[*direction] == value;
      });
      cells.push_back(found == impulses.end() ? "–" : formatImpulse(*found));
    }
    printLine(page, cells);
  }
}

std::map<std::string, int> countOutcomes(const CampaignResults& results) {
  std::map<std::string, int> outcomes;
  for (const CampaignRun& run : results.runs) ++outcomes[run.result.at("outcome").get<std::string>()];
  return outcomes;
}

std::string formatPage(const CampaignResults& results, bool has_map) {
  TextStream page;
  page << "# Campaign\n\n" << results.runs.size() << " runs:";
  const char* comma = " ";
  for (const auto& [outcome, count] : countOutcomes(results)) {
    page << comma << count << " " << outcome;
    comma = ", ";
  }
  page << ". Each run is a line of [runs.csv](runs.csv).\n";
  printShares(page, results);
  printImpulses(page, results);
  if (has_map) page << "\n![largest impulse without a fall, by direction](map.svg)\n";
  return page.str();
}

Json makeSummary(const CampaignResults& results) {
  Json axes = Json::object(), impulses = Json::array();
  for (size_t i = 0; i < results.columns.size(); ++i) {
    const std::map<std::string, Share> shares = countByValue(results, i);
    for (const std::string& value : listAxisValues(results, i))
      axes[results.columns[i]][value] = {{"runs", shares.at(value).runs}, {"stood", shares.at(value).stood}};
  }
  for (const SurvivedImpulse& found : findSurvivedImpulses(results)) {
    Json entry = Json::object();
    for (size_t i = 0; i < found.values.size(); ++i) entry[results.columns[i]] = found.values[i];
    entry["survived_Ns"] = found.impulse;
    entry["bounded"] = found.bounded;
    impulses.push_back(entry);
  }
  return {{"runs", results.runs.size()},
          {"complete", results.complete},
          {"outcomes", countOutcomes(results)},
          {"axes", axes},
          {"largest_impulses", impulses}};
}

// What tells the curves of a map apart. Instants do only if nothing else varies.
std::vector<size_t> listMapped(const CampaignResults& results) {
  const std::vector<size_t> varied = listVaried(results);
  std::vector<size_t> others;
  for (const size_t i : varied)
    if (results.columns[i] != kTime && results.columns[i] != kPhase) others.push_back(i);
  return others.empty() ? varied : others;
}

// Seen from above, x upwards, y to the left. Of several instants the mean.
Plot makeMap(const CampaignResults& results, const Groups& groups, size_t direction) {
  const std::vector<size_t> mapped = listMapped(results);
  std::string title = "Largest impulse without a fall, N s, by direction";
  for (const size_t i : mapped) title += " and " + results.columns[i];
  if (mapped.size() < listVaried(results).size()) title += ", mean of all instants";
  Plot plot{title, "", "", {}, PlotScale::Polar};
  for (const auto& [condition, found] : groups) {
    std::string label;
    for (const std::string& value : condition) label += (label.empty() ? "" : ", ") + value;
    Curve curve{label, getCurveColor(plot.curves.size()), {}, CurveStyle::LinesPoints};
    std::map<double, std::vector<double>> impulses;
    for (const SurvivedImpulse& one : found)
      impulses[parseNumber(one.values[direction]).value()].push_back(one.impulse);
    for (const auto& [angle, all] : impulses)
      curve.points.emplace_back(angle, std::accumulate(all.begin(), all.end(), 0.0) / static_cast<double>(all.size()));
    curve.points.push_back(curve.points.front());
    plot.curves.push_back(curve);
  }
  return plot;
}

}  // namespace

std::vector<SurvivedImpulse> findSurvivedImpulses(const CampaignResults& results) {
  const std::optional<size_t> column = findAxis(results, kImpulse);
  if (!column) return {};
  // The column of the impulse is the last, so that runs of one condition follow one another.
  std::vector<SurvivedImpulse> all;
  const auto isSame = [&](const CampaignRun& run, const std::vector<std::string>& values) {
    return std::equal(values.begin(), values.end(), run.values.begin());
  };
  for (size_t i = 0; i < results.runs.size();) {
    const std::vector<std::string> values(results.runs[i].values.begin(), results.runs[i].values.end() - 1);
    std::map<double, bool> stood;
    for (; i < results.runs.size() && isSame(results.runs[i], values); ++i)
      stood[parseNumber(results.runs[i].values.back()).value()] = results.runs[i].stood();
    SurvivedImpulse found{values, 0, false};
    for (const auto& [impulse, survived] : stood) {
      if (!survived) {
        found.bounded = true;
        break;
      }
      found.impulse = impulse;
    }
    all.push_back(std::move(found));
  }
  return all;
}

std::vector<std::string> writeCampaign(const std::string& directory, const CampaignResults& results,
                                       std::vector<std::string>& notes) {
  const auto locate = [&directory](const char* name) { return (fs::path(directory) / name).string(); };
  std::vector<std::string> paths;
  const std::optional<size_t> direction = findAxis(results, kDirection);
  const Groups groups = groupImpulses(results, listMapped(results));
  bool has_map = direction && !groups.empty() && listAxisValues(results, *direction).size() >= kLeastDirections;
  if (has_map && !drawPlots(locate("map.svg"), {makeMap(results, groups, *direction)})) {
    notes.push_back("map.svg was not drawn: gnuplot is not installed");
    has_map = false;
  }
  const std::pair<const char*, std::string> files[] = {{"runs.csv", formatCsv(results)},
                                                       {"campaign.md", formatPage(results, has_map)},
                                                       {"summary.json", formatJson(makeSummary(results)) + "\n"}};
  for (const auto& [name, text] : files) {
    paths.push_back(locate(name));
    writeTextFile(paths.back(), text);
  }
  if (has_map) paths.push_back(locate("map.svg"));
  return paths;
}

}  // namespace bielle::tasks
