#pragma once
// What a robot is drawn of, as solids for a workshop.
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

}  // namespace bielle
