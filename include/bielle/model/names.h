#pragma once
/// \file Names of coordinates and wrench entries, the same in every file and report.
///
/// A coordinate of a joint with one coordinate has the joint's name; other joints append (q | v, ordered as in
/// notation.h):
/// | joint      | q                      | v                 |
/// |------------|------------------------|-------------------|
/// | spherical  | .qx .qy .qz .qw        | .wx .wy .wz       |
/// | universal  | .angle1 .angle2        | .rate1 .rate2     |
/// | planar     | .x .y .angle           | .vx .vy .rate     |
/// | free-flyer | .x .y .z .qx .qy .qz .qw | .vx .vy .vz .wx .wy .wz |
#include <array>
#include <string>
#include <vector>

#include "bielle/model/model.h"

namespace bielle {

/// Names of the entries of q (nq) and of v (nv).
std::vector<std::string> makePositionNames(const Model& model);
std::vector<std::string> makeVelocityNames(const Model& model);

/// Names of the entries of a wrench in frame 1 of its closure: force in N, torque in N m.
constexpr std::array<const char*, 6> kWrenchEntries = {"fx", "fy", "fz", "nx", "ny", "nz"};

/// name.fx, ..., name.nz for every name.
std::vector<std::string> makeWrenchNames(const std::vector<std::string>& names);

/// Index of the name, i.e. a column of a record. \throws InputError when it is absent
int findColumn(const std::vector<std::string>& names, const std::string& name);

/// The names of a list of named things.
template <typename Things>
std::vector<std::string> getNames(const Things& things) {
  std::vector<std::string> names;
  for (const auto& thing : things) names.push_back(thing.name);
  return names;
}

}  // namespace bielle
