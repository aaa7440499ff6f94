// Oracle: central differences on the group, and the group axioms.
#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <random>
#include <vector>

#include "bielle/math/se3.h"
#include "math/constants.h"
#include "math/direction.h"
#include "math/linear_program.h"
#include "math/settled.h"
#include "math/small_dense.h"
#include "math/so3.h"
#include "model/joint.h"

using namespace bielle;

namespace {

std::mt19937 rng(7);

VectorXd random(int n, double scale) {
  std::normal_distribution<double> normal(0, scale);
  return VectorXd::NullaryExpr(n, [&](Eigen::Index) { return normal(rng); });
}

// Largest error of a 6x6 right Jacobian of exp6 against central differences.
double calcJacobianError(const Vector6d& twist, const Matrix6d& J) {
  const double h = 1e-5;
  Matrix6d numeric;
  const SE3 X = exp6(twist);
  for (int k = 0; k < 6; ++k) {
    const Vector6d d = h * Vector6d::Unit(k);
    numeric.col(k) = (log6(X.inverseTimes(exp6(twist + d))) - log6(X.inverseTimes(exp6(twist - d)))) / (2 * h);
  }
  return (numeric - J).cwiseAbs().maxCoeff() / (1 + J.cwiseAbs().maxCoeff());
}

}  // namespace

TEST_CASE("exp6 and log6 are inverse on small, large and nearly flat rotations") {
  for (double angle : {0.0, 1e-9, 1e-5, 1e-3, 0.09, 0.11, 1.0, 3.0, 3.141592}) {
    Vector6d twist = random(6, 1);
    twist.tail<3>() *= angle / twist.tail<3>().norm();
    CAPTURE(angle);
    CHECK((log6(exp6(twist)) - twist).norm() < 1e-9);
    CHECK((exp6(twist).R * exp6(twist).R.transpose() - Matrix3d::Identity()).norm() < 1e-14);
  }
}

TEST_CASE("Jacobians of exp6 and log6 agree with central differences, and a poisoned entry is seen") {
  for (double angle : {0.0, 1e-6, 1e-4, 1e-2, 0.099, 0.101, 0.7, 2.0, 2.9}) {
    Vector6d twist = random(6, 1);
    twist.tail<3>() *= angle / twist.tail<3>().norm();
    CAPTURE(angle);
    Matrix6d J = calcRightJacobian6(twist);
    CHECK(calcJacobianError(twist, J) < 1e-9);
    CHECK((calcLogJacobian6(exp6(twist)) * J - Matrix6d::Identity()).norm() < 1e-9);
    J(1, 4) += 1e-5;
    CHECK(calcJacobianError(twist, J) > 1e-6);
  }
}

TEST_CASE("spatial cross products are the derivative of the adjoint actions") {
  const Vector6d v = random(6, 1), m = random(6, 1), f = random(6, 1);
  const double h = 1e-6;
  CHECK(((exp6(h * v).actMotion(m) - exp6(-h * v).actMotion(m)) / (2 * h) - crossMotion(v, m)).norm() < 1e-8);
  CHECK(((exp6(h * v).actForce(f) - exp6(-h * v).actForce(f)) / (2 * h) - crossForce(v, f)).norm() < 1e-8);
  CHECK((makeCrossMotionMatrix(v) * m - crossMotion(v, m)).norm() < 1e-14);
  const SE3 X = exp6(v);
  CHECK(X.actMotion(m).dot(X.actForce(f)) == Approx(m.dot(f)));
  CHECK((X.toActionMatrix() * m - X.actMotion(m)).norm() < 1e-14);
}

TEST_CASE("z turns to a direction by the smallest rotation, where that is nearly opposite as well") {
  const auto check = [](const Vector3d& direction) {
    CAPTURE(direction.transpose());
    const Matrix3d R = calcRotationOfZ(direction);
    CHECK((R * Vector3d::UnitZ() - direction.normalized()).norm() < 1e-14);
    CHECK((R.transpose() * R - Matrix3d::Identity()).norm() < 1e-14);
    CHECK(R.determinant() == Approx(1));
    CHECK(std::abs(R(0, 1) - R(1, 0)) < 1e-14);  // about an axis across z
  };
  for (int i = 0; i < 100; ++i) check(random(3, 2));
  for (double tilt = 1; tilt > 1e-20; tilt /= 10)
    for (const double z : {1, -1}) check({0.6 * tilt, -0.8 * tilt, z});
  check(Vector3d::UnitZ());
  check(-Vector3d::UnitZ());
  CHECK(calcRotationOfZ({0, 0, -3}) == Vector3d(1, -1, -1).asDiagonal().toDenseMatrix());
}

