#pragma once
// From the options of bielle-simulate to a plan, and to the robot and the ground of a world.
#include "cli/simulate/arguments.h"

namespace bielle::worlds {

// Exit statuses.
inline constexpr int kStood = 0, kFell = 1, kBadInput = 2, kNotDecided = 3;
int getStatus(Outcome outcome);

// Options of free motions, and of motions that are solved first, alone. \throws InputError
void requirePlan(const SimulateArguments& arguments);
// What options name, of the robot. \throws InputError
void requireParts(const SimulateArguments& arguments, const LoadedRobot& robot);
// Whether a plan is carried out; chooses which robot is that of the world.
bool isOfPlan(SimulateArguments& arguments);
// Sets what a motion decides about options. Returns the reason of a choice of control other than the usual one, or nothing.
// \throws InputError
std::string adaptToPlan(SimulateArguments& arguments);
// The motion solved before or, where a robot is given, the motion of that name. \throws InputError, InterruptedPlan
Plan obtainPlan(const SimulateArguments& arguments);

// Where it is carried out, and by what.
struct Scene {
  LoadedRobot robot;  // without random errors
  Model machine;      // with them
  Ground ground;
  std::vector<std::string> warnings;
};
// \throws InputError
Scene makeScene(const Plan& plan, SimulateArguments& arguments);
// What has no effect on this motion, robot and world.
std::vector<std::string> listIdleInPlan(const SimulateArguments& arguments, const Plan& plan, const World& world);

}  // namespace bielle::worlds
