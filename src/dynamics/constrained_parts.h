#pragma once
/// \file The parts of constrained.h, for steps that solve the system of a configuration more than once.
#include "bielle/dynamics/constrained.h"

namespace bielle {

/// Kinematics, mass matrix, J and the factors at q.
/// \returns false if the mass matrix is singular
bool updateConstrainedSystem(const Model& model, Workspace& ws, ConstrainedWorkspace& cws,
                             const ConstraintSet& constraints, ConstVectorRef q);
/// Accelerations and forces at the velocities of the workspace, after updateConstrainedSystem and updateVelocities, with
/// a stabilisation (rows) or, if it is null, without one.
NumericalStatus solveConstrainedSystem(const Model& model, Workspace& ws, ConstrainedWorkspace& cws,
                                       const ConstraintSet& constraints, ConstVectorRef tau,
                                       const VectorXd* stabilization);
/// Of all rows, at the velocities of the workspace.
void calcStabilization(const Workspace& ws, const ConstraintSet& constraints, VectorRef out);

/// The sources dID and dc of the derivatives, without those of the stabilisation, in place of da and dlambda; for
/// velocities and accelerations of the workspace and the forces cws.lambda.
void updateConstrainedSources(const Model& model, Workspace& ws, ConstrainedWorkspace& cws,
                              const ConstraintSet& constraints);
/// Adds those of the stabilisation at the velocities of the workspace.
void addStabilizationSources(const Workspace& ws, const ConstraintSet& constraints, ConstrainedWorkspace& cws);
/// Turns sources into derivatives, after updateInverse() of the system.
NumericalStatus solveConstrainedSources(ConstrainedWorkspace& cws);

}  // namespace bielle