TEST_CASE("what is settled is near what was given, and stays to the bit through angles, quaternions and other frames") {
  const auto isSame = [](const Matrix3d& a, const Matrix3d& b) { return (a.array() == b.array()).all(); };
  const auto check = [&](const Matrix3d& given) {
    const Matrix3d R = settleRotation(given), T = exp3(random(3, 1));
    CHECK((R - given).cwiseAbs().maxCoeff() < kSettled);
    CHECK(isSame(settleRotation(makeRotation(calcRollPitchYaw(R))), R));
    CHECK(isSame(settleRotation(Eigen::Quaterniond(R).normalized().toRotationMatrix()), R));
    CHECK(isSame(settleRotation(R * T * T.transpose()), R));
    CHECK(!isSame(settleRotation(R * exp3(Vector3d(0, 0, 1e-13))), R));
  };
  for (int i = 0; i < 300; ++i) check(exp3(random(3, 2)));
  for (double off = 1e-2; off > 1e-16;
       off /= 10)  // near where roll and yaw turn about one axis, and where quaternions change sign
    for (const double angle : {kPi / 2, kPi, kPi / 4, 0.0})
      for (int axis = 0; axis < 3; ++axis) check(exp3(Vector3d::Unit(axis) * (angle + off)));
  const Matrix3d right = makeRotation({kPi / 2, -kPi / 2, kPi});
  CHECK(isSame(settleRotation(right), right.array().round()));
  CHECK(settleRotation(makeRotation({kPi / 2, 0, 0}) * makeRotation({0, 0, 0.3}))
            .row(1)
            .head<2>()
            .isZero(0));  // a plane stays
  for (int i = 0; i < 300; ++i) {
    const Vector3d v = i % 2 ? Vector3d(random(3, 1)) : Vector3d(1, 1 + 1e-15 * i, -1), d = settleDirection(v),
                   p = settlePoint(v, v.norm() + 3);
    CHECK((d - v.normalized()).norm() < 1e-14);
    CHECK(d.norm() == Approx(1).epsilon(1e-15));
    CHECK(settleDirection((3 * d).normalized()) == d);
    CHECK((p - v).cwiseAbs().maxCoeff() < 1e-13);
    CHECK(settlePoint((p + Vector3d(0.3, 3, -0.7)) - Vector3d(0.3, 3, -0.7), p.norm() + 3) == p);
  }
  CHECK(settlePoint({0.1 + 0.2, 0, -1e-17}, 0.3) == Vector3d(0.3, 0, 0));
}

