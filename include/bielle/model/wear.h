#pragma once
/// \file What a robot has in worlds alone: no plan and no controller knows of it.
///
/// Play: joints and rods that give way between two stops. What has it is in two parts, with a free coordinate s between them and
/// stops at its ends:
/// - a joint of one coordinate q: the motor, its rotor and the joint's own spring, damper and friction turn q, and the link turns by
///   s more, about the same axis. This is the play of a gear, or of a coupling;
/// - a closure: a rod that is longer by s, along the line between the joints at its ends.
///
/// Everything else stays as it is, so that at s = 0 the robot is that without play. Nothing commands s.
#include <string>
#include <vector>

#include "bielle/model/model.h"

namespace bielle {

struct Play {
  std::string name;  ///< of a joint or a closure
  double size = 0;   ///< the way from stop to stop, rad or m; 0: none
};

/// Friction of the pivots at the ends of a rod, which grows with the force that goes through it. With lambda the force
/// of a closure (N, without its moment), w the relative angular velocity of the two sides of a pivot, and S as in
/// model/stiction.h, they turn against
///
///     tau = -r |lambda| (mu_s S(w; v_c) - (mu_s - mu) S(w; v_s)),   S(w; s) = w / sqrt(|w|^2 + s^2)               (1)
struct RodFriction {
  std::string closure;                 ///< a ball or a hinge, which is a pivot itself, or a weld
  double coefficient = 0, radius = 0;  ///< mu; r of the ball or pin, m
  double friction_speed = 0.01;        ///< v_c, rad/s
  double stiction = 0;                 ///< mu_s; that of sliding where there is no more
  double stribeck_speed = 0.1;         ///< v_s, rad/s
  std::vector<std::string> joints;     ///< further pivots that bear the same force, as at the other end of the rod
};

/// Of several entries for one joint or closure, the last one holds.
struct Wear {
  std::vector<Play> plays;  ///< names may have `*`, which stands for any text
  std::vector<RodFriction> frictions;
};

/// "NAME.play": the coordinate s of a joint or closure.
std::string getPlayName(const std::string& name);

/// The play of each joint and closure that has any: joints first, in the order of the model.
/// \throws InputError as addPlay() does
std::vector<Play> listPlays(const Model& model, const std::vector<Play>& plays);

/// The robot with play; bodies, joints and motors of the model keep their names and their order among each other.
/// \param plays  as in Wear
/// \throws InputError for a name that nothing has, a size that is negative, a joint of several coordinates or without an armature,
///   and closures that are no rods: a coupler, a distance, a slider, or one between two bodies that both carry others
Model addPlay(const Model& model, const std::vector<Play>& plays);

}  // namespace bielle
