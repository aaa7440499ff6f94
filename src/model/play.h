#pragma once
/// \file Play: joints and rods that give way between two stops.
///
/// What has play is in two parts, with a free coordinate s between them and stops at its ends:
/// - a joint of one coordinate q: the motor, its rotor and the joint's own spring, damper and friction turn q, and the link turns by
///   s more, about the same axis. This is the play of a gear, or of a coupling;
/// - a closure: a rod that is longer by s, along the line between the joints at its ends.
///
/// Everything else stays as it is, so that at s = 0 the robot is that without play. A robot with play is for worlds: nothing
/// commands s, and no plan should rely on it.
#include <string>
#include <vector>

#include "bielle/model/model.h"

namespace bielle {

struct Play {
  std::string name;  ///< of a joint or a closure
  double size = 0;   ///< the way from stop to stop, rad or m; 0: none
};

/// "NAME.play": the coordinate s of a joint or closure.
std::string getPlayName(const std::string& name);

/// The robot with play; bodies, joints and motors of the model keep their names and their order among each other.
/// \param plays  names may have `*`, which stands for any text; of several for one joint or closure, the last one holds
/// \throws InputError for a name that nothing has, a size that is negative, a joint of several coordinates or without an armature,
///   and closures that are no rods: a coupler, a distance, a slider, or one between two bodies that both carry others
Model addPlay(const Model& model, const std::vector<Play>& plays);

}  // namespace bielle
