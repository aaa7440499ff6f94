#include "io/plot.h"

#include <cmath>
#include <sstream>

#include "io/figure.h"

namespace bielle {
namespace {

constexpr int kWidth = 720, kPlotHeight = 330, kEqualHeight = 520;

void writePoints(std::ostream& script, const Curve& curve, const std::string& name) {
  script << "$" << name << " << EOD\n";
  for (const auto& [x, y] : curve.points) {
    if (std::isfinite(x) && std::isfinite(y))
      script << x << " " << y << "\n";
    else
      script << "\n";
  }
  script << "EOD\n";
}

std::string describeStyle(const Curve& curve) {
  const std::string color = " lc rgb '" + curve.color + "'";
  switch (curve.style) {
    case CurveStyle::Points:
      return "with points pt 7 ps 0.3" + color;
    case CurveStyle::Crosses:
      return "with points pt 2 ps 1.2 lw 2" + color;
    case CurveStyle::LinesPoints:
      return std::string("with linespoints pt 7 ps 0.5 lw 2") + (curve.dashed ? " dashtype 2" : "") + color;
    case CurveStyle::Lines:
      break;
  }
  return std::string("with lines lw 2") + (curve.dashed ? " dashtype 2" : "") + color;
}

// Only curves with a finite point: gnuplot stops at an empty plot.
std::vector<const Curve*> findDrawable(const Plot& plot) {
  std::vector<const Curve*> drawable;
  for (const Curve& curve : plot.curves)
    for (const auto& [x, y] : curve.points)
      if (std::isfinite(x) && std::isfinite(y) && (plot.scale != PlotScale::Logarithmic || y > 0)) {
        drawable.push_back(&curve);
        break;
      }
  return drawable;
}

void writePlot(std::ostream& script, const Plot& plot, int index) {
  const std::vector<const Curve*> curves = findDrawable(plot);
  const auto name = [&](size_t i) { return "p" + std::to_string(index) + "c" + std::to_string(i); };
  for (size_t i = 0; i < curves.size(); ++i) writePoints(script, *curves[i], name(i));
  script << "set title " << quoteGnuplot(plot.title) << " noenhanced\nset xlabel " << quoteGnuplot(plot.x_label)
         << " noenhanced\nset ylabel " << quoteGnuplot(plot.y_label) << " noenhanced\n"
         << (plot.scale == PlotScale::Logarithmic ? "set logscale y\n" : "unset logscale y\n")
         << (plot.scale == PlotScale::Equal ? "set size ratio -1\nset xtics 0.1\nset ytics 0.1\n"
                                            : "set size noratio\nset xtics autofreq\nset ytics autofreq\n");
  if (curves.empty())
    script << "set xrange [0:1]\nset yrange [0:1]\nset label 1 'no results' at 0.4, 0.5\nplot NaN notitle\n";
  for (size_t i = 0; i < curves.size(); ++i)
    script << (i ? ", " : "plot ") << "$" << name(i) << " " << describeStyle(*curves[i])
           << (curves[i]->title.empty() ? " notitle" : " title " + quoteGnuplot(curves[i]->title) + " noenhanced");
  script << "\nset xrange [*:*]\nset yrange [*:*]\nunset label 1\n";
}

}  // namespace

bool drawPlots(const std::string& path, const std::vector<Plot>& plots) {
  std::ostringstream script;
  script.precision(9);
  script << "set encoding utf8\nset grid\nset key outside right top\nset multiplot layout " << plots.size() << ",1\n";
  for (size_t i = 0; i < plots.size(); ++i) writePlot(script, plots[i], static_cast<int>(i));
  script << "unset multiplot\n";
  const bool equal = !plots.empty() && plots[0].scale == PlotScale::Equal;
  return drawSvg(path, script.str(), kWidth, (equal ? kEqualHeight : kPlotHeight) * static_cast<int>(plots.size()));
}

}  // namespace bielle
