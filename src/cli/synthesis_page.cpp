#include "cli/synthesis_page.h"

#include <filesystem>

#include "bielle/robots/robot_loader.h"
#include "design/marks.h"
#include "design/page_data.h"
#include "formats/text_file.h"
#include "model/number_text.h"
#include "report/page.h"

namespace fs = std::filesystem;

namespace bielle::cli {
namespace {

// Columns and values of the page.
struct LinkageTable {
  Json columns = Json::array(), values = Json::array();
  void add(Json column, double value, const std::string& mark = "") {
    columns.push_back(std::move(column));
    values.push_back({{"value", value}});
    if (!mark.empty()) values.back()["mark"] = mark;
  }
};

LinkageTable makeLinkageTable(const SoughtLinkage& sought, const FoundLinkage& f, const JointDemand& demand) {
  LinkageTable table;
  const auto [name, unit] = nameValue(demand);
  table.add({{"kind", "objective"}, {"name", name}, {"unit", unit}}, f.value);
  table.add({{"kind", "margin"},
             {"name", sought.margin},
             {"unit", ""},
             {"bound", "≥ " + formatNumber(sought.least_margin, "%.4g")}},
            f.margin, f.margin < 1.001 * sought.least_margin ? "at its bound" : "");
  table.add({{"kind", "measure"}, {"name", "least ratio"}, {"unit", ""}}, f.least_ratio);
  table.add({{"kind", "measure"}, {"name", "largest ratio"}, {"unit", ""}}, f.largest_ratio);
  if (demand.torques.size() > 0) {
    table.add({{"kind", "measure"}, {"name", "peak torque"}, {"unit", "N m"}}, f.peak_torque);
    table.add({{"kind", "measure"}, {"name", "peak speed"}, {"unit", "rad/s"}}, f.peak_speed);
  }
  for (size_t i = 0; i < sought.variables.size(); ++i) {
    const DesignVariable& variable = sought.variables[i];
    const double value = f.x[static_cast<Eigen::Index>(i)];
    const std::string bound = findBound(variable.lower, variable.upper, value);
    table.add({{"kind", "variable"},
               {"name", variable.name},
               {"unit", variable.unit == "1" ? "" : variable.unit},
               {"bound", formatNumber(variable.lower, "%.4g") + " to " + formatNumber(variable.upper, "%.4g")}},
              value, bound.empty() ? "" : bound + " bound");
  }
  return table;
}

// What the motor of the joint does through the linkage.
Json describeMotor(const SoughtLinkage& sought, const FoundLinkage& f, const JointDemand& demand, const Motor& motor) {
  VectorXd ratios(demand.angles.size());
  double margin = 0;
  std::vector<std::pair<double, double>> points;
  if (sought.family.calcRatios(f.x, ratios, margin))
    for (Eigen::Index k = 0; k < ratios.size(); ++k)
      points.emplace_back(ratios[k] * demand.speeds[k], demand.torques[k] / ratios[k]);
  return describeCloud(motor, points);
}

}  // namespace

std::string getLegName(size_t i) { return "leg_" + std::to_string(i + 1); }

std::pair<std::string, std::string> nameValue(const JointDemand& demand) {
  if (demand.torques.size() > 0) return {"rms torque", "N m"};
  return {demand.ratios.size() > 0 ? "deviation of the ratio" : "spread of the ratio", ""};
}

void writeSynthesisPage(const std::string& directory, const SoughtLinkage& sought,
                        const std::vector<FoundLinkage>& found, const JointDemand& demand, const std::string& motion,
                        const Motor& motor) {
  Json columns, designs = Json::array();
  for (size_t i = 0; i < found.size(); ++i) {
    const std::string name = getLegName(i), file = name + "/" + name + ".yaml";
    const LinkageTable table = makeLinkageTable(sought, found[i], demand);
    columns = table.columns;
    const Json mechanism = describeMechanism(loadRobot((fs::path(directory) / name).string()).model);
    Json motions = Json::array();
    if (demand.torques.size() > 0)
      motions.push_back(
          {{"name", motion}, {"page", Json()}, {"motors", {describeMotor(sought, found[i], demand, motor)}}});
    designs.push_back({{"name", name},
                       {"architecture", ""},
                       {"status", ""},
                       {"values", table.values},
                       {"svg", mechanism["svg"]},
                       {"distances", mechanism["distances"]},
                       {"directory", name},
                       {"files", {file}},
                       {"text", readTextFile((fs::path(directory) / file).string(), "")},
                       {"motions", motions}});
  }
  writeTextFile((fs::path(directory) / "synthesis.html").string(), makeDesignPage({{"title", "Linkages for a joint"},
                                                                                   {"baseline", false},
                                                                                   {"best", 0},
                                                                                   {"plot", "Value and margin"},
                                                                                   {"axes", {0, 1}},
                                                                                   {"columns", columns},
                                                                                   {"designs", designs}}));
}

}  // namespace bielle::cli
