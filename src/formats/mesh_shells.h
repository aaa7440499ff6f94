#pragma once
// The closed shells of a mesh, and which way they are turned.
#include "bielle/math/types.h"

namespace bielle {

/// Turns shells inside out that are seen from inside, as mirrored instances in a file are, so that their volumes do not cancel. What
/// lies inside a shell, such as a cavity, keeps its way relative to that. Triangles that close nothing stay as they are.
/// \param corners  of the triangles, three columns each
Eigen::Matrix3Xd turnShellsOutwards(Eigen::Matrix3Xd corners);

}  // namespace bielle
