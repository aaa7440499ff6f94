#pragma once
/// \file The world of Bielle's own dynamics: reduced coordinates, the contact law, fixed small steps.
///
/// A step of length h from middle to middle: at the configuration there, with M^, N and the loads of closed_tree.h Eq. (1),
/// and with the forces f_i of contacts and stops on the points and coordinates whose velocities are P_i w,
///
///     M^ dw = h (N^T (tau - b - M a_d) + sum_i P_i^T f_i(w + dw / 2)),   w <- w + dw,   drift by h                 (1)
///
/// The first drift and the last one of advance() are half as long: it is the leapfrog, of second order, with springs taken at
/// the middle. The forces of dampers and sliders depend on the mean velocity; (1) is solved by Newton steps with their
/// symmetric part,
///
///     (M^ + h/2 sum_i P_i^T D_i P_i) d = h (..) - M^ dw,   dw <- dw + d,   D_i = -d f_i / d velocity              (2)
///
/// so that no damper limits h; springs do, by h < 2 / frequency. b is taken at a velocity foreseen with the last dw. Since
/// forces act at the middle with the mean velocity, (1) changes the kinetic energy by exactly the work that the books take.
#include <memory>

#include "bielle/worlds/contact_law.h"
#include "bielle/worlds/world.h"

namespace bielle::worlds {

struct BielleWorldOptions {
  WorldOptions world;  ///< time_step 0: kBielleTimeStep
  ContactOptions contact;
};

inline constexpr double kBielleTimeStep = 2.5e-4;  ///< s

/// advance() does not allocate. Its steps are those of the options, or a little shorter, to reach its end.
/// \throws InputError when the robot has no closed standing posture
std::unique_ptr<World> makeBielleWorld(const Model& model, const BielleWorldOptions& options = {});

}  // namespace bielle::worlds
