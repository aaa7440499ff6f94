#pragma once
/// \file Distances between the shapes of bodies, with derivatives by the state and by the mechanism.
///
/// A shape is a box, its core, with edges rounded by a radius (model.h). With c the vector from the centre of core b to that
/// of core a, and the columns of G half of the edges of a and of b, the cores are as far apart as the origin is from the zonotope
///     c + G x,  -1 <= x_i <= 1,                                                                                     (1)
/// whose nearest point d n, |n| = 1, is found by active sets (Stark and Parker, "Bounded-variable least-squares", 1995), exactly
/// up to rounding. Where cores overlap, d is negative: the least displacement that parts them is to a face of Eq. (1), and
///     d = max over n of |n c| - sum_i |n G_i|,  n normal to two columns of G                                        (2)
/// (the separating axes of Gottschalk, Lin, Manocha, "OBBTree", 1996). The distance is d less both radii. Eq. (1) is
/// used instead of a library for general convex shapes because robots here have only rounded boxes, and derivatives
/// need exact nearest points, whereas general methods iterate to a tolerance.
///
/// Moving the nearest points within their shapes changes nothing to first order, so that with D the displacement of a body
/// (variation.h, which also has Eq. (3) for a change of the mechanism)
///     d distance = n . (D_a at point_a - D_b at point_b)                                                            (3)
/// wherever the nearest points are unique; at other places (parallel faces, two faces equally deep) Eq. (3) is a directional
/// derivative at most.
#include "bielle/dynamics/workspace.h"

namespace bielle {

struct ShapeDistance {
  double distance = 0;                  ///< m, negative where the shapes overlap
  Vector3d normal = Vector3d::UnitZ();  ///< n, unit, from b to a (world)
  Vector3d point_a = Vector3d::Zero();  ///< nearest, or deepest, points of the surfaces (world), m:
  Vector3d point_b = Vector3d::Zero();  ///< point_a - point_b = distance * normal
};

/// \param X_WA, X_WB  placements of the bodies
ShapeDistance calcDistance(const Shape& a, const SE3& X_WA, const Shape& b, const SE3& X_WB);

/// Adds Eq. (3) per velocity coordinate to `gradient` (1 x nv); needs updatePositions.
void addDistanceGradient(const Model& model, const Workspace& ws, const Shape& a, const Shape& b,
                         const ShapeDistance& distance, MatrixRef gradient);

/// Two shapes of a model on bodies that are not neighbours: no joint or closure connects the bodies, directly or through
/// bodies without shapes. Bodies that a closure welds together count as one.
struct ShapePair {
  int a = 0, b = 0;  ///< indices of shapes
  /// Whether they belong to two legs: parts of the robot with feet that are connected by joints and closures only
  /// through the trunk, the part that carries several feet.
  bool of_two_legs = false;
};
std::vector<ShapePair> listShapePairs(const Model& model);

/// The nearest of some pairs.
struct NearestPair {
  int pair = -1;  ///< index, -1 without pairs
  ShapeDistance distance;
};
/// \param X_WB  placements of the bodies (Workspace::X_WB)
NearestPair findNearestPair(const Model& model, const std::vector<SE3>& X_WB, const std::vector<ShapePair>& pairs);

}  // namespace bielle
