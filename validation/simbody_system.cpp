#include "simbody_system.h"

#include <algorithm>
#include <limits>

#include "math/decompositions.h"

namespace bielle::validation {

SimTK::Vector SimbodyBridge::System::calcPassiveForces() const {
  return system.getMobilityForces(state, SimTK::Stage::Dynamics) - applied;
}

double SimbodyBridge::System::calcRounding() const {
  SimTK::Matrix delassus;
  matter.calcProjectedMInv(state, delassus);
  const int m = delassus.nrow();
  if (m == 0) return 0;
  const MatrixXd W = MatrixXd::NullaryExpr(m, m, [&](Eigen::Index i, Eigen::Index j) { return delassus(i, j); });
  const VectorXd sigma = Eigen::SelfAdjointEigenSolver<MatrixXd>(W, Eigen::EigenvaluesOnly).eigenvalues();
  const double largest = sigma[m - 1];
  double least = largest;
  for (double s : sigma)
    if (s > 1e-11 * largest) least = std::min(least, s);
  return std::numeric_limits<double>::epsilon() * largest / least;
}

OracleSolution SimbodyBridge::System::makeSolution(const VectorXd& a, const VectorXd& multipliers) const {
  OracleSolution out;
  out.a = a;
  SimTK::Vector m(static_cast<int>(multipliers.size()));
  for (int i = 0; i < m.size(); ++i) m[i] = multipliers[i];
  readForces(m, out);
  return out;
}

void SimbodyBridge::System::readForces(const SimTK::Vector& multipliers, OracleSolution& out) const {
  SimTK::Vector generalized;
  matter.multiplyByGTranspose(state, multipliers, generalized);
  out.constraint_force = -(T.transpose() * gather(generalized));
  int row = 0;  // only holonomic constraints: multipliers are consecutive
  for (size_t c = 0; c < closures.size(); ++c) {
    if (closures[c].kind == ClosureKind::Coupler) {
      out.wrenches.push_back(-multipliers[row++] * Vector6d::Unit(0));
      continue;
    }
    const SE3 X_B1 = closures[c].X_B1;
    const int body1 = closures[c].body1;
    const Matrix3d R_WB = toEigen(bodies[body1].getBodyRotation(state));
    Vector6d wrench_W = Vector6d::Zero();  // about the origin of body 1, world axes
    for (const SimTK::Constraint& constraint : constraints[c]) {
      int m, mv, ma;
      constraint.getNumConstraintEquationsInUse(state, m, mv, ma);
      SimTK::Vector_<SimTK::SpatialVec> body_forces;
      SimTK::Vector mobility_forces, part(m);
      for (int i = 0; i < m; ++i) part[i] = multipliers[row++];
      constraint.calcConstraintForcesFromMultipliers(state, part, body_forces, mobility_forces);
      const Matrix3d R_WA = toEigen(constraint.getAncestorMobilizedBody().getBodyRotation(state));
      for (SimTK::ConstrainedBodyIndex b(0); b < constraint.getNumConstrainedBodies(); ++b) {
        if (!constraint.getMobilizedBodyFromConstrainedBody(b).isSameMobilizedBody(bodies[body1])) continue;
        wrench_W.head<3>() -= R_WA * toEigen(body_forces[b][1]);
        wrench_W.tail<3>() -= R_WA * toEigen(body_forces[b][0]);
      }
    }
    const SE3 X_1B = X_B1.inverse();
    if (closures[c].kind == ClosureKind::Distance) {  // its tension
      const auto locate = [&](int body, const SE3& X) {
        return toEigen(bodies[body].findStationLocationInGround(state, toSimTK(X.p)));
      };
      const Vector3d along = (locate(closures[c].body2, closures[c].X_B2) - locate(body1, X_B1)).normalized();
      out.wrenches.push_back(along.dot(wrench_W.head<3>()) * Vector6d::Unit(0));
      continue;
    }
    out.wrenches.push_back(X_1B.actForce(SE3{R_WB.transpose(), Vector3d::Zero()}.actForce(wrench_W)));
  }
}

}  // namespace bielle::validation
