#pragma once
/// \file The motion of the motors from which torques tell most about masses, armatures and friction.
///
/// With w = 2 pi / duration, the motor m goes as a sum of sines, over and over again:
///     q_m(t) = q_m(0) + sum_h (a_mh sin(h w t) + b_mh (1 - cos(h w t))),   h = 1 .. kHarmonics                        (1)
/// (Swevers et al., IEEE Transactions on Robotics and Automation 13, 1997); linkages follow. With the scaled Jacobian J D of the
/// numbers (estimate.h), each of them being known to its scale before, the motion of most information has the largest
///     1/2 log det (1 + D J^T J D)                                                                                    (2)
/// (Chaloner and Verdinelli, Statistical Science 10, 1995), so that numbers that no motion shows do no harm. It is looked for by SLSQP
/// with differences, less a penalty for limits of positions, speeds (kMostTurn among them) and torques that are exceeded; in the end
/// all a and b are scaled until none is.
#include <functional>
#include <vector>

#include "identify/loaded_states.h"

namespace bielle {

inline constexpr int kHarmonics = 4;
inline constexpr double kShareOfLimits = 0.9;  ///< of each limit that the motion takes
inline constexpr double kMostTurn = 0.4;  ///< rad, of any joint within a window of polynomials, so that they follow it

struct ExcitationOptions {
  double duration = 10;  ///< s, one period
  double window = 0.1;   ///< s, of the polynomials (local_polynomial.h)
  int evaluations = 50;  ///< with derivatives, at most
  /// Called at each of them with the largest gain so far; false asks for the end, and the best so far is the result.
  std::function<bool(double gain)> progress = {};
};

struct Excitation {
  VectorXd time;                     ///< one period, evenly
  std::vector<LoadedState> states;   ///< at these times; u are the torques of the given robot
  double gain_before = 0, gain = 0;  ///< Eq. (2) of small motions, at which the search begins, and of this one
  double share_of_limits = 0;        ///< the largest
};

/// \param q  nq, closed; where it begins   \param linkages  with the sensors that are motors, and without motion
/// \param period  s, of the rows that come out
/// \throws InputError for motors that slide without a limit of speed, and where linkages do not follow motors, or limits are exceeded,
///   at rest
Excitation findExcitation(const Model& model, ConstVectorRef q, const std::vector<LoadNumber>& numbers,
                          const std::vector<MeasuredLinkage>& linkages, double period,
                          const ExcitationOptions& options);

}  // namespace bielle
