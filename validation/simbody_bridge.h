#pragma once
/// \file A Model as a Simbody multibody system: the independent oracle of Bielle's dynamics.
///
/// src/worlds/simbody_tree.h says how joints and closures become mobilizers and constraints; kinematics, forces and
/// accelerations are Simbody's.
///
/// With u = T(q) v, in the order of our dofs, Simbody's quantities are returned in our coordinates:
///     M = T' M_s T,    b = T' (b_s + M_s dT/dt v),    J = G T,    tau_s = T^{-T} tau,    a = T^{-1} (udot - dT/dt v)
/// Simbody writes M udot + G' m = f: its constraint forces have the opposite sign, which is reversed here.
///
/// Simbody has no rotor inertia. solveBySimbody() therefore ignores the armature; solveWithArmature() solves
///     [M + diag(armature), J'; J, 0] [a; m] = [tau - b; -(dJ/dt v)]
/// by the null space of the scaled rows, dense and rank revealing; all terms are Simbody's. Extended precision allows
/// finite differences of the result.
#include <memory>

#include "bielle/model/model.h"

namespace bielle::validation {

struct OracleSolution {
  VectorXd a;                      ///< nv
  VectorXd constraint_force;       ///< nv, J^T lambda
  std::vector<Vector6d> wrenches;  ///< per closure, on body 1, in frame 1
  /// Relative error of the solution due to rounding: 2^-52 times the condition number of G M^-1 G' (with rank tolerance
  /// 1e-11), which Simbody's solver forms; zero for solveWithArmature.
  double rounding = 0;
};

enum class Precision { Double, Extended };

/// Rows of notation.h for the closures of a bridge, stacked.
struct ClosureRows {
  MatrixXd J;             ///< rows x nv: velocities of the closures are J v
  VectorXd residual;      ///< rows
  int num_loop_rows = 0;  ///< those of the model's own closures come first
};

class SimbodyBridge {
 public:
  /// \param closures of the model and contacts, as ConstraintSet::closures orders them
  SimbodyBridge(const Model& model, const std::vector<Closure>& closures);
  ~SimbodyBridge();
  SimbodyBridge(const SimbodyBridge&) = delete;
  SimbodyBridge& operator=(const SimbodyBridge&) = delete;

  /// Sets q (nq), v (nv), generalized forces tau (nv) and realizes everything but accelerations.
  void setState(ConstVectorRef q, ConstVectorRef v, ConstVectorRef tau);

  SE3 getPlacement(int body) const;    ///< of a body in the world
  Vector6d calcTwist(int body) const;  ///< of a body, in its own frame
  double calcKineticEnergy() const;    ///< J, of the bodies; of the rotors too (diag(armature))
  Vector3d calcCom() const;            ///< of the whole robot, m (world)
  double calcPotentialEnergy() const;  ///< J, zero for a centre of mass at the origin
  MatrixXd calcMassMatrix() const;     ///< nv x nv, armature included
  VectorXd calcBias() const;           ///< nv
  /// Generalized forces of accelerations a (nv), constraints ignored, armature included.
  VectorXd calcInverseDynamics(ConstVectorRef a) const;
  /// Generalized forces J^T lambda (nv) of wrenches per closure on body 1 in frame 1, and their opposites on body 2; of
  /// a coupler, the first entry is its force.
  VectorXd calcWrenchForces(const std::vector<Vector6d>& wrenches) const;
  /// Residual of a coupler and sum of its coefficients times velocities, from the coordinates of Simbody's joints.
  double calcCouplerGap(const Closure& coupler) const;
  double calcCouplerRate(const Closure& coupler) const;
  /// Simbody's constraint rows x nv, stacked by closure (signs and rows differ from those of notation.h).
  MatrixXd calcConstraintJacobian() const;
  /// Simbody's realize(Acceleration), which ignores the armature.
  /// \throws std::exception of Simbody, for a mass matrix that is singular without armature
  OracleSolution solveBySimbody();
  /// Simbody's rows J a + dJ/dt v, in the order of calcConstraintJacobian.
  VectorXd calcConstraintAcceleration(ConstVectorRef a) const;
  /// J by the generalized forces of unit wrenches, residuals by the places of the frames.
  ClosureRows calcClosureRows() const;
  /// The part of the accelerations (nv x k) that J a = targets (rows x k) adds: M a + J' m = 0, armature included.
  MatrixXd calcResponse(const MatrixXd& J, const MatrixXd& targets) const;
  /// Rigid impact from the velocity set: OracleSolution::a is v+ of M (v+ - v) = J' L, J v+ = rates (in the order of
  /// calcConstraintJacobian; 0 where nothing opens), wrenches are impulses.
  OracleSolution solveImpact(ConstVectorRef rates) const;
  /// Generalized forces of gravity and of springs, dampers and friction (nv), with the sign of motor forces.
  VectorXd calcPassiveForces() const;
  /// The part of dampers and friction (nv).
  VectorXd calcDissipativeForces() const;
  /// Solves the system with armature, see above.
  OracleSolution solveWithArmature(Precision precision = Precision::Extended) const;

  /// Integrates Simbody's equations from the state set, tau held, by Runge-Kutta-Merson with projection of the
  /// constraints at every step; q and v are overwritten with the final ones. Ignores the armature.
  /// \param accuracy relative local error of the integrator, also the constraint tolerance
  void integrate(double duration, double accuracy, VectorXd& q, VectorXd& v);

 private:
  struct System;
  std::unique_ptr<System> s_;
};

}  // namespace bielle::validation
