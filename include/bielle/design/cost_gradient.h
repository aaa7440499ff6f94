#pragma once
/// \file How the cost of an optimal motion changes with its robot.
#include <functional>

#include "bielle/design/parametrization.h"
#include "bielle/motion/solve.h"

namespace bielle {

/// Derivatives of the optimal cost by all variables, by the envelope theorem (src/design/envelope.h): two models, two motions
/// and two evaluations of their stages per variable; nothing is solved.
/// \param optimum  a solved motion of the robot at x
/// \param make     the same motion for another robot: same options; posture, footholds and references planned again
/// \return (variables), zero for choices
/// \throws InputError when a neighbour of x has no such motion
VectorXd calcCostGradient(const Parametrization& robot, const VectorXd& x, const Solution& optimum,
                          const std::function<Motion(const Model&, const StandingRobot&)>& make);

/// Half the step of a central difference, relative to the width of the bounds: its error grows with the square,
/// rounding with the inverse.
inline constexpr double kDesignStep = 2e-5;
/// The step of a forward difference, likewise: its error grows with the step itself. For derivatives that sweeps leave a thousandth
/// of anyway (src/design/followed_optimum.h).
inline constexpr double kForwardStep = 2e-6;

}  // namespace bielle
