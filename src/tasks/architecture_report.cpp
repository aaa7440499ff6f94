#include "tasks/architecture_report.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>

#include "formats/text_file.h"
#include "model/number_text.h"
#include "results/plot.h"
#include "tasks/cells.h"

namespace bielle::tasks {
namespace {

struct Row {
  std::string name, key;  // for the page; for the columns of the table
  int digits;
  std::function<double(const Feat&)> get;
};

std::vector<Row> listRows(const ArchitectureSpec& spec) {
  std::vector<Row> rows;
  for (size_t g = 0; g < spec.groups.size(); ++g) {
    const std::string& group = spec.groups[g].name;
    rows.push_back(
        {group + ": peak torque [N m]", group + " peak_Nm", 1, [g](const Feat& feat) { return feat.groups[g].peak; }});
    rows.push_back(
        {group + ": rms torque [N m]", group + " rms_Nm", 1, [g](const Feat& feat) { return feat.groups[g].rms; }});
    rows.push_back({group + ": peak speed [rad/s]", group + " speed_radps", 1,
                    [g](const Feat& feat) { return feat.groups[g].speed; }});
  }
  rows.push_back({"peak mechanical power, all motors together [W]", "peak_power_W", 0,
                  [](const Feat& feat) { return feat.peak_power; }});
  rows.push_back({"mechanical energy [J]", "energy_J", 1, [](const Feat& feat) { return feat.energy; }});
  rows.push_back(
      {"electrical energy [J]", "electrical_energy_J", 0, [](const Feat& feat) { return feat.electrical_energy; }});
  rows.push_back(
      {"cost of transport", "cost_of_transport", 2, [](const Feat& feat) { return feat.cost_of_transport; }});
  rows.push_back({"height of the CoM, start [m]", "com_start_m", 4, [](const Feat& feat) { return feat.com_start; }});
  rows.push_back({"lowest [m]", "com_lowest_m", 4, [](const Feat& feat) { return feat.com_lowest; }});
  rows.push_back({"highest [m]", "com_highest_m", 4, [](const Feat& feat) { return feat.com_highest; }});
  rows.push_back({"distance [m]", "distance_m", 3, [](const Feat& feat) { return feat.distance; }});
  rows.push_back({"duration [s]", "duration_s", 2, [](const Feat& feat) { return feat.duration; }});
  return rows;
}

void printHead(std::ostream& page, const std::string& first, const std::vector<Contender>& contenders) {
  page << "| " << first << " |";
  std::string rule = "|---|";
  for (const Contender& contender : contenders) {
    page << " " << contender.name << " |";
    rule += "---|";
  }
  page << "\n" << rule << "\n";
}

std::string countUnknown(const Contender& one) {
  const std::vector<Motor>& motors = one.robot.model.motors();
  return std::to_string(
      std::count_if(motors.begin(), motors.end(), [](const Motor& motor) { return !motor.torque_loss; }));
}

void printRobots(std::ostream& page, const ArchitectureSpec& spec, const std::vector<Contender>& contenders) {
  printHead(page, "", contenders);
  const auto print = [&](const std::string& name, const std::function<std::string(const Contender&)>& get) {
    page << "| " << name << " |";
    for (const Contender& contender : contenders) page << " " << get(contender) << " |";
    page << "\n";
  };
  print("mass [kg]", [](const Contender& one) { return formatCell(one.robot.model.mass(), 3); });
  print("trunk times", [](const Contender& one) { return formatCell(one.trunk_factor, 4); });
  print("motors", [](const Contender& one) { return std::to_string(one.robot.model.nu()); });
  if (!spec.drives.motor_constant) print("motors of unknown winding", countUnknown);
  print("joint velocities, closure rows", [](const Contender& one) {
    return std::to_string(one.robot.model.nv()) + ", " + std::to_string(one.robot.model.numClosureRows());
  });
  page << "\n";
}

void printMotion(std::ostream& page, const ArchitectureSpec& spec, size_t motion,
                 const std::vector<Contender>& contenders, const ArchitectureResults& results) {
  printHead(page, makeName(spec.motions[motion]), contenders);
  page << "| outcome |";
  for (const std::vector<Feat>& feats : results.motions)
    page << " " << feats[motion].outcome
         << (feats[motion].exists ? ", " + std::to_string(feats[motion].iterations) + " iterations" : "") << " |";
  page << "\n";
  for (const Row& row : listRows(spec)) {
    page << "| " << row.name << " |";
    for (const std::vector<Feat>& feats : results.motions)
      page << " " << (feats[motion].exists ? formatCell(row.get(feats[motion]), row.digits) : "–") << " |";
    page << "\n";
  }
  page << "\n";
}

// The largest speed that is done, and the slower ones that are not.
std::string describeLargest(const ArchitectureSpec& spec, const std::vector<Feat>& feats) {
  size_t largest = feats.size();
  while (largest > 0 && !feats[largest - 1].done) --largest;
  if (largest == 0) return "none";
  std::string text = "**" + formatCell(spec.speed_values[largest - 1], 2) + "**", missing;
  for (size_t i = 0; i + 1 < largest; ++i)
    if (!feats[i].done) missing += (missing.empty() ? "" : ", ") + formatCell(spec.speed_values[i], 2);
  return missing.empty() ? text : text + " (not " + missing + ")";
}

void printSpeeds(std::ostream& page, const ArchitectureSpec& spec, const std::vector<Contender>& contenders,
                 const ArchitectureResults& results) {
  if (spec.speeds.empty()) return;
  page << "## Speed\n\nPeak torque of all motors [N m], electrical cost of transport, iterations; or the failure.\n\n";
  printHead(page, spec.speeds[0].motion + ": " + spec.speeds[0].settings[0].first, contenders);
  for (size_t i = 0; i < spec.speeds.size(); ++i) {
    page << "| " << formatCell(spec.speed_values[i], 2) << " |";
    for (const std::vector<Feat>& feats : results.speeds) {
      const Feat& feat = feats[i];
      page << " "
           << (feat.done ? formatCell(feat.groups.back().peak, 1) + ", " + formatCell(feat.cost_of_transport, 2) +
                               ", " + std::to_string(feat.iterations)
                         : feat.outcome)
           << " |";
    }
    page << "\n";
  }
  page << "| **largest that passes** |";
  for (const std::vector<Feat>& feats : results.speeds) page << " " << describeLargest(spec, feats) << " |";
  page << "\n\n";
}

std::string formatCsv(const ArchitectureSpec& spec, const std::vector<Contender>& contenders,
                      const ArchitectureResults& results) {
  const std::vector<Row> rows = listRows(spec);
  TextStream csv;
  csv.precision(9);
  csv << "robot,motion,outcome,iterations";
  for (const Row& row : rows) csv << "," << quoteCsv(row.key);
  csv << "\n";
  for (size_t r = 0; r < contenders.size(); ++r)
    for (const auto& [motions, feats] :
         {std::pair{&spec.motions, &results.motions[r]}, {&spec.speeds, &results.speeds[r]}})
      for (size_t i = 0; i < motions->size(); ++i) {
        const Feat& feat = (*feats)[i];
        csv << quoteCsv(contenders[r].name) << "," << makeName((*motions)[i]) << "," << quoteCsv(feat.outcome) << ","
            << feat.iterations;
        for (const Row& row : rows) {
          csv << ",";
          if (feat.exists && std::isfinite(row.get(feat))) csv << row.get(feat);
        }
        csv << "\n";
      }
  return csv.str();
}

// Over time, of every robot: the largest torque of any motor, the power of all, the height of the centre of mass.
std::vector<Plot> makeMotionPlots(const std::vector<Contender>& contenders, const ArchitectureResults& results,
                                  size_t motion) {
  std::vector<Plot> plots = {{"Largest torque of a motor", "time [s]", "torque [N m]"},
                             {"Mechanical power of all motors", "time [s]", "power [W]"},
                             {"Height of the centre of mass", "time [s]", "height [m]"}};
  for (size_t r = 0; r < contenders.size(); ++r) {
    const Feat& feat = results.motions[r][motion];
    for (Plot& plot : plots) plot.curves.push_back({contenders[r].name, getCurveColor(r)});
    for (size_t k = 0; k < feat.trace.time.size(); ++k) {
      const Eigen::Index stage = static_cast<Eigen::Index>(k);
      plots[0].curves.back().points.emplace_back(feat.trace.time[k],
                                                 feat.trace.torque.col(stage).cwiseAbs().maxCoeff());
      plots[1].curves.back().points.emplace_back(feat.trace.time[k],
                                                 feat.trace.torque.col(stage).dot(feat.trace.speed.col(stage)));
    }
    plots[2].curves.back().points = feat.com_height;
  }
  return plots;
}

std::vector<Plot> makeSpeedPlots(const ArchitectureSpec& spec, const std::vector<Contender>& contenders,
                                 const ArchitectureResults& results) {
  const std::string label = spec.speeds[0].motion + ": " + spec.speeds[0].settings[0].first;
  std::vector<Plot> plots = {{"Peak torque of all motors", label, "torque [N m]"},
                             {"Rms torque over all motors", label, "torque [N m]"},
                             {"Electrical cost of transport", label, "cost of transport"}};
  for (size_t r = 0; r < contenders.size(); ++r) {
    for (Plot& plot : plots) plot.curves.push_back({contenders[r].name, getCurveColor(r), {}, CurveStyle::LinesPoints});
    for (size_t i = 0; i < spec.speeds.size(); ++i) {
      const Feat& feat = results.speeds[r][i];
      if (!feat.done) continue;
      plots[0].curves.back().points.emplace_back(spec.speed_values[i], feat.groups.back().peak);
      plots[1].curves.back().points.emplace_back(spec.speed_values[i], feat.groups.back().rms);
      plots[2].curves.back().points.emplace_back(spec.speed_values[i], feat.cost_of_transport);
    }
  }
  return plots;
}

constexpr const char* kExplanation =
    "Peaks are over all motors of a group and the whole motion, rms torques over time and the motors of the group. "
    "Electrical energy: mechanical power, losses of the gear and heat (u / K_m)^2 of every motor, K_m ";

std::string describeConstant(const DriveTable& drives) {
  if (drives.motor_constant) return "= " + formatCell(*drives.motor_constant, 2) + " N m/sqrt(W) for all";
  return "by its winding, or " + formatCell(1 / std::sqrt(kDefaultTorqueLoss), 2) +
         " N m/sqrt(W) where that is not known";
}

}  // namespace

std::vector<std::string> writeArchitectures(const std::string& directory, const ArchitectureSpec& spec,
                                            const std::vector<Contender>& contenders,
                                            const ArchitectureResults& results, std::vector<std::string>& notes) {
  std::vector<std::string> paths;
  TextStream page;
  page << "# Robots compared\n\nMade by `bielle compare` from " << std::filesystem::path(spec.path).filename().string()
       << ". " << kExplanation << describeConstant(spec.drives) << ", " << formatCell(100 * spec.drives.regeneration, 0)
       << " % of the braking energy regenerated; cost of transport: energy over weight and distance.\n\n";
  printRobots(page, spec, contenders);
  const auto draw = [&](const std::string& name, const std::string& caption, const std::vector<Plot>& plots) {
    const std::string path = directory + "/" + name;
    if (drawPlots(path, plots)) {
      paths.push_back(path);
      page << "![" << caption << "](" << name << ")\n\n";
    } else {
      notes.push_back(name + ": not drawn: gnuplot is not installed (package gnuplot-nox)");
    }
  };
  for (size_t i = 0; i < spec.motions.size(); ++i) {
    page << "## " << spec.motions[i].motion << "\n\n";
    printMotion(page, spec, i, contenders, results);
    const std::string name = makeName(spec.motions[i]);
    draw(name + ".svg", name, makeMotionPlots(contenders, results, i));
  }
  printSpeeds(page, spec, contenders, results);
  if (!spec.speeds.empty()) draw("speeds.svg", "over speed", makeSpeedPlots(spec, contenders, results));
  for (const auto& [name, text] :
       {std::pair{"compare.md", page.str()}, {"compare.csv", formatCsv(spec, contenders, results)}}) {
    writeTextFile(directory + "/" + name, text);
    paths.push_back(directory + "/" + name);
  }
  return paths;
}

}  // namespace bielle::tasks
