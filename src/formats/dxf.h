#pragma once
// Plane links of a robot as plates for a workshop, in DXF R12.
#include <string>
#include <utility>
#include <vector>

#include "formats/pivots.h"

namespace bielle {

// A link whose hinges are parallel, or a rod between two pivots, seen along its hinges; the first hole is at the origin and the farthest
// one from it on the x axis, so that plates lie flat.
struct Plate {
  std::string name;
  std::vector<std::pair<std::string, Eigen::Vector2d>> holes;  // pivots at different places, m
};

// \param left_out  names of links that have several pivots and are not plane
std::vector<Plate> listPlates(const Model& model, std::vector<std::string>* left_out = nullptr);

struct DxfText {
  std::string text;
  std::vector<std::string> warnings;  // each names a link that is left out
};

// In mm, one layer a link: its outline, a closed polyline, and its holes, circles. The layer NOTES has names and distances.
// \param hole  diameter, m; the outline stays 1.25 times that from the centres
// \throws InputError when no link is plane
DxfText formatDxf(const Model& model, double hole = 0.008);

}  // namespace bielle
