#pragma once
// Angles that grow for ever. Doubles round them ever more coarsely, in the end by more than loops may be open.
#include <vector>

#include "bielle/model/model.h"

namespace bielle {

// Whether something counts the whole turns of a hinge: a range, a spring or a coupler.
bool countsTurns(const Model& model, int joint);
// Hinges whose turns nothing counts: places of their angles in q.
std::vector<int> listFreeTurns(const Model& model);

inline constexpr double kFarAngle = 1e4;  // rad
// The angle without its whole turns if it is beyond kFarAngle.
double leaveOutTurns(double angle);
// Leaves whole turns out of angles beyond kFarAngle, and adds them to `turns` (nq, rad). Returns whether there were any.
bool leaveOutTurns(const std::vector<int>& free_turns, VectorXd& q, VectorXd& turns);

}  // namespace bielle
