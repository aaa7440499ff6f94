#pragma once
// The Simbody objects behind a SimbodyBridge, and the maps between its coordinates and ours (simbody_bridge.h).
#include <Simbody.h>

#include "simbody_bridge.h"

namespace bielle::validation {

inline SimTK::Vec3 toSimTK(const Vector3d& v) { return {v[0], v[1], v[2]}; }
inline Vector3d toEigen(const SimTK::Vec3& v) { return {v[0], v[1], v[2]}; }
inline SimTK::Rotation toSimTKRotation(const Matrix3d& R) {
  SimTK::Mat33 m;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) m(i, j) = R(i, j);
  return SimTK::Rotation(m, true);  // already orthogonal, not normalized
}
inline Matrix3d toEigen(const SimTK::Mat33& m) {
  Matrix3d R;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) R(i, j) = m(i, j);
  return R;
}
inline SimTK::Transform toSimTK(const SE3& X) { return {toSimTKRotation(X.R), toSimTK(X.p)}; }

struct SimbodyBridge::System {
  System(const Model& model, const std::vector<Closure>& closures);

  const Model model;
  const std::vector<Closure> closures;
  SimTK::MultibodySystem system;
  SimTK::SimbodyMatterSubsystem matter;
  SimTK::GeneralForceSubsystem forces;
  SimTK::Force::DiscreteForces torques;
  std::vector<SimTK::MobilizedBody> bodies;                 // per body of the model, ground first
  std::vector<SimTK::MobilizedBody> first_pins;             // of universal joints made of two Pins, else empty handles
  std::vector<std::vector<SimTK::Constraint>> constraints;  // per closure
  std::vector<int> u_index;                                 // per dof, index into Simbody's u
  SimTK::State state;

  // At the state set last: u = T v.
  VectorXd v;       // nv
  VectorXd tau;     // nv
  MatrixXd T;       // nv x nv
  VectorXd Tdot_v;  // nv, (dT/dt) v

  void setCoordinates(ConstVectorRef q);
  void updateVelocityMap(ConstVectorRef q, ConstVectorRef v);
  // q and v of Simbody's state, in our coordinates.
  void readState(VectorXd& q, VectorXd& v);
  // Between our order of dofs and Simbody's u.
  void scatter(const VectorXd& ours, SimTK::Vector& u) const;
  VectorXd gather(const SimTK::Vector& u) const;
  // Accelerations (or velocities), with the constraint forces (or impulses) of their multipliers.
  OracleSolution makeSolution(const VectorXd& a, const VectorXd& multipliers) const;
  // Constraint forces of Simbody's multipliers.
  void readForces(const SimTK::Vector& multipliers, OracleSolution& out) const;
  // OracleSolution::rounding of Simbody's solver.
  double calcRounding() const;

 private:
  void addBody(int i);
  void addClosure(const Closure& closure);
};

}  // namespace bielle::validation