TEST_CASE("every joint kind: integrate, difference, their Jacobians and the motion subspace are consistent") {
  using K = JointKind;
  for (K kind : {K::Revolute, K::Continuous, K::Prismatic, K::Spherical, K::Universal, K::Planar, K::FreeFlyer}) {
    CAPTURE(getName(kind));
    Joint joint;
    joint.kind = kind;
    joint.axis = random(3, 1).normalized();
    joint.axis2 = random(3, 1).normalized();
    joint.nq = getNq(kind);
    joint.nv = getNv(kind);
    VectorXd q0(joint.nq), q(joint.nq), q1(joint.nq), back(joint.nv);
    setNeutral(kind, q0);
    integrateJoint(joint, q0, random(joint.nv, 0.5), q);
    const VectorXd dv = random(joint.nv, 0.5);
    integrateJoint(joint, q, dv, q1);
    calcJointDifference(joint, q, q1, back);
    CHECK((back - dv).norm() < 1e-12);

    Matrix6Xd S(6, joint.nv);
    calcJointSubspace(joint, q, S);
    MatrixXd Jq(joint.nv, joint.nv), Jv(joint.nv, joint.nv), Jd(joint.nv, joint.nv);
    calcJointIntegrateJacobians(joint, dv, Jq, Jv);
    calcJointDifferenceJacobian(joint, dv, Jd);
    CHECK((Jd * Jv - MatrixXd::Identity(joint.nv, joint.nv)).norm() < 1e-10);
    const double h = 1e-6;
    for (int k = 0; k < joint.nv; ++k) {
      const VectorXd d = h * VectorXd::Unit(joint.nv, k);
      VectorXd qp(joint.nq), qm(joint.nq), dp(joint.nv), dm(joint.nv), rp(joint.nq), rm(joint.nq);
      integrateJoint(joint, q, d, qp);
      integrateJoint(joint, q, -d, qm);
      const SE3 X = calcJointPlacement(joint, q);
      const Vector6d twist =
          (log6(X.inverseTimes(calcJointPlacement(joint, qp))) - log6(X.inverseTimes(calcJointPlacement(joint, qm)))) /
          (2 * h);
      CHECK((twist - S.col(k)).norm() < 1e-8);
      integrateJoint(joint, qp, dv, rp);
      integrateJoint(joint, qm, dv, rm);
      calcJointDifference(joint, q1, rp, dp);
      calcJointDifference(joint, q1, rm, dm);
      CHECK(((dp - dm) / (2 * h) - Jq.col(k)).norm() < 1e-8);
      integrateJoint(joint, q, dv + d, rp);
      integrateJoint(joint, q, dv - d, rm);
      calcJointDifference(joint, q1, rp, dp);
      calcJointDifference(joint, q1, rm, dm);
      CHECK(((dp - dm) / (2 * h) - Jv.col(k)).norm() < 1e-8);
    }
  }
}

// To either side of where a turn has its singularities.
std::vector<double> listTurns() {
  std::vector<double> turns = {0, 1e-9, 1e-3, 0.0999, 0.1001, 1, 3, 3.5, 6, 8, 20, 1000};
  for (const double whole : {kPi, 2 * kPi, 3 * kPi, 4 * kPi})
    for (const double off : {0.0, 1e-13, 1e-9, 1e-6, 1e-3}) turns.insert(turns.end(), {whole - off, whole + off});
  return turns;
}

TEST_CASE(
    "every joint kind: differences are undone at every angle, beyond whole turns as well, and so are their Jacobians") {
  using K = JointKind;
  for (K kind : {K::Revolute, K::Continuous, K::Prismatic, K::Spherical, K::Universal, K::Planar, K::FreeFlyer})
    for (const double turn : listTurns())
      for (const double sign : {1, -1}) {
        CAPTURE(getName(kind), turn, sign);
        Joint joint;
        joint.kind = kind;
        joint.axis = random(3, 1).normalized();
        joint.axis2 = random(3, 1).normalized();
        joint.nq = getNq(kind);
        joint.nv = getNv(kind);
        const bool wraps = kind == K::Spherical || kind == K::FreeFlyer;
        VectorXd q0(joint.nq), q1(joint.nq), back(joint.nq), dv = random(joint.nv, 0.5), d(joint.nv);
        setNeutral(kind, back);
        integrateJoint(joint, back, random(joint.nv, 0.5), q0);
        if (wraps) dv.tail<3>() *= turn / dv.tail<3>().norm();
        if (!wraps) dv[joint.nv - 1] = sign * turn;
        integrateJoint(joint, q0, dv, q1);
        calcJointDifference(joint, q0, q1, d);
        integrateJoint(joint, q0, d, back);
        const SE3 X1 = calcJointPlacement(joint, q1), X = calcJointPlacement(joint, back);
        CHECK((X1.R - X.R).norm() < 1e-11);
        CHECK((X1.p - X.p).norm() < 1e-11);
        if (!wraps) CHECK((d - dv).norm() < 1e-11 * (1 + turn));
        if (wraps && turn < kPi - 1e-7) CHECK((d - dv).norm() < 1e-11);

        MatrixXd Jq(joint.nv, joint.nv), Jv(joint.nv, joint.nv), Jd(joint.nv, joint.nv);
        calcJointIntegrateJacobians(joint, d, Jq, Jv);
        calcJointDifferenceJacobian(joint, d, Jd);
        CHECK((Jd * Jv - MatrixXd::Identity(joint.nv, joint.nv)).norm() < 1e-9);
        if (wraps && turn > kPi - 1e-3) continue;  // differences of rotations jump at half a turn
        const double h = 1e-6;
        const auto derive = [&](const std::function<void(const VectorXd&, VectorXd&)>& f) {
          MatrixXd J(joint.nv, joint.nv);
          VectorXd plus(joint.nv), minus(joint.nv);
          for (int k = 0; k < joint.nv; ++k) {
            f(h * VectorXd::Unit(joint.nv, k), plus);
            f(-h * VectorXd::Unit(joint.nv, k), minus);
            J.col(k) = (plus - minus) / (2 * h);
          }
          return J;
        };
        VectorXd moved(joint.nq), end(joint.nq);
        const MatrixXd by_q = derive([&](const VectorXd& x, VectorXd& out) {
          integrateJoint(joint, q0, x, moved);
          integrateJoint(joint, moved, d, end);
          calcJointDifference(joint, q1, end, out);
        });
        const MatrixXd by_v = derive([&](const VectorXd& x, VectorXd& out) {
          integrateJoint(joint, q0, d + x, end);
          calcJointDifference(joint, q1, end, out);
        });
        const MatrixXd by_end = derive([&](const VectorXd& x, VectorXd& out) {
          integrateJoint(joint, q1, x, end);
          calcJointDifference(joint, q0, end, out);
        });
        // Rounding of angles and lengths over h, and the bend of the chord at half a turn times h.
        const double error = 1e-6 + 1e-9 * turn;
        CHECK((by_q - Jq).norm() < error * Jq.norm());
        CHECK((by_v - Jv).norm() < error * Jv.norm());
        CHECK((by_end - Jd).norm() < error * Jd.norm());
      }
}

