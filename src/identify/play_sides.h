#pragma once
/// \file At which of its stops what has play is, by the load that goes through it.
///
/// Play (bielle/model/wear.h) stands at the stop to which the load pushes it, but for the moments of crossing. The load of a coordinate s of
/// play is the work that all forces but those of its stops do as s grows by one unit, along a motion dq/ds that keeps the loops
/// closed with s,
///     f = (dq/ds)^T (S^T u - M a - b)                                                                                (1)
/// All such motions tell the same f where the balance holds. Taken is the one along which the joints behind the linkage stand
/// still, so that f needs the motors' torques and the rods' weight alone, not what the joints carry or touch:
///     dq/dl + N z,    z = argmin |S_j (dq/dl + N z)|                                                                 (2)
/// of a rod (log_fit.h); of a gear, the rotor alone turns. The side is the sign of f where it is clear: above what one reading
/// of the torques may be wrong by, and above kClearLoad of the parts of f, of which it is the difference.
#include <string>
#include <vector>

#include "bielle/model/wear.h"
#include "identify/loaded_states.h"
#include "identify/log_fit.h"

namespace bielle {

inline constexpr double kClearLoad = 0.2;    ///< friction and weights may be wrong by as much
inline constexpr double kLeastClear = 0.02;  ///< share of rows below which a side is not known at all

/// The motors and rods of a linkage that may have play, with the sizes that they have.
/// \param model    the whole one   \param sensors  of which those of motors may be behind a gear with play
/// \param present  play of the given robot
std::vector<LinkagePlay> listLinkagePlays(const Model& model, const ReducedCluster& cluster,
                                          const std::vector<LinkageSensor>& sensors, const std::vector<Play>& present);

/// Loads of play, and how large those are that tell nothing, N m or N: instants x plays.
struct PlayLoads {
  MatrixXd values, least;
};

/// \param motion  of the whole robot, in which only the linkage need move
/// \param noise   standard deviations of the torques (nu)
PlayLoads calcPlayLoads(const Model& model, const MeasuredLinkage& linkage, const std::vector<LinkagePlay>& plays,
                        const LoadedMotion& motion, const VectorXd& noise);

/// Sides at rows of a log: K x plays, 1 or -1 where the loads at the instants before and after agree, else 0; where they do in less than
/// kLeastClear of the rows, 1 in all, with which play is a part of the offset or the length, and neither is seen.
/// \param time      K, s, not falling   \param instants  s, of the loads, increasing
/// \param farthest  s: what is between instants that are farther apart is not known
MatrixXd findSides(const VectorXd& time, const std::vector<double>& instants, const PlayLoads& loads, double farthest);

}  // namespace bielle
