#include "dynamics/whole_turns.h"

#include <algorithm>
#include <cmath>

#include "math/constants.h"

namespace bielle {

bool isAngle(JointKind kind, int k) {
  const bool is_hinge = kind == JointKind::Revolute || kind == JointKind::Continuous || kind == JointKind::Universal;
  return is_hinge || (kind == JointKind::Planar && k == 2);
}

bool countsTurns(const Model& model, int dof) {
  const auto isHeld = [&](const JointForce& force) { return force.dof == dof && force.stiffness != 0; };
  const auto isTerm = [&](const CouplerTerm& term) { return term.dof == dof; };
  const auto isCoupled = [&](const Closure& closure) {
    return std::any_of(closure.terms.begin(), closure.terms.end(), isTerm);
  };
  return std::isfinite(model.lowerLimits()[dof]) || std::isfinite(model.upperLimits()[dof]) ||
         std::any_of(model.jointForces().begin(), model.jointForces().end(), isHeld) ||
         std::any_of(model.closures().begin(), model.closures().end(), isCoupled);
}

std::vector<int> listFreeTurns(const Model& model) {
  std::vector<int> places;
  for (const Joint& joint : model.joints())
    for (int k = 0; k < joint.nv; ++k)
      if (isAngle(joint.kind, k) && !countsTurns(model, joint.idx_v + k)) places.push_back(joint.idx_q + k);
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

VectorXd leaveOutTurns(const Model& model, ConstVectorRef q) {
  VectorXd near = q, turns = VectorXd::Zero(model.nq());
  leaveOutTurns(listFreeTurns(model), near, turns);
  return near;
}

}  // namespace bielle
