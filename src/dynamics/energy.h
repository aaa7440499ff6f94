#pragma once
// Energies of a robot in one workspace or in several lanes at once: kinematics.h describes them.
#include "bielle/dynamics/workspace.h"
#include "dynamics/joint_force.h"
#include "dynamics/point_spring.h"

namespace bielle {

/// Needs placements.
template <typename T>
Vector3<T> calcComOf(const Model& model, const WorkspaceOf<T>& ws) {
  Vector3<T> sum = Vector3<T>::Zero();
  for (int i = 1; i < model.numBodies(); ++i) {
    const Inertia& inertia = model.bodies()[i].inertia;
    sum += inertia.mass * ws.X_WB[i].act(inertia.com.cast<T>());
  }
  return sum / T(model.mass());
}

template <typename T>
T calcSpringEnergy(const JointForce& force, const VectorX<T>& q) {
  const T stretch = q[force.idx_q] - force.rest;
  return stretch * (force.stiffness / 2 * stretch - force.preload);
}

/// Zero at the rest length; needs placements.
template <typename T>
T calcSpringEnergy(const PointSpring& spring, const WorkspaceOf<T>& ws) {
  const Vector3<T> r =
      ws.X_WB[spring.body2].act(spring.point2.cast<T>()) - ws.X_WB[spring.body1].act(spring.point1.cast<T>());
  const T stretch = calcLineLength<T>(r) - spring.rest;
  return stretch * (spring.stiffness / 2 * stretch + spring.preload);
}

/// Needs updateVelocities.
template <typename T>
T calcKineticEnergyOf(const Model& model, const WorkspaceOf<T>& ws) {
  T energy = 0.5 * ws.armature.dot(ws.v.cwiseProduct(ws.v));
  for (int i = 1; i < model.numBodies(); ++i) energy += 0.5 * ws.V[i].dot(ws.h[i]);
  return energy;
}

/// Needs placements.
template <typename T>
T calcPotentialEnergyOf(const Model& model, const WorkspaceOf<T>& ws) {
  T energy = -model.mass() * model.gravity().cast<T>().dot(calcComOf(model, ws));
  for (const JointForce& force : model.jointForces()) energy += calcSpringEnergy<T>(force, ws.q);
  for (const PointSpring& spring : model.pointSprings()) energy += calcSpringEnergy<T>(spring, ws);
  return energy;
}

}  // namespace bielle
