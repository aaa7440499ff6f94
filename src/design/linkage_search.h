#pragma once
/// \file Linkages that move a joint as requested, found among many at random and refined.
///
/// Of a linkage with one motor only the ratio R of motor to joint counts, at the angles that are requested: a torque tau of the joint
/// takes tau / R of the motor, a speed w takes R w. The value of a linkage is, with torques, the root mean square of the motor's; with
/// requested ratios, the largest relative deviation from them; else by how much the largest ratio exceeds the least. It is infinite
/// where the linkage does not close, breaks a limit, or turns the motor faster than it can.
#include <functional>
#include <vector>

#include "bielle/math/types.h"

namespace bielle {

/// What is requested of a joint at several angles.
struct JointDemand {
  VectorXd angles;           ///< rad
  VectorXd ratios;           ///< requested |R|; or empty
  VectorXd torques, speeds;  ///< at the joint, N m and rad/s; or empty
  double largest_speed = 0;  ///< of the motor, rad/s; 0: any

  /// The middle of the range.
  double middle() const { return 0.5 * (angles.minCoeff() + angles.maxCoeff()); }
};

/// Linkages by numbers within bounds. Its functions may be called from several threads at once.
struct LinkageFamily {
  VectorXd lower, upper;
  /// |R| at the angles of the demand, and how far the linkage is from its dead points (in a measure of the family).
  /// \returns false where it does not reach them all within the family's limits
  std::function<bool(const VectorXd& x, VectorXd& ratios, double& margin)> calcRatios;
};

struct FoundLinkage {
  VectorXd x;
  double value = 0;
  double least_ratio = 0, largest_ratio = 0, margin = 0;
  double peak_torque = 0, rms_torque = 0, peak_speed = 0;  ///< of the motor, where the demand has torques; N m, rad/s
};

FoundLinkage rateLinkage(const LinkageFamily& family, const VectorXd& x, const JointDemand& demand);

struct LinkageSearchOptions {
  long samples = 1000000;  ///< at random
  int refined = 50;        ///< of the best, each by NLopt (Sbplx)
  int evaluations = 4000;  ///< at most of each
  int count = 10;          ///< most that are returned
  unsigned seed = 1;
  int threads = 1;
  std::function<void(long samples)> progress = {};  ///< told how many were rated, by one thread at a time
};

/// The best first; those that come out alike are one. The same for the same seed, whatever the number of threads.
std::vector<FoundLinkage> searchLinkages(const LinkageFamily& family, const JointDemand& demand,
                                         const LinkageSearchOptions& options);

}  // namespace bielle
