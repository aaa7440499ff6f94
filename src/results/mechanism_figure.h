#pragma once
// A robot's mechanism as a plane figure: pivots, bars, motors, belts and soles, seen along the axis that most of its hinges have.
#include <array>
#include <string>
#include <vector>

#include "bielle/model/model.h"
#include "results/drawing.h"

namespace bielle {

// Points in m, to the right and up.
struct FigureLink {
  std::string name;
  Polyline outline;      // two ends of a bar, or the corners of a plate
  bool in_loop = false;  // else part of a chain
};

struct FigurePivot {
  Point2 at;
  std::vector<std::string> names;  // of the joints and closures there
  bool has_motor = false;
};

struct FigureDistance {
  std::string link, from, to;
  Point2 a, b;
  double length =
      0;  // m, from pivot to pivot as of calcPivotDistance(): not that of the picture where a bar is slanted
};

using FigureLine = std::array<Point2, 2>;

struct MechanismFigure {
  std::string caption;  // from where it is seen, and how many limbs one of them stands for
  std::vector<FigureLink> links;
  std::vector<FigurePivot> pivots;
  std::vector<FigureDistance> distances;
  std::vector<FigureLine> soles, belts, springs;
};

// Of limbs that look the same, as left and right legs do, one is drawn. \param q  nq, closed
MechanismFigure makeMechanismFigure(const Model& model, ConstVectorRef q);

// The standing posture, or else one in which the loops close.
VectorXd makeDrawnPosture(const Model& model);

struct MechanismPicture {
  double width = 900, height = 700;  // most, px; the picture is as large as its contents at the largest scale that fits
  double font = 12;                  // px
  bool has_dimensions = true;        // beside the names
  std::string title = {};
  const MechanismFigure* behind = nullptr;  // in grey, without names; `title` says what it is
};

// An SVG element; no two of its texts overlap.
std::string formatMechanism(const MechanismFigure& figure, const MechanismPicture& picture);

}  // namespace bielle
