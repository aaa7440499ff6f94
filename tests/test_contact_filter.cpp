// The filter of the trunk: its matrices against central differences, and what it must and must not learn.
#include <Eigen/Eigenvalues>
#include <catch2/catch.hpp>

#include "check_derivative.h"
#include "control/contact_filter.h"
#include "math/so3.h"

namespace bielle {
namespace {

using testing::randomPlacement;
using testing::randomVector;

const Vector3d kGravity(0, 0, -9.81);

ContactFilterState makeState(std::mt19937& rng) {
  ContactFilterState state;
  const SE3 X = randomPlacement(rng);
  state.R = X.R;
  state.p = X.p;
  state.v = randomVector(rng, 3);
  state.gyro_offset = randomVector(rng, 3, 0.1);
  state.accelerometer_offset = randomVector(rng, 3);
  state.feet = {randomPlacement(rng), randomPlacement(rng)};
  return state;
}

ContactFilterState integrate(const ContactFilterState& state, const VectorXd& error) {
  ContactFilterState out = state;
  bielle::integrate(state, error, out);
  return out;
}

VectorXd difference(const ContactFilterState& from, const ContactFilterState& to) {
  VectorXd error(getErrorSize(from));
  bielle::difference(from, to, error);
  return error;
}

ContactFilterNoise makeNoise() { return {3e-4, 3e-3, 1e-4, 1e-3, 5e-4, 2e-3, 3e-4, 1e-3}; }

SE3 getSeen(const ContactFilterState& state, size_t foot) {
  return SE3(state.R, state.p).inverseTimes(state.feet[foot]);
}

}  // namespace

TEST_CASE("contact filter: differences invert errors") {
  std::mt19937 rng(1);
  const ContactFilterState state = makeState(rng);
  const VectorXd error = randomVector(rng, getErrorSize(state));
  CHECK((difference(state, integrate(state, error)) - error).norm() < 1e-12);
}

TEST_CASE("contact filter: the matrix of a step is its derivative") {
  std::mt19937 rng(2);
  for (double h : {1e-3, 0.05}) {
    const ContactFilterState state = makeState(rng);
    const Vector3d gyro = randomVector(rng, 3, 5), accelerometer = randomVector(rng, 3, 20);
    const int size = getErrorSize(state);
    MatrixXd F(size, size), ignored(size, size);
    ContactFilterState next = state;
    predict(gyro, accelerometer, kGravity, h, next, F);
    const auto step = [&](const VectorXd& error) {
      ContactFilterState moved = integrate(state, error);
      predict(gyro, accelerometer, kGravity, h, moved, ignored);
      return difference(next, moved);
    };
    testing::checkDerivative(F, testing::differentiate(VectorXd::Zero(size), 1e-3, step), "step");
  }
}

TEST_CASE("contact filter: what a foot shows is, to first order, its error less that of the trunk") {
  std::mt19937 rng(3);
  const ContactFilterState state = makeState(rng);
  const int size = getErrorSize(state);
  for (size_t foot : {0, 1}) {
    const SE3 seen = getSeen(state, foot);
    CHECK(calcInnovation(state, foot, seen).norm() < 1e-12);
    MatrixXd H = MatrixXd::Zero(6, size);
    H.block<3, 3>(0, getFootPosition(foot)).setIdentity();
    H.block<3, 3>(0, kPosition) = -Matrix3d::Identity();
    H.block<3, 3>(3, getFootTurn(foot)).setIdentity();
    H.block<3, 3>(3, kTurn) = -Matrix3d::Identity();
    // The state is that which is believed: it errs by the opposite of what is added to it.
    const auto innovate = [&](const VectorXd& error) {
      return VectorXd(calcInnovation(integrate(state, error), foot, seen));
    };
    testing::checkDerivative(-H, testing::differentiate(VectorXd::Zero(size), 1e-3, innovate), "innovation");
  }
}

TEST_CASE("contact filter: at rest it learns the offset of the gyro and the tilt, not heading or position") {
  ContactFilter filter({6, 6}, makeNoise(), kGravity);
  ContactFilterState start;
  start.p = Vector3d(0.3, -0.2, 0.5);
  start.feet.resize(2);
  Eigen::Matrix<double, 15, 1> deviations = Eigen::Matrix<double, 15, 1>::Zero();
  deviations.segment<2>(kTurn).setConstant(0.02);
  deviations.segment<3>(kGyro).setConstant(0.02);
  filter.reset(start, deviations);
  const SE3 feet[] = {{Matrix3d::Identity(), {0, 0.1, -0.5}}, {Matrix3d::Identity(), {0, -0.1, -0.5}}};
  for (size_t foot : {0, 1}) filter.putDown(foot, feet[foot]);
  // The trunk leans by 0.01 rad about x, which only gravity tells.
  const Matrix3d R = exp3(Vector3d(0.01, 0, 0));
  const Vector3d offset(0.01, -0.02, 0.015);
  const double before = filter.covariance()(kPosition, kPosition);
  for (int i = 0; i < 5000; ++i) {
    filter.predict(offset, -R.transpose() * kGravity, 1e-3, {1, 1});
    for (size_t foot : {0, 1}) filter.correct(foot, feet[foot]);
  }
  const ContactFilterState& state = filter.state();
  CHECK((state.gyro_offset - offset).norm() < 2e-4);
  CHECK((state.R.row(2) - R.row(2)).norm() < 2e-4);
  CHECK(state.v.norm() < 1e-3);
  CHECK((state.p - start.p).norm() < 0.01);
  CHECK(log3(state.R).z() == Approx(0).margin(2e-3));
  CHECK(filter.covariance()(kPosition, kPosition) >= before);
  CHECK(filter.covariance()(kTurn + 2, kTurn + 2) >= 0);
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(filter.covariance());
  CHECK(eigen.eigenvalues().minCoeff() > -1e-12);
}

TEST_CASE("contact filter: of a point it learns the position alone") {
  const SE3 turned(exp3(Vector3d(0.3, 0, 0)), {0, 0.1, -0.5});
  for (int size : {3, 6}) {
    ContactFilter filter({size}, makeNoise(), kGravity);
    ContactFilterState start;
    start.feet.resize(1);
    filter.reset(start, Eigen::Matrix<double, 15, 1>::Constant(0.01));
    filter.putDown(0, {Matrix3d::Identity(), {0, 0.1, -0.5}});
    const double deviation = filter.correct(0, turned);
    CHECK((deviation < 1e-9) == (size == 3));
  }
}

}  // namespace bielle
