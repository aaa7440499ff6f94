#pragma once
// Angles that grow for ever. Doubles round them ever more coarsely, in the end by more than loops may be open.
#include <vector>

#include "bielle/model/model.h"

namespace bielle {

// Whether coordinate k of a joint is an angle: of hinges, universal joints and planar ones.
bool isAngle(JointKind kind, int k);
// Whether something counts the whole turns of an angle: a range, a spring or a coupler.
bool countsTurns(const Model& model, int dof);
// Places in q of angles whose turns nothing counts.
std::vector<int> listFreeTurns(const Model& model);

inline constexpr double kFarAngle = 1e4;  // rad
// The angle without its whole turns if it is beyond kFarAngle.
double leaveOutTurns(double angle);
// Leaves whole turns out of angles beyond kFarAngle, and adds them to `turns` (nq, rad). Returns whether there were any.
bool leaveOutTurns(const std::vector<int>& free_turns, VectorXd& q, VectorXd& turns);
// q without whole turns of such angles.
VectorXd leaveOutTurns(const Model& model, ConstVectorRef q);

}  // namespace bielle
