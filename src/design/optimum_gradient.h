#pragma once
/// \file Gradients of motions that are optimized for every design (MotionMode::Reoptimized).
///
/// The cost of an optimum changes by the envelope theorem (envelope.h), its torques and speeds by the change of the optimum
/// itself (followed_optimum.h), as do margins and distances at the nodes where they are least; no motion is solved
/// again. Both are central differences across each variable, of the robot planned for anew: the posture at the start,
/// footholds and references move with it.
#include "bielle/design/parametrization.h"
#include "design/design_motions.h"
#include "design/gradient.h"

namespace bielle {

/// Slopes of every motion at x. \param outcomes  of remakeMotion() for the design x, all solved
/// \param requested  whether there are margins and distances among them   \param left_out  of distances
/// If one of them cannot be followed, the last one has a failure.
std::vector<MotorSlopes> calcOptimumSlopes(const Parametrization& robot, const VectorXd& x,
                                           const std::vector<DesignMotion>& motions,
                                           const std::vector<MotionOutcome>& outcomes,
                                           const std::set<Measure>& requested, const BodyPairs& left_out);

}  // namespace bielle
