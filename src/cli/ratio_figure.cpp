#include "cli/ratio_figure.h"

#include <algorithm>
#include <cmath>
#include <functional>

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

// R of the samples that `keep` accepts; a line stops between branches.
Curve makeCurve(const RatioReport& report, const std::string& title, const std::string& color, CurveStyle style,
                const std::function<bool(const RatioSample&)>& keep) {
  Curve curve{title, color, {}, style};
  int branch = 0;
  for (const RatioSample& sample : report.sweep.samples) {
    if (sample.dead != DeadPointKind::None || !keep(sample)) continue;
    if (sample.branch != branch) curve.points.emplace_back(NAN, NAN);
    branch = sample.branch;
    curve.points.emplace_back(sample.joints[0], sample.ratio.R(0, 0));
  }
  return curve;
}

Plot makeCurvePlot(const RatioReport& report) {
  const double top = std::max(4 * calcMedianRatio(report), 2.0);
  const Linkage& linkage = report.linkage;
  Plot plot{"", linkage.joint_names[0] + " [rad]", "ratio " + linkage.motor_names[0] + " / " + linkage.joint_names[0]};
  plot.curves = {
      makeCurve(report, "from the start", kClosedColor, CurveStyle::Lines,
                [](const auto& at) { return at.branch == 0; }),
      makeCurve(report, "other branches", "#aaaaaa", CurveStyle::Lines, [](const auto& at) { return at.branch != 0; }),
      makeCurve(report, "start", "#000000", CurveStyle::Crosses, [](const auto& at) { return at.s == 0; })};
  bool negative = false;
  for (const Curve& curve : plot.curves)
    for (const auto& [angle, ratio] : curve.points) negative |= ratio < 0;
  plot.y_range = {negative ? -top : 0, top};
  for (const DeadPointKind kind : {DeadPointKind::Output, DeadPointKind::Motors}) {
    const bool joint = kind == DeadPointKind::Output;
    Curve dead{joint ? "dead (joint)" : "dead (motor)", joint ? "#b02020" : "#2060b0", {}, CurveStyle::Lines, true};
    for (const RatioSample& sample : report.sweep.deadPoints())
      if ((sample.dead == DeadPointKind::Output) == joint)
        dead.points.insert(
            dead.points.end(),
            {{sample.joints[0], plot.y_range->first}, {sample.joints[0], plot.y_range->second}, {NAN, NAN}});
    plot.curves.push_back(dead);
  }
  return plot;
}

Plot makeDistancePlot(const RatioReport& report) {
  Plot plot{"", report.linkage.joint_names[0] + " [rad]", "distance from the nearest dead point [rad]"};
  Curve curve{"up to 0.5 rad, from the start", kClosedColor};
  for (const RatioSample& sample : report.sweep.samples)
    if (sample.branch == 0 && sample.nearest)
      curve.points.emplace_back(sample.joints[0],
                                std::isfinite(sample.nearest->distance) ? sample.nearest->distance : NAN);
  plot.curves = {curve};
  return plot;
}

Plot makeMapPlot(const RatioReport& report) {
  const RatioMap& map = *report.map;
  Plot plot{"", report.linkage.joint_names[0] + " [rad]", report.linkage.joint_names[1] + " [rad]"};
  plot.shades = {"condition number of R", map.first[1] - map.first[0], {}};
  for (const std::vector<RatioSample>& row : map.rows)
    for (const RatioSample& sample : row)
      plot.shades.squares.push_back({sample.joints[0], sample.joints[1], sample.ratio.condition});
  Curve dead{"dead points", "#b02020", {}, CurveStyle::Crosses};
  for (const RatioSample& sample : map.dead_points) dead.points.emplace_back(sample.joints[0], sample.joints[1]);
  plot.curves = {dead};
  return plot;
}

}  // namespace

std::vector<Plot> makeRatioPlots(const RatioReport& report) {
  std::vector<Plot> plots = {report.map ? makeMapPlot(report) : makeCurvePlot(report)};
  const std::vector<RatioSample>& samples = report.sweep.samples;
  if (std::any_of(samples.begin(), samples.end(), [](const RatioSample& sample) {
        return sample.branch == 0 && sample.nearest && std::isfinite(sample.nearest->distance);
      }))
    plots.push_back(makeDistancePlot(report));
  return plots;
}

}  // namespace bielle::cli