TEST_CASE("a planar joint moves along the exponential up to half a turn, and smoothly beyond") {
  Joint joint;
  joint.kind = JointKind::Planar;
  joint.nq = joint.nv = 3;
  const Vector3d q0(0.3, -0.2, 0.7);
  VectorXd q1(3), q2(3);
  for (const double turn : {0.0, 1e-6, 0.0999, 0.1001, 1.0, -2.0, 3.1, kPi, -kPi}) {
    const Vector3d dv(0.5, 0.8, turn);
    integrateJoint(joint, q0, dv, q1);
    Vector6d twist;
    twist << 0.5, 0.8, 0, 0, 0, turn;
    const SE3 X = calcJointPlacement(joint, q0) * exp6(twist), Y = calcJointPlacement(joint, q1);
    CHECK((X.p - Y.p).norm() < 1e-14);
    CHECK((X.R - Y.R).norm() < 1e-14);
  }
  integrateJoint(joint, q0, Vector3d(0.5, 0.8, kPi - 1e-7), q1);
  integrateJoint(joint, q0, Vector3d(0.5, 0.8, kPi + 1e-7), q2);
  CHECK((q2 - q1).norm() < 1e-6);
}

TEST_CASE("rotations of half a turn and next to it: vector, quaternion and matrix are the same") {
  for (const double off : {0.0, 1e-15, 1e-13, 1e-11, 1e-9, 1e-8, 1e-7, 1e-6, 1e-4, 1e-3})
    for (int i = 0; i < 20; ++i) {
      const Vector3d axis = i < 3 ? Vector3d(Vector3d::Unit(i)) : Vector3d(random(3, 1).normalized());
      const double angle = kPi - off;
      CAPTURE(off, axis.transpose());
      const Matrix3d R = exp3(angle * axis);
      CHECK((exp3AsQuaternion(angle * axis).toRotationMatrix() - R).norm() < 1e-14);
      const Vector3d w = log3(R);
      CHECK(std::abs(w.norm() - angle) < 1e-14);
      CHECK((exp3(w) - R).norm() < 1e-14);
      CHECK(std::min((w - angle * axis).norm(), off < 1e-7 ? (w + angle * axis).norm() : 1) < 1e-14);
      CHECK((calcRightJacobianInverse3(w) * calcRightJacobian3(w) - Matrix3d::Identity()).norm() < 1e-13);
    }
}

