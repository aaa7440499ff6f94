#pragma once
/// \file From smoothed positions, rates and accelerations of motors and joints to closed states of a robot with a fixed base.
///
/// Of a linkage with the sensors S of the noise W^{-1} (log_fit.h), the configuration is that of Eq. (1) there. With A = W S N, the
/// velocity is that of the closed motions nearest to the rates, and the acceleration that of those nearest to the accelerations among
/// which meet J a = -gamma, gamma being what the closures accelerate by at a = 0:
///     v = N argmin |A z - W y'|,    a = a_d + N argmin |A z - W (y'' - S a_d)|,    a_d = -J^+ gamma                   (1)
#include <atomic>
#include <memory>
#include <vector>

#include "identify/local_polynomial.h"
#include "identify/log_fit.h"
#include "identify/torque_fit.h"

namespace bielle {

/// A linkage with what was measured of it.
struct MeasuredLinkage {
  std::shared_ptr<const ReducedCluster> cluster;  ///< with idle spins held
  std::vector<LinkageSensor> sensors;             ///< which tell where it is
  VectorXd q_start;                               ///< nq of the cluster, closed
  Smoothed motion;                                ///< instants x sensors, without offsets
};

/// A coordinate outside all loops.
struct MeasuredCoordinate {
  int position = 0, dof = 0;
  Smoothed motion;  ///< instants x 1
};

struct LoadedMotion {
  std::vector<LoadedState> states;
  std::vector<Eigen::Index>
      instants;             ///< theirs; where a linkage has no configuration near what was measured there is none
  std::vector<int> groups;  ///< of TorqueFit
};

/// Largest turn [rad] of a joint within a window: torques that are smoothed over more are not those in the middle.
inline constexpr double kMostTurnInWindow = 1.2;

/// Leaves out states in which a joint turns by more than kMostTurnInWindow. \param window  s   \return their number
int leaveOutFast(const Model& model, double window, LoadedMotion& motion);

/// \param q        nq, closed, for what stands still
/// \param torques  instants x nu   \param signs  LoadedState::signs, likewise; empty: those of the speeds that are found
/// \return without states if `interrupt` asked for the end
LoadedMotion findLoadedStates(const Model& model, ConstVectorRef q, const std::vector<MeasuredLinkage>& linkages,
                              const std::vector<MeasuredCoordinate>& coordinates, const MatrixXd& torques,
                              const MatrixXd& signs, const std::atomic<bool>& interrupt);

}  // namespace bielle
