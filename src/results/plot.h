#pragma once
// Figures, drawn by gnuplot.
#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace bielle {

enum class CurveStyle { Lines, LinesPoints, Points, Crosses };

using PlotPoints = std::vector<std::pair<double, double>>;

struct Curve {
  std::string title;       // empty: not in the legend
  std::string color;       // "#rrggbb"
  PlotPoints points = {};  // those that are not finite interrupt the line
  CurveStyle style = CurveStyle::Lines;
  bool dashed = false;
};

enum class PlotScale {
  Free,
  Logarithmic,  // y
  Polar         // x: angle in degrees, 0 upwards and 90 to the left; y: radius. No labels of axes
};

// Squares in shades of blue, a logarithmic scale of which stands beside the plot.
struct Shades {
  std::string label;
  double size = 0;
  std::vector<std::array<double, 3>> squares;  // x, y and the value
};

struct Plot {
  std::string title, x_label, y_label;  // free text
  std::vector<Curve> curves = {};
  PlotScale scale = PlotScale::Free;
  std::optional<std::pair<double, double>> y_range = std::nullopt;  // empty: that of the curves
  Shades shades = {};                                               // behind the curves
};

// The colours of the models, the same in all figures.
constexpr const char *kClosedColor = "#1f77b4", *kLiftedColor = "#d62728", *kSerialColor = "#7f7f7f";
// y over x, as far as there are both.
template <typename X, typename Y>
PlotPoints pairUp(const X& x, const Y& y) {
  PlotPoints points;
  const std::ptrdiff_t count = std::min<std::ptrdiff_t>(x.size(), y.size());
  for (std::ptrdiff_t k = 0; k < count; ++k) points.emplace_back(x[k], y[k]);
  return points;
}

// Of one of several curves.
const char* getCurveColor(size_t index);

// Draws the plots one below the other, to a temporary file that is renamed. False if gnuplot is not installed.
// \throws InputError when it cannot draw or the file cannot be written
bool drawPlots(const std::string& path, const std::vector<Plot>& plots);

}  // namespace bielle
