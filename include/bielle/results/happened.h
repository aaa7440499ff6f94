#pragma once
/// \file The result of what happened to a robot in a world, whatever moved it: `bielle report` and `bielle export` read it like what
/// `bielle simulate` writes.
#include "bielle/results/result.h"

namespace bielle {

/// A motion that was recorded.
struct HappenedMotion {
  std::string motion = "recorded motion";
  Ground ground;
  VectorXd time;                 ///< N + 1 nodes, ascending, s
  RowMatrixXd q, v;              ///< N + 1 x nq, N + 1 x nv
  RowMatrixXd u;                 ///< N x nu, torques that acted from each node to the next, N m or N
  RowMatrixXd contact_wrenches;  ///< N x 6 per contact, of the ground on the foot, in its frame; empty: not known
  std::string facts =
      "{}";  ///< what the summary tells beside, a JSON object: `world`, `outcome`, `outcome_message`, ..
};

/// Writes the files of writeResult(). Accelerations are means; forces of closures are not known.
/// \param name  of the robot, or its path, as given
/// \returns their paths   \throws std::invalid_argument for a wrong shape, numbers that are not finite or facts that are no object;
///   InputError when they cannot be written
std::vector<std::string> writeHappened(const std::string& directory, const std::string& name, const LoadedRobot& robot,
                                       const HappenedMotion& motion);

}  // namespace bielle
