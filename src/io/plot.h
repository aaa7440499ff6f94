#pragma once
// Curves over numbers, as scripts for gnuplot.
#include <string>
#include <utility>
#include <vector>

namespace bielle {

enum class CurveStyle { Lines, LinesPoints, Points, Crosses };

struct Curve {
  std::string title;  // empty: not in the legend
  std::string color;  // "#rrggbb"
  CurveStyle style = CurveStyle::Lines;
  bool dashed = false;
  std::vector<std::pair<double, double>> points;  // points that are not finite interrupt the line
};

enum class PlotScale { Free, Logarithmic /* y */, Equal /* a metre is a metre in x and y */ };

struct Plot {
  std::string title, x_label, y_label;
  PlotScale scale = PlotScale::Free;
  std::vector<Curve> curves;
};

// The colours of the models, the same in all figures.
constexpr const char *kClosedColor = "#1f77b4", *kLiftedColor = "#d62728", *kSerialColor = "#7f7f7f";

// Draws the plots one below the other. False if gnuplot is not installed. \throws ModelError when it cannot be drawn
bool drawPlots(const std::string& path, const std::vector<Plot>& plots);

}  // namespace bielle
