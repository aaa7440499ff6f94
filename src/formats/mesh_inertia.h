#pragma once
// Mass and moments of what a mesh encloses, and of simple solids.
#include <optional>
#include <string>

#include "bielle/math/se3.h"

namespace bielle {

enum class MeshSolid {
  Enclosed,  // of the volume inside closed surfaces, whichever way each is turned
  Overlapping,  // the same of convex ones; MuJoCo's default counts the parts of others that faces hide from the centre again
  Surface       // of the faces
};

/// Of density one: its mass is a volume, or an area.
/// \param corners  of the triangles, three columns each
/// \returns none without a volume or an area
std::optional<Inertia> calcMeshInertia(const Eigen::Matrix3Xd& corners, MeshSolid solid);

/// Volume, and moments per mass about the centre, of a box, sphere, ellipsoid, or of a cylinder or capsule along z.
/// \param half  half edges; radius; half axes; radius and half length between the ends, or between the half balls
/// \returns none for other types
std::optional<Inertia> calcPrimitiveInertia(const std::string& type, const Vector3d& half);

}  // namespace bielle
