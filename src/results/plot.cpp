#include "results/plot.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "formats/aside_file.h"
#include "formats/process.h"
#include "model/number_text.h"

namespace bielle {
namespace {

constexpr int kWidth = 720, kPlotHeight = 330, kTallHeight = 520;
constexpr int kDigits = 9;
// Over the largest magnitude: the extent of what counts as flat, and half of the range that it is given.
constexpr double kFlat = 1e-8, kWidening = 0.01;

bool isFinite(const std::pair<double, double>& point) {
  return std::isfinite(point.first) && std::isfinite(point.second);
}

// Free text as a string of gnuplot; without its markup.
std::string quote(const std::string& text) {
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? "''" : std::string(1, c);
  return quoted + "'";
}

std::string quoteLabel(const std::string& text) { return quote(text) + " noenhanced"; }

void writePoints(std::ostream& script, const Curve& curve, const std::string& name) {
  script << "$" << name << " << EOD\n";
  for (const std::pair<double, double>& point : curve.points) {
    if (isFinite(point)) script << point.first << " " << point.second;
    script << "\n";
  }
  script << "EOD\n";
}

std::string describeStyle(const Curve& curve) {
  static const char* const kStyles[] = {"lines lw 2", "linespoints pt 7 ps 0.5 lw 2", "points pt 7 ps 0.3",
                                        "points pt 2 ps 1.2 lw 2"};
  return std::string("with ") + kStyles[static_cast<int>(curve.style)] + (curve.dashed ? " dashtype 2" : "") +
         " lc rgb '" + curve.color + "'";
}

// Only curves with a finite point: gnuplot stops at an empty plot.
std::vector<const Curve*> findDrawable(const Plot& plot) {
  std::vector<const Curve*> drawable;
  for (const Curve& curve : plot.curves)
    if (std::any_of(curve.points.begin(), curve.points.end(), [&](const auto& point) {
          return isFinite(point) && (plot.scale != PlotScale::Logarithmic || point.second > 0);
        }))
      drawable.push_back(&curve);
  return drawable;
}

struct Range {
  double least = std::numeric_limits<double>::infinity(), most = -least;
  void add(double value) { least = std::min(least, value), most = std::max(most, value); }
};

// Of an axis whose values are all the same, about which gnuplot would warn.
void writeFlatRange(std::ostream& script, const char* axis, const Range& range) {
  const double largest = std::max(std::abs(range.least), std::abs(range.most));
  if (range.least > range.most || range.most - range.least > kFlat * largest) return;
  const double margin = largest > 0 ? kWidening * largest : 1;
  script << "set " << axis << "range [" << range.least - margin << ":" << range.most + margin << "]\n";
}

void writeRanges(std::ostream& script, const Plot& plot, const std::vector<const Curve*>& curves) {
  Range x, y, shade;
  for (const Curve* curve : curves)
    for (const std::pair<double, double>& point : curve->points)
      if (isFinite(point)) x.add(point.first), y.add(point.second);
  for (const auto& [at_x, at_y, value] : plot.shades.squares) {
    shade.add(value);
    for (const double side : {-0.5, 0.5}) x.add(at_x + side * plot.shades.size), y.add(at_y + side * plot.shades.size);
  }
  if (plot.scale == PlotScale::Polar) {
    script << "set rrange [0:" << (y.most > 0 ? "*" : "1") << "]\n";
    return;
  }
  writeFlatRange(script, "x", x);
  writeFlatRange(script, "cb", shade);
  if (plot.y_range)
    script << "set yrange [" << plot.y_range->first << ":" << plot.y_range->second << "]\n";
  else
    writeFlatRange(script, "y", y);
}

void writeAxes(std::ostream& script, const Plot& plot) {
  script << "reset\nset grid\nset key outside right top\nset title " << quoteLabel(plot.title) << "\nset xlabel "
         << quoteLabel(plot.x_label) << "\nset ylabel " << quoteLabel(plot.y_label) << "\n";
  if (plot.scale == PlotScale::Logarithmic) script << "set logscale y\n";
  if (plot.scale == PlotScale::Polar)
    script << "set polar\nset angles degrees\nset theta top ccw\nset grid polar 45\nunset border\nunset xtics\nunset "
              "ytics\nset rtics\nset size square\nset lmargin 8\nset ttics 0, 45 format '%g°'\n";
}

void writePlot(std::ostream& script, const Plot& plot, int index) {
  const std::vector<const Curve*> curves = findDrawable(plot);
  const std::string prefix = "p" + std::to_string(index) + "c";
  for (size_t i = 0; i < curves.size(); ++i) writePoints(script, *curves[i], prefix + std::to_string(i));
  writeAxes(script, plot);
  writeRanges(script, plot, curves);
  std::string separator = "plot ";
  if (!plot.shades.squares.empty()) {
    const std::string name = "$p" + std::to_string(index) + "s";
    script << name << " << EOD\n";
    for (const auto& [x, y, value] : plot.shades.squares) script << x << " " << y << " " << value << "\n";
    script << "EOD\nset cblabel " << quoteLabel(plot.shades.label)
           << "\nset logscale cb\nset palette defined (0 '#f7fbff', 1 '#6baed6', 2 '#08306b')\n"
           << "set key outside top center horizontal\nhalf = " << plot.shades.size / 2 << "\n"
           << separator << name
           << " using 1:2:(half):(half):3 with boxxyerror fillcolor palette fillstyle solid noborder notitle";
    separator = ", ";
  } else if (curves.empty()) {
    script << "set xrange [0:1]\nset yrange [0:1]\nset label 1 'no results' at 0.4, 0.5\nplot NaN notitle";
  }
  for (size_t i = 0; i < curves.size(); ++i) {
    script << separator << "$" << prefix << i << " " << describeStyle(*curves[i])
           << (curves[i]->title.empty() ? " notitle" : " title " + quoteLabel(curves[i]->title));
    separator = ", ";
  }
  script << "\n";
}

}  // namespace

const char* getCurveColor(size_t index) {
  static const char* const kColors[] = {"#1f77b4", "#d62728", "#2ca02c", "#9467bd",
                                        "#ff7f0e", "#8c564b", "#e377c2", "#17becf"};
  return kColors[index % std::size(kColors)];
}

bool drawPlots(const std::string& path, const std::vector<Plot>& plots) {
  if (!isOnPath("gnuplot")) return false;
  AsideFile figure(path), source(path + ".gnuplot");  // the script is never committed and thus removed
  const bool tall = !plots.empty() && (plots[0].scale == PlotScale::Polar || !plots[0].shades.squares.empty());
  const int height = (tall ? kTallHeight : kPlotHeight) * static_cast<int>(plots.size());
  TextStream script;
  script.precision(kDigits);
  script << "set terminal svg size " << kWidth << "," << height << " font 'Helvetica,13' background 'white'\n"
         << "set output " << quote(figure.aside()) << "\nset encoding utf8\nset multiplot layout " << plots.size()
         << ",1\n";
  for (size_t i = 0; i < plots.size(); ++i) writePlot(script, plots[i], static_cast<int>(i));
  script << "unset multiplot\nset output\n";
  source.write(script.str());
  if (waitForProcess(startProcess({"gnuplot", source.aside()})) != 0) failToWrite(path, "gnuplot failed");
  figure.commit();
  return true;
}

}  // namespace bielle
