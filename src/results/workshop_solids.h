#pragma once
// What a workshop needs of a robot, as JSON for the programs that write CAD files.
#include <string>
#include <vector>

#include "bielle/model/model.h"

namespace bielle {

struct WorkshopSolids {
  // {"robot": name, "links": [{"name", "at", "solids": [{"shape", "size", "at", "color"}]}]}: what `bielle-step` reads. `at` has the
  // twelve numbers of a placement by rows, x, y, z and origin: of a link in the world, of a solid in its link. Shapes are `box` (edges),
  // `cylinder` (radius, length; its middle is the origin, its axis z) and `sphere` (radius). Lengths are in mm, colours are RGB.
  std::string json;
  std::vector<std::string> warnings;  // each names a link whose meshes are left out
};

// Links that are drawn, each where it is at q.
// \throws InputError when nothing but meshes is drawn
WorkshopSolids formatSolids(const Model& model, const VectorXd& q);

// {"robot": name, "hole": diameter, "links": [{"name", "pivots": [{"name", "at", "axis"}]}]}: what `bielle-dxf` reads.
// `at` is a point in the frame of the link, `axis` the direction of a hinge there, null of anything else. Lengths are
// in mm.
// \param hole  m
std::string formatLinks(const Model& model, double hole);

}  // namespace bielle
