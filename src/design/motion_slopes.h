#pragma once
/// \file How motors, margins, distances, goals and costs of motions change with the variables of a design: by differences from the
/// same motions of robots made for numbers beside x.
///
/// Motions that are optimized for every design (MotionMode::Reoptimized) are not solved again: the cost of an optimum changes by the
/// envelope theorem (envelope.h), the rest by the change of the optimum itself (followed_optimum.h), each with the robot planned for
/// anew: the posture at the start, footholds and references move with it. Kept motions (MotionMode::Kept) are lifted to the robots
/// on both sides (motion/lift.h): joints, base and feet keep their motion, as do the contact forces as far as the motion does not
/// determine them.
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

/// The same of kept motions, without costs and goals. \param solved  of the start design
/// \param outcomes  of keepMotion() for the design x, all lifted
std::vector<MotorSlopes> calcKeptSlopes(const Parametrization& robot, const VectorXd& x,
                                        const std::vector<DesignMotion>& motions,
                                        const std::vector<std::optional<SolvedMotion>>& solved,
                                        const std::vector<MotionOutcome>& outcomes, const std::set<Measure>& requested,
                                        const BodyPairs& left_out);

}  // namespace bielle
