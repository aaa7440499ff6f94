#pragma once
/// \file The share of a region of placements that a foot can reach.
///
/// The region is a box of placements of the foot relative to the base, about the placement X_BF0 that the foot of the
/// start design has in the standing posture, along the axes of the base:
///     p = p_0 + (x, y, z),    R = Rz(yaw) Ry(pitch) Rx(roll) R_0                                                   (1)
/// Every axis is a range, held, or free (determined by the mechanism). Ranges are divided into equal cells, whose
/// centres are the points. A point is reached if all loops close with the base fixed and the foot at the point, within
/// the joint ranges of the model and, optionally, with a conditioning (conditioning.h) under a bound. Points are tried
/// from their neighbours, beginning at the point next to the standing posture: points that require opening the loops do
/// not count. The share is a staircase function of the design; its steps are 1 / points.
#include <array>
#include <limits>
#include <string>
#include <vector>

#include "bielle/model/model.h"

namespace bielle {

struct WorkspaceAxis {
  enum class Kind { Default, Free, Range };
  Kind kind = Kind::Default;
  double lower = 0, upper = 0;  ///< m or rad; equal: held there
  int points = 7;               ///< 1 if held
};

struct WorkspaceRegion {
  std::string foot;  ///< contact; empty: the first one
  std::string base;  ///< link; empty: the first moving body, or the world if a motor moves that body
  /// x, y, z, roll, pitch, yaw. Default: held at 0, except for the angles of point feet, which are free. If no axis is
  /// given, x ranges over +-0.25 and z over +-0.2 of the distance between foot and base.
  std::array<WorkspaceAxis, 6> axes;
  double max_conditioning = std::numeric_limits<double>::infinity();
};

/// The points of a region, relative to the base of the start design.
struct WorkspaceGrid {
  int contact = 0, base = 0;  ///< indices of the model; all designs have the same
  Eigen::Matrix<bool, 6, 1> held = Eigen::Matrix<bool, 6, 1>::Constant(true);
  std::array<int, 6> counts{};  ///< per axis; the last one changes fastest
  std::vector<SE3> placements;  ///< of the foot in the base
  double max_conditioning = std::numeric_limits<double>::infinity();
};

/// \throws InputError for unknown names, crossed ranges, more than 100000 points, a robot without contacts
WorkspaceGrid makeWorkspaceGrid(const Model& start, const WorkspaceRegion& region);

struct WorkspaceCoverage {
  std::vector<char> reached;  ///< by point
  double share = 0;           ///< 0 .. 1
};
/// \throws InputError when the design cannot stand
WorkspaceCoverage calcCoverage(const Model& model, const WorkspaceGrid& grid);

}  // namespace bielle
