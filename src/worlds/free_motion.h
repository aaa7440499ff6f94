#pragma once
/// \file A mechanism that moves by itself: from a state, under given torques, without a plan, a controller or feet.
#include <vector>

#include "worlds/execution.h"

namespace bielle::worlds {

/// Torques from an instant on, until the next.
struct TimedTorques {
  double time = 0;  ///< s
  VectorXd u;       ///< nu, N m or N
};

struct FreeMotionOptions {
  double duration = 2;                ///< s
  double record_period = 0.01;        ///< s
  std::vector<TimedTorques> torques;  ///< in order of time; before the first, none
  std::vector<Push> pushes;
};

struct FreeMotion {
  Execution execution;       ///< outcome Ended, BrokeOff or Stopped; of the fields of a plan, none is set
  std::vector<Books> books;  ///< one per node of the record
};

/// Moves a world from a closed state. Steps end where torques and pushes change.
/// \param observer  is called after every row of the record
FreeMotion moveFreely(World& world, ConstVectorRef q, ConstVectorRef v, const FreeMotionOptions& options,
                      const ExecutionObserver& observer = {});

/// A spring and damper that hold a motor at a coordinate.
struct MotorSpring {
  int motor = 0;
  double stiffness = 0, damping = 0;  ///< N m/rad and N m s/rad, or N/m and N s/m
  double rest = 0;                    ///< coordinate of the motor's joint, rad or m
};
/// The robot with these springs as joint forces of its model, so that they are the same in every world.
Model addMotorSprings(const Model& model, const std::vector<MotorSpring>& springs);

}  // namespace bielle::worlds
