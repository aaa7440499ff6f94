#pragma once
/// \file The numbers of a robot that torques tell: masses and centres of mass of its links, armatures and friction of its motors.
///
/// Inertias are not numbers of their own: a link whose mass changes keeps its shape, so that its inertia about its centre of mass grows
/// as its mass, and moves with that centre. Any positive mass is then that of a body that can be.
#include <string>
#include <vector>

#include "bielle/model/model.h"

namespace bielle {

enum class LoadKind { Mass, Com, Armature, Damping, Friction };
/// "mass", "com", "armature", "damping", "friction"
const char* getName(LoadKind kind);

struct LoadNumber {
  LoadKind kind = LoadKind::Mass;
  std::string name;  ///< "LINK.mass", "LINK.com.x", "MOTOR.armature", "MOTOR.damping", "MOTOR.friction"
  std::string unit;
  double value = 0;              ///< in the given robot
  std::vector<int> bodies = {};  ///< of a mass those of its link, which closures weld; of a centre of mass its own
  int axis = 0;                  ///< of a centre of mass, in the frame of the body
  int motor = 0;                 ///< of the others
};

/// All of them: links by link, then motor by motor. Bodies without mass have none.
std::vector<LoadNumber> listLoads(const Model& model);

/// A model with its numbers changed by these amounts. What cannot be is kept off: masses are kShareOfMassLeft of those of the given
/// robot at least, armatures, damping and friction 0 at least.
Model changeLoads(const Model& model, const std::vector<LoadNumber>& numbers, ConstVectorRef changes);
inline constexpr double kShareOfMassLeft = 0.01;

/// The force of a joint, where it has none all zero.
JointForce getJointForce(const Model& model, int joint);

}  // namespace bielle
