#pragma once
/// \file Plane linkages drawn by pivots and bars, in a file of a part (key `linkage`, docs/parts.md).
///
/// Points are places of a plane through a link, at one posture. Bodies that have a point in common are hinged there, about the normal
/// of the plane: bars to each other, and to links of the robot. A tree of hinges, breadth first from those links, carries the bars;
/// every other coincidence is a closure of three rows, for which a bar that carries no other gets a universal joint, so that no row
/// is redundant. In that posture the coordinates of all hinges are zero, and the links that the drawing shows at an angle are at that
/// angle of their joint.
#include <functional>
#include <string>
#include <vector>

#include "formats/robot_files.h"
#include "formats/yaml_entry.h"

namespace bielle {

/// Where a linkage is added, and what its part calls things.
struct LinkagePlace {
  double side = 1;
  std::function<std::string(const std::string&name, const YamlEntry&entry)> resolve, make_name;
  RobotFiles& files;
  std::vector<std::function<void()>>& later;  ///< when all links are known
};

/// \throws InputError for bars that hang on nothing, points that nobody has, and what is not a linkage
void addPlaneLinkage(const YamlEntry& entry, const LinkagePlace& place);

}  // namespace bielle
