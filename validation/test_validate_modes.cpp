// Linear modes against Simbody: its mass matrix, its constraint rows, and differences of its accelerations.
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <catch2/catch.hpp>

#include "bielle/dynamics/modes.h"
#include "bielle/motion/motion.h"
#include "bielle/robots/robot_loader.h"
#include "change_model.h"
#include "check_derivative.h"
#include "simbody_bridge.h"

using namespace bielle;
using namespace bielle::testing;
using namespace bielle::validation;

namespace {

// Columns with J N = 0 and N^T M N = 1.
MatrixXd makeOrthonormalBasis(const MatrixXd& J, const MatrixXd& M) {
  const Eigen::LLT<MatrixXd> factors(M);
  const MatrixXd scaled = factors.matrixL().solve(J.transpose()).transpose();
  const Eigen::JacobiSVD<MatrixXd> svd(scaled, Eigen::ComputeFullV);
  const VectorXd& sizes = svd.singularValues();
  const Eigen::Index rank = (sizes.array() > 1e-6 * sizes[0]).count();
  return factors.matrixU().solve(svd.matrixV().rightCols(M.rows() - rank));
}

// Largest relative distance of eigenvalues from those of y'' + C y' + K y = 0.
double calcModeError(const std::vector<Mode>& modes, const MatrixXd& K, const MatrixXd& C) {
  const Eigen::Index r = K.rows();
  MatrixXd A = MatrixXd::Zero(2 * r, 2 * r);
  A.topRightCorner(r, r).setIdentity();
  A.bottomLeftCorner(r, r) = -K;
  A.bottomRightCorner(r, r) = -C;
  const Eigen::VectorXcd values = Eigen::EigenSolver<MatrixXd>(A, false).eigenvalues();
  double error = 0;
  for (const Mode& mode : modes) {
    double nearest = std::numeric_limits<double>::infinity();
    for (const std::complex<double>& value : values) nearest = std::min(nearest, std::abs(value - mode.eigenvalue));
    error = std::max(error, nearest / std::abs(mode.eigenvalue));
  }
  return error;
}

}  // namespace

TEST_CASE("modes of a standing robot with springs, dampers and loops agree with differences of Simbody") {
  const Model model = changeModel(loadRobot(BIELLE_SOURCE_DIR "/robots/spring_biped").model, [](ModelParts& parts) {
    for (JointForce& force : parts.joint_forces) force.damping = 3;
  });
  const VectorXd q = makeStandingPosture(model), still = VectorXd::Zero(model.nv());
  const ConstraintSet set = makeConstraintSet(model, makeContactTargets(model, q, {0, 1}, 0, 0));
  const VectorXd tau = calcMotorForces(model, calcStaticTorques(model, set, q).u);
  const Modes modes = calcModes(model, set, q, tau);
  REQUIRE(modes.status == NumericalStatus::Ok);

  SimbodyBridge bridge(model, set.closures);
  const auto accelerate = [&](const VectorXd& at, const VectorXd& v) {
    bridge.setState(at, v, tau);
    return bridge.solveWithArmature().a;
  };
  CHECK(accelerate(q, still).cwiseAbs().maxCoeff() < 1e-6);
  const MatrixXd M = bridge.calcMassMatrix(), N = makeOrthonormalBasis(bridge.calcConstraintJacobian(), M);
  REQUIRE(N.cols() == modes.N.cols());
  const VectorXd none = VectorXd::Zero(N.cols());
  const MatrixXd K = -N.transpose() * M * differentiate(none, 1e-3, [&](const VectorXd& y) {
    return accelerate(model.integrate(q, N * y), still);
  });
  const MatrixXd C =
      -N.transpose() * M * differentiate(none, 1e-2, [&](const VectorXd& y) { return accelerate(q, N * y); });

  // In the basis of Simbody.
  const MatrixXd turn = modes.N.transpose() * M * N;
  CHECK((turn.transpose() * turn - MatrixXd::Identity(N.cols(), N.cols())).cwiseAbs().maxCoeff() < 1e-9);
  checkDerivative(turn.transpose() * modes.stiffness * turn, K, "stiffness");
  checkDerivative(turn.transpose() * modes.damping * turn, C, "damping");
  CHECK(calcModeError(modes.modes, K, C) < 1e-6);
  CHECK(calcModeError(modes.modes, 1.001 * K, C) > 1e-4);
}
