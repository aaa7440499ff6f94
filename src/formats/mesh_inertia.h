#pragma once
// Mass and moments of what a mesh encloses.
#include <optional>

#include "bielle/math/se3.h"

namespace bielle {

enum class MeshSolid {
  Enclosed,  // of the volume inside a closed surface
  Overlapping,  // the same of convex ones; MuJoCo's default counts the parts of others that faces hide from the centre again
  Surface       // of the faces
};

/// Of density one: its mass is a volume, or an area.
/// \param corners  of the triangles, three columns each
/// \returns none without a volume or an area
std::optional<Inertia> calcMeshInertia(const Eigen::Matrix3Xd& corners, MeshSolid solid);

}  // namespace bielle
