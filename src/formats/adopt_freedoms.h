#pragma once
/// \file Which joints of a robot are free, for motors and soles of robots whose files do not give them.
#include <map>
#include <string>
#include <vector>

#include "formats/adopt_feet.h"

namespace bielle {

/// Motors without rotors on joints of one coordinate which together determine how the robot stands near q, as far as such joints can:
/// those nearest to the base; of joints that are as near, in loops first those that do not carry a foot, as cranks do not. Joints with
/// springs are left out.
/// \param efforts  limits by the names of joints, N m or N; others have none
std::vector<Motor> guessMotors(const Model& model, ConstVectorRef q, const std::vector<FoundFoot>& feet,
                               const std::map<std::string, double>& efforts);

/// Angles of joints that turn about the left, by name, at which legs that are straight in the posture of the workspace are bent: thighs
/// forward, shanks backward, feet level.
std::map<std::string, double> bendKnees(const Model& model, const Workspace& ws, const std::vector<FoundFoot>& feet);

/// Whether a foot can turn about its point near q, while the base stands still: one that cannot does not lie flat on a sole in more
/// than single postures.
bool canTurn(const Model& model, ConstVectorRef q, const FoundFoot& foot);

}  // namespace bielle
