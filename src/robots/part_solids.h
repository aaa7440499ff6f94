#pragma once
/// \file Solids in files of parts: one list makes inertia, drawing and, by it, the shape of a body.
#include "formats/yaml_entry.h"
#include "robots/solid.h"

namespace bielle {

/// A point of a part; `side` is -1 in the mirror image, whose y is turned round.
Vector3d readPlace(const YamlEntry& entry, double side);

/// Roll, pitch and yaw [rad] as in a URDF, mirrored likewise.
Matrix3d readAttitude(const YamlEntry& entry, double side);

/// A unit vector, by a name or three numbers; not mirrored.
// Of a joint. In a mirror image (`side` is -1) its y changes its sign, unless it is y itself.
Vector3d readAxis(const YamlEntry& entry, double side);
// Whether an axis is at right angles to the plane of mirror images: coordinates about it have the same sign on both sides.
bool isAcross(const Vector3d& axis);

/// Solids of a list, without those whose `when` is zero. \throws InputError
std::vector<Solid> readSolids(const YamlEntry& list, double side);

}  // namespace bielle
