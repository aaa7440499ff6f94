#include "control/contact_filter.h"

#include <cmath>

#include "math/decompositions.h"
#include "math/so3.h"

namespace bielle {

void integrate(const ContactFilterState& state, ConstVectorRef error, ContactFilterState& out) {
  const Matrix3d turn = exp3(error.segment<3>(kTurn));
  out.R = turn * state.R;
  out.v = turn * state.v + error.segment<3>(kVelocity);
  out.p = turn * state.p + error.segment<3>(kPosition);
  out.gyro_offset = state.gyro_offset + error.segment<3>(kGyro);
  out.accelerometer_offset = state.accelerometer_offset + error.segment<3>(kAccelerometer);
  for (size_t i = 0; i < state.feet.size(); ++i) {
    out.feet[i].p = turn * state.feet[i].p + error.segment<3>(getFootPosition(i));
    out.feet[i].R = exp3(error.segment<3>(getFootTurn(i))) * state.feet[i].R;
  }
}

void difference(const ContactFilterState& from, const ContactFilterState& to, VectorRef error) {
  const Matrix3d turn = to.R * from.R.transpose();
  error.segment<3>(kTurn) = log3(turn);
  error.segment<3>(kVelocity) = to.v - turn * from.v;
  error.segment<3>(kPosition) = to.p - turn * from.p;
  error.segment<3>(kGyro) = to.gyro_offset - from.gyro_offset;
  error.segment<3>(kAccelerometer) = to.accelerometer_offset - from.accelerometer_offset;
  for (size_t i = 0; i < from.feet.size(); ++i) {
    error.segment<3>(getFootPosition(i)) = to.feet[i].p - turn * from.feet[i].p;
    error.segment<3>(getFootTurn(i)) = log3(Matrix3d(to.feet[i].R * from.feet[i].R.transpose()));
  }
}

void predict(const Vector3d& gyro, const Vector3d& accelerometer, const Vector3d& gravity, double h,
             ContactFilterState& state, MatrixRef F) {
  const Vector3d turn = h * (gyro - state.gyro_offset), f = accelerometer - state.accelerometer_offset;
  const Matrix3d D = h * state.R * exp3(0.5 * turn);
  const Matrix3d Df = D * skew(f) * calcRightJacobian3(0.5 * turn) * (0.5 * h);
  const Vector3d v = state.v;
  state.R = state.R * exp3(turn);
  state.v += D * f + h * gravity;
  state.p += 0.5 * h * (v + state.v);
  const Matrix3d B = h * state.R * calcRightJacobian3(turn);
  F.setIdentity();
  F.block<3, 3>(kTurn, kGyro) = -B;
  F.block<3, 3>(kVelocity, kTurn) = h * skew(gravity);
  F.block<3, 3>(kVelocity, kGyro) = Df - skew(state.v) * B;
  F.block<3, 3>(kVelocity, kAccelerometer) = -D;
  F.block<3, 3>(kPosition, kTurn) = 0.5 * h * h * skew(gravity);
  F.block<3, 3>(kPosition, kVelocity).diagonal().setConstant(h);
  F.block<3, 3>(kPosition, kGyro) = 0.5 * h * Df - skew(state.p) * B;
  F.block<3, 3>(kPosition, kAccelerometer) = -0.5 * h * D;
  for (size_t i = 0; i < state.feet.size(); ++i) F.block<3, 3>(getFootPosition(i), kGyro) = -skew(state.feet[i].p) * B;
}

Vector6d calcInnovation(const ContactFilterState& state, size_t foot, const SE3& X_IF) {
  Vector6d out;
  out.head<3>() = state.R * X_IF.p - (state.feet[foot].p - state.p);
  out.tail<3>() = log3(Matrix3d(state.R * X_IF.R * state.feet[foot].R.transpose()));
  return out;
}

ContactFilter::ContactFilter(const std::vector<int>& sizes, const ContactFilterNoise& noise, const Vector3d& gravity)
    : sizes_(sizes), noise_(noise), gravity_(gravity) {
  state_.feet.resize(sizes.size());
  corrected_ = state_;
  const int size = getErrorSize(state_);
  for (MatrixXd* x : {&P_, &F_, &FP_}) x->setZero(size, size);
  for (MatrixXd* x : {&PH_, &K_}) x->setZero(size, 6);
  error_.setZero(size);
}

void ContactFilter::reset(const ContactFilterState& state, const Eigen::Matrix<double, 15, 1>& deviations) {
  state_ = state;
  P_.setZero();
  P_.diagonal().head<kFeet>() = deviations.cwiseAbs2();
}

void ContactFilter::predict(const Vector3d& gyro, const Vector3d& accelerometer, double h,
                            const std::vector<double>& unrest) {
  bielle::predict(gyro, accelerometer, gravity_, h, state_, F_);
  FP_.noalias() = F_ * P_;
  P_.noalias() = FP_ * F_.transpose();
  // Errors of the readings act like those of the offsets; a density n makes n / sqrt(2 h) of the mean over h.
  K_.leftCols<3>() = noise_.gyro / std::sqrt(2 * h) * F_.middleCols<3>(kGyro);
  K_.rightCols<3>() = noise_.accelerometer / std::sqrt(2 * h) * F_.middleCols<3>(kAccelerometer);
  K_.middleRows<6>(kGyro).setZero();
  P_.noalias() += K_ * K_.transpose();
  const auto addVariance = [this, h](int row, double deviation) {
    P_.diagonal().segment<3>(row).array() += h * deviation * deviation;
  };
  addVariance(kGyro, noise_.gyro_walk);
  addVariance(kAccelerometer, noise_.accelerometer_walk);
  for (size_t i = 0; i < sizes_.size(); ++i) {
    addVariance(getFootPosition(i), unrest[i] * noise_.foot_slide);
    addVariance(getFootTurn(i), unrest[i] * noise_.foot_turn);
  }
}

void ContactFilter::putDown(size_t foot, const SE3& X_IF) {
  state_.feet[foot] = SE3(state_.R, state_.p) * X_IF;
  const auto copy = [this](int to, int from, double deviation) {
    P_.middleRows<3>(to) = P_.middleRows<3>(from);
    P_.middleCols<3>(to) = P_.middleCols<3>(from);
    P_.diagonal().segment<3>(to).array() += deviation * deviation;
  };
  copy(getFootPosition(foot), kPosition, noise_.foot_position);
  copy(getFootTurn(foot), kTurn, noise_.foot_attitude);
}

double ContactFilter::correct(size_t foot, const SE3& X_IF) {
  using Columns = Eigen::Matrix<double, 6, 6>;
  const int n = sizes_[foot], at = getFootPosition(foot), turn = getFootTurn(foot);
  PH_.leftCols<3>() = P_.middleCols<3>(at) - P_.middleCols<3>(kPosition);
  PH_.rightCols<3>() = P_.middleCols<3>(turn) - P_.middleCols<3>(kTurn);
  Columns S;
  S.topRows<3>() = PH_.middleRows<3>(at) - PH_.middleRows<3>(kPosition);
  S.bottomRows<3>() = PH_.middleRows<3>(turn) - PH_.middleRows<3>(kTurn);
  S.diagonal().head<3>().array() += noise_.foot_position * noise_.foot_position;
  S.diagonal().tail<3>().array() += noise_.foot_attitude * noise_.foot_attitude;
  Vector6d y = calcInnovation(state_, foot, X_IF);
  if (n == 3) {  // nothing is known of the attitude of a point
    S.bottomRows<3>().setZero();
    S.rightCols<3>().setZero();
    S.diagonal().tail<3>().setOnes();
    PH_.rightCols<3>().setZero();
    y.tail<3>().setZero();
  }
  const Eigen::LLT<Columns> factors(S);
  const Columns inverse = factors.solve(Columns::Identity());
  K_.noalias() = PH_ * inverse;
  error_.noalias() = K_ * y;
  P_.noalias() -= K_ * PH_.transpose();
  for (Eigen::Index c = 0; c < P_.cols(); ++c)
    for (Eigen::Index r = 0; r < c; ++r) P_(c, r) = P_(r, c) = 0.5 * (P_(r, c) + P_(c, r));
  integrate(state_, error_, corrected_);
  std::swap(state_, corrected_);
  return y.dot(inverse * y);
}

}  // namespace bielle
