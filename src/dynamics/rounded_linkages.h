#pragma once
/// \file Linkages that are overconstrained but for the rounding of their numbers, taken for the ideal ones that were rounded.
///
/// A plane four-bar on hinges of five rows moves because three of them say nothing. With axes that are parallel to 1e-6 rad
/// they say something: it is locked. What was meant is found for each cluster of loops together.
///
/// 1. With r the residuals of its closures (angles, and lengths in units of L of loop_conflict.h), J = dr/dq of n dofs and a
///    supposed rank m, its postures are followed in the least-squares sense,
///        dq = -V_m S_m^-1 U_m^T r,    J = U S V^T, of which the m largest singular values are kept                  (1)
///    Where the other rows, U_0^T r, stay within the tolerance over some 0.2 rad or more, it was meant to have n - m
///    freedoms. Ranks are supposed from the least that the tolerance allows upwards; what moves as it is written is not
///    touched.
/// 2. The placements of its joints and of the ends of its closures change by twists p, in units of the tolerance, so little
///    as will do for all of several postures k to close: with P = dr/dp, by Gauss-Newton steps of least norm
///        U_0k^T P_k dp = -U_0k^T r_k                                                                                (2)
///    Since what was rounded is a solution of about the length of the tolerance, so is this one.
/// 3. It is accepted if other postures close to 1e-12 with the rank m, and no placement has changed by more than rounding
///    can have changed it.
#include <map>
#include <string>
#include <vector>

#include "bielle/model/model.h"

namespace bielle {

/// By how much numbers may be off, half a unit of their last decimals. 0: not at all.
struct RoundingTolerance {
  double angle = 0, length = 0;  ///< rad; m
  /// Whether somebody says so, who may say up to kMostGivenRounding; else at most what is taken for rounding counts.
  bool is_given = false;
  /// How far the two points are apart that the axis of a hinge runs through, m, by its closure: length / lever is its angle.
  std::map<std::string, double> levers;
};

/// The least and the most that is taken for rounding: rad; m, and of the mechanism's size (L of loop_conflict.h).
inline constexpr double kLeastRounding = 1e-9, kMostAngleRounding = 1e-3, kMostLengthRounding = 1e-4;
/// What is hardly meant, in rad, and of the size.
inline constexpr double kMostGivenRounding = 3e-3;

/// How the axes of a linkage lie to each other.
enum class LinkageShape { Plane, Spherical, Other };

/// A cluster of loops that does not have the mobility that it was meant to have.
struct RoundedLinkage {
  std::vector<int> closures;  ///< indices into Model::closures()
  std::vector<int> joints;    ///< body/joint indices
  LinkageShape shape = LinkageShape::Other;
  int written = 0, meant = 0;    ///< mobility; as written (of short_of_freedoms: as read), -1 if the loops do not close
  double angle = 0, length = 0;  ///< largest change of a placement that gives it back, rad and m
  double apart = 0;              ///< largest angle between axes that were meant to be parallel, rad
  std::vector<std::string> axes;  ///< the two of them, if that is more than rounding: "joint 'knee'", "closure 'pin'"
};

struct RoundedLinkages {
  Model model;                         ///< with the ideal linkages; a copy of the given one if there are none
  std::vector<RoundedLinkage> mended;  ///< changed within the tolerance
  /// Not changed: these do not close, do not move, or have fewer freedoms than motors, but would with a change beyond the tolerance.
  std::vector<RoundedLinkage> locked;
  /// Not changed, fewer freedoms than motors, and no small change is known that helps.
  std::vector<RoundedLinkage> short_of_freedoms;
};

RoundedLinkages findRoundedLinkages(const Model& model, const RoundingTolerance& tolerance);

}  // namespace bielle
