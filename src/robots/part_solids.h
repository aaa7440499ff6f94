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
Vector3d readAxis(const YamlEntry& entry);

/// Solids of a list, without those whose `when` is zero. \throws InputError
std::vector<Solid> readSolids(const YamlEntry& list, double side);

}  // namespace bielle
