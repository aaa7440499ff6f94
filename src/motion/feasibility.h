#pragma once
// What is known of a motion before its first iteration (docs/motions.md, "Before the first iteration").
#include <functional>
#include <string>
#include <vector>

#include "bielle/motion/motion.h"

namespace bielle {

// That gravity presses feet on level ground. \param friction  coefficient of the ground
// \throws InputError where there is none, where it points so far from down that every foot slips, or is not in m/s^2
void requireGravity(const Model& model, double friction);

// Turns of a foot, in a step or against the other one, beyond which angles may have been meant as degrees, rad.
inline constexpr double kLargeTurn = 1;

// That feet stand beside each other. \throws InputError naming contacts whose soles overlap
void requireSolesApart(const Model& model, const std::vector<ContactTarget>& soles);

// Compares what motion and start ask for with what robot and ground allow. What cannot succeed is an error; what is doubtful is
// told to `warn`, which may be null, one line for each.
// \param given  the start if it is another one than the guess of the motion, or null
// \throws InputError naming motor, foot, node or coordinate, what is needed, what is allowed, and a remedy
void checkFeasibility(const Motion& motion, const StartingPoint* given,
                      const std::function<void(const std::string&)>& warn);

}  // namespace bielle