TEST_CASE("roll, pitch and yaw make the rotation that they come from, at right angles and next to them") {
  for (const double off : {0.0, 1e-15, 1e-13, 1e-12, 1e-11, 1e-9, 1e-8, 1e-6, 1e-3, 0.5})
    for (const double pitch : {0.5 * kPi - off, off - 0.5 * kPi, kPi - off})
      for (const double roll : {0.0, 0.3, -2.5, kPi})
        for (const double yaw : {0.0, 1.2, -0.5 * kPi, 3.0}) {
          CAPTURE(off, roll, pitch, yaw);
          const Matrix3d R = makeRotation({roll, pitch, yaw});
          CHECK((makeRotation(calcRollPitchYaw(R)) - R).norm() < 3e-15);
          if (off == 0.5 && std::abs(pitch) < 0.5 * kPi && roll != kPi)
            CHECK((calcRollPitchYaw(R) - Vector3d(roll, pitch, yaw)).norm() < 1e-14);
        }
}

TEST_CASE("small systems are solved with rows swapped more than once") {
  for (int n : {1, 2, 3, 6, 9, 12}) {
    MatrixXd A = MatrixXd::NullaryExpr(n, n, [](Eigen::Index, Eigen::Index) { return random(1, 1)[0]; });
    A += 10 * MatrixXd(Eigen::MatrixXd::Identity(n, n).rowwise().reverse());  // the pivot of every column is far off
    const MatrixXd X = MatrixXd::NullaryExpr(n, 3, [](Eigen::Index, Eigen::Index) { return random(1, 1)[0]; });
    MatrixXd factors = A, solution = A * X;
    std::vector<int> pivots(n);
    REQUIRE(factorizeSmall(factors, pivots));
    solveFactorized(factors, pivots, solution);
    CHECK((solution - X).cwiseAbs().maxCoeff() < 1e-12);

    const MatrixXd S = A * A.transpose();
    const MatrixXd L = S.llt().matrixL();
    solution = S * X;
    solveSmallCholesky(L, solution);
    CHECK((solution - X).cwiseAbs().maxCoeff() < 1e-10);

    const MatrixXd B = MatrixXd::NullaryExpr(n, 7, [](Eigen::Index, Eigen::Index) { return random(1, 1)[0]; });
    MatrixXd out = MatrixXd::Ones(7, 3);
    addSmallProductTransposed(B, X, out, 2);
    CHECK((out - MatrixXd::Ones(7, 3) - 2 * B.transpose() * X).cwiseAbs().maxCoeff() < 1e-12);
  }
}

TEST_CASE("linear programs end where the gains of their equations prove it, degenerate ones as well") {
  std::uniform_real_distribution<double> number(-1, 1);
  for (int trial = 0; trial < 200; ++trial) {
    const int m = 3 + trial % 12, n = 2 * m + trial % 5, support = trial % 3 == 0 ? m - 2 : m;
    MatrixXd A(m + 1, n);
    VectorXd x = VectorXd::Zero(n), y(m + 1), gains = VectorXd::Zero(n);
    for (double& entry : A.reshaped()) entry = number(rng);
    A.row(m) = A.row(0) - 2 * A.row(1);  // a row that depends on others
    for (double& entry : y) entry = number(rng);
    for (int i = 0; i < n; ++i) (i < support ? x : gains)[i] = 0.1 + std::abs(number(rng));
    const VectorXd c = A.transpose() * y + gains, b = A * x;
    const std::optional<VectorXd> found = solveLinearProgram(A, b, c);
    REQUIRE(found);
    CHECK(found->minCoeff() > -1e-9);
    CHECK((A * *found - b).cwiseAbs().maxCoeff() < 1e-8);
    CHECK(c.dot(*found) == Approx(c.dot(x)).margin(1e-8));
  }
  const MatrixXd sum = MatrixXd::Ones(1, 3);
  CHECK_FALSE(solveLinearProgram(sum, VectorXd::Constant(1, -1e-6), VectorXd::Ones(3)));
  CHECK(solveLinearProgram(sum, VectorXd::Constant(1, 1e-6), VectorXd::Ones(3)));
  MatrixXd free(1, 2);
  free << 1, -1;
  CHECK_FALSE(solveLinearProgram(free, VectorXd::Ones(1), VectorXd::Constant(2, -1.0)));  // no least value
}
