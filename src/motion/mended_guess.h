#pragma once
// Guesses that come from elsewhere, from another motion, a serial chain or a recording, made postures and motions of the robot.
#include <vector>

#include "bielle/motion/motion.h"

namespace bielle {

// Where linkages are beyond their margins from dead points, joints go from the node before to the node after instead: on the other
// side of a dead point a linkage is in another configuration, from which no small step leads back. Loops may open by that.
// \param xs  N + 1 states
void leadPastDeadPoints(const Motion& motion, std::vector<VectorXd>& xs);

// Standing feet go to their places and loops close, by least changes of the postures (assembly.h), and velocities become those next to
// the given ones by which both stay so. A node whose feet are out of reach stays as it is.
void standOnFeet(const Motion& motion, std::vector<VectorXd>& xs);

// Nodes that cannot be evaluated, since a step from them would open a loop, come to rest, without torque; if that does not help, they
// take the posture at the start, with the base where it is.
void restNodes(const RobotProblem& problem, ShootingTrajectory& nodes);

}  // namespace bielle
