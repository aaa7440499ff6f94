#include "dynamics/smooth_friction.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "bielle/dynamics/modes.h"

namespace bielle {
namespace {

// The next number of two digits.
double roundUp(double x) {
  const double scale = std::pow(10, 1 - std::floor(std::log10(x)));
  return std::ceil(x * scale - 1e-9) / scale;
}

// Eq. (1).
double calcFastest(const MatrixXd& N, const VectorXd& dampers) {
  const MatrixXd rates = N.transpose() * dampers.asDiagonal() * N;
  return Eigen::SelfAdjointEigenSolver<MatrixXd>(rates, Eigen::EigenvaluesOnly).eigenvalues().maxCoeff();
}

VectorXd listFriction(const Model& model, const std::vector<JointForce>& forces) {
  VectorXd out = VectorXd::Zero(model.nv());
  for (const JointForce& force : forces) out[force.dof] += force.friction / force.friction_speed;
  return out;
}

}  // namespace

SmoothFriction calcSmoothFriction(const Model& model, const ConstraintSet& constraints, ConstVectorRef q, double h) {
  constexpr double kLess = 0.8;
  SmoothFriction out;
  const std::vector<JointForce>& given = model.jointForces();
  if (given.empty()) return out;
  const MatrixXd N = calcModes(model, constraints, q, VectorXd::Zero(model.nv())).N;
  if (N.cols() == 0) return out;
  VectorXd dampers = VectorXd::Zero(model.nv());
  for (const JointForce& force : given) dampers[force.dof] += force.damping;
  const VectorXd mobility = N.rowwise().squaredNorm();  // inverse inertia, as felt at each joint
  out.damped = calcFastest(N, dampers);
  out.rate = calcFastest(N, dampers + listFriction(model, given));
  Eigen::Index fastest = 0;
  dampers.cwiseProduct(mobility).maxCoeff(&fastest);
  out.joint = model.dofs()[static_cast<size_t>(fastest)].joint;
  // A joint alone decays at its damper over its inertia; all of them together at the sum of these at most.
  std::vector<JointForce> forces = given;
  for (double share = 1; calcFastest(N, listFriction(model, forces)) * h > 1; share *= kLess)
    for (size_t i = 0; i < forces.size(); ++i)
      if (const double least = given[i].friction * mobility[given[i].dof] * h / share; least > given[i].friction_speed)
        forces[i].friction_speed = roundUp(least);
  for (size_t i = 0; i < forces.size(); ++i)
    if (forces[i].friction_speed > given[i].friction_speed) out.raised.push_back(forces[i]);
  return out;
}

}  // namespace bielle
