#include "cli/ratio_figure.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "io/figure.h"

namespace bielle::cli {
namespace {

double calcMedianRatio(const RatioReport& report) {
  std::vector<double> values;
  for (const RatioSample& sample : report.sweep.samples)
    if (sample.branch == 0 && sample.dead == DeadPointKind::None) values.push_back(std::abs(sample.ratio.R(0, 0)));
  if (values.empty()) return 1;
  std::nth_element(values.begin(), values.begin() + values.size() / 2, values.end());
  return values[values.size() / 2];
}

std::string makeCurveScript(const RatioReport& report) {
  const double top = std::max(4 * calcMedianRatio(report), 2.0);
  std::ostringstream script;
  script << "set encoding utf8\n";
  const auto writeBlock = [&](const char* name, const auto& keep) {
    script << "$" << name << " << EOD\n";
    int previous = 0;
    for (const RatioSample& sample : report.sweep.samples) {
      if (!keep(sample)) continue;
      if (sample.branch != previous) script << "\n";  // lines stop between branches
      previous = sample.branch;
      script << sample.joints[0] << " " << (std::isfinite(sample.ratio.R(0, 0)) ? sample.ratio.R(0, 0) : 0) << "\n";
    }
    script << "EOD\n";
  };
  const auto alive = [](const RatioSample& sample) { return sample.dead == DeadPointKind::None; };
  writeBlock("main", [&](const RatioSample& sample) { return alive(sample) && sample.branch == 0; });
  writeBlock("other", [&](const RatioSample& sample) { return alive(sample) && sample.branch != 0; });
  writeBlock("start", [&](const RatioSample& sample) { return alive(sample) && sample.s == 0; });
  bool lowest_negative = false, others = false;
  for (const RatioSample& sample : report.sweep.samples) {
    lowest_negative |= alive(sample) && sample.ratio.R(0, 0) < 0;
    others |= alive(sample) && sample.branch != 0;
  }
  script << "set xlabel " << quoteGnuplot(report.linkage.joint_names[0] + " [rad]") << " noenhanced\n"
         << "set ylabel "
         << quoteGnuplot("ratio " + report.linkage.motor_names[0] + " / " + report.linkage.joint_names[0])
         << " noenhanced\n"
         << "set yrange [" << (lowest_negative ? -top : 0) << ":" << top << "]\nset grid\nset key top center\n"
         << "set xzeroaxis lt -1\n";
  for (const RatioSample& dead : report.sweep.getDeadPoints())
    script << "set arrow from " << dead.joints[0] << ", graph 0 to " << dead.joints[0]
           << ", graph 1 nohead dashtype 2 lc rgb '" << (dead.dead == DeadPointKind::Joint ? "#b02020" : "#2060b0")
           << "'\n";
  script << "plot $main with lines lw 2 lc rgb '#1f77b4' title 'from the start', ";
  if (others) script << "$other with lines lw 1 lc rgb '#aaaaaa' title 'other branches', ";
  script << "NaN with lines dashtype 2 lc rgb '#b02020' title 'dead points', "
         << "$start with points pt 7 ps 0.8 lc rgb 'black' title 'start'\n";
  return script.str();
}

std::string makeMapScript(const RatioReport& report) {
  const RatioMap& map = *report.map;
  std::ostringstream script;
  script << "set encoding utf8\n$map << EOD\n";
  for (const std::vector<RatioSample>& row : map.rows)
    for (const RatioSample& sample : row)
      script << sample.joints[0] << " " << sample.joints[1] << " " << sample.ratio.condition << "\n";
  script << "EOD\n$dead << EOD\n";
  for (const RatioSample& dead : map.dead_points) script << dead.joints[0] << " " << dead.joints[1] << "\n";
  script << "EOD\n"
         << "set xlabel " << quoteGnuplot(report.linkage.joint_names[0] + " [rad]") << " noenhanced\n"
         << "set ylabel " << quoteGnuplot(report.linkage.joint_names[1] + " [rad]") << " noenhanced\n"
         << "set cblabel 'condition number of R'\nset logscale cb\nset key outside top center horizontal\n"
         << "set palette defined (0 '#f7fbff', 1 '#6baed6', 2 '#08306b')\nset grid\n"
         << "half = " << (map.first[1] - map.first[0]) / 2 << "\n"
         << "plot $map using 1:2:(half):(half):3 with boxxyerror fillcolor palette fillstyle solid noborder notitle, "
         << "$dead with points pt 2 ps 0.8 lc rgb '#b02020' title 'dead points'\n";
  return script.str();
}

}  // namespace

std::string makeRatioScript(const RatioReport& report) {
  return report.map ? makeMapScript(report) : makeCurveScript(report);
}

}  // namespace bielle::cli
