#pragma once
/// \file The numbers of a linkage that a log can tell: lengths of links, and places of joints and of the ends of closures.
///
/// Links that are welded to each other by a closure are one, as the halves of a rod. A link with two pivots has a length: their
/// distance, between hinges (which are parallel) and from a hinge to a ball that across the axis. Places are coordinates in the
/// link's own frame.
#include <string>
#include <vector>

#include "bielle/dynamics/variation.h"
#include "dynamics/reduction.h"

namespace bielle {

/// A joint in the link that carries it, an end of a closure in its link, or the length of a distance.
struct GeometryMove {
  enum class Kind { Joint, Frame1, Frame2, Length } kind = Kind::Joint;
  int index = 0;                      ///< joint or closure
  Vector3d along = Vector3d::Zero();  ///< by how much it moves per m of the number, in the link that carries it
};

struct GeometryNumber {
  std::string name;                 ///< "rod" of a length; "PLACE.x" of a coordinate
  double value = 0;                 ///< m, in the given robot
  bool is_rod = false;              ///< a length of a link without motor and serial joint: it bears on its ends alone
  std::vector<GeometryMove> moves;  ///< indices are those of the cluster's model
};

/// Of every body, the first one of those that closures weld to it.
std::vector<int> groupBodies(const Model& model);

/// All numbers of a linkage, lengths first.
/// \param model  the whole one, whose names count   \param q  nq of the cluster, closed
std::vector<GeometryNumber> listGeometry(const Model& model, const ReducedCluster& cluster, ConstVectorRef q);

/// A model with its numbers changed by these amounts, m. Frames, springs and contacts at a place that moves go with it; links keep
/// their inertia.
/// \param cluster  null: the moves count in the model itself; else in that of this cluster of the model
Model changeGeometry(const Model& model, const ReducedCluster* cluster, const std::vector<GeometryNumber>& numbers,
                     ConstVectorRef changes);

/// Derivative of the cluster's model by a number: the same for every model with these moves, since rotations stay.
ModelVariation makeVariation(const Model& cluster_model, const GeometryNumber& number);

}  // namespace bielle
