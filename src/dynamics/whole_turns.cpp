#include "dynamics/whole_turns.h"

#include <algorithm>
#include <cmath>

#include "math/constants.h"

namespace bielle {

bool countsTurns(const Model& model, int joint) {
  const int dof = model.joints()[joint].idx_v;
  const auto isHeld = [&](const JointForce& force) { return force.joint == joint && force.stiffness != 0; };
  const auto isTerm = [&](const CouplerTerm& term) { return term.joint == joint; };
  const auto isCoupled = [&](const Closure& closure) {
    return std::any_of(closure.terms.begin(), closure.terms.end(), isTerm);
  };
  return std::isfinite(model.lowerLimits()[dof]) || std::isfinite(model.upperLimits()[dof]) ||
         std::any_of(model.jointForces().begin(), model.jointForces().end(), isHeld) ||
         std::any_of(model.closures().begin(), model.closures().end(), isCoupled);
}

std::vector<int> listFreeTurns(const Model& model) {
  std::vector<int> places;
  for (int i = 1; i < model.numBodies(); ++i) {
    const Joint& joint = model.joints()[i];
    if ((joint.kind == JointKind::Revolute || joint.kind == JointKind::Continuous) && !countsTurns(model, i))
      places.push_back(joint.idx_q);
  }
  return places;
}

double leaveOutTurns(double angle) { return std::abs(angle) <= kFarAngle ? angle : std::remainder(angle, 2 * kPi); }

bool leaveOutTurns(const std::vector<int>& free_turns, VectorXd& q, VectorXd& turns) {
  bool any = false;
  for (int i : free_turns) {
    const double rest = leaveOutTurns(q[i]);
    if (rest == q[i]) continue;
    turns[i] += q[i] - rest;
    q[i] = rest;
    any = true;
  }
  return any;
}

}  // namespace bielle
