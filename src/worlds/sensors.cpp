#include "bielle/worlds/sensors.h"

#include <cmath>

#include "math/constants.h"
#include "math/so3.h"

namespace bielle::worlds {
namespace {

constexpr double kGravity = 9.80665;

SE3 getTrunk(ConstVectorRef q) { return {Eigen::Quaterniond(q[6], q[3], q[4], q[5]).toRotationMatrix(), q.head<3>()}; }

}  // namespace

SensorParts makeRealParts() {
  SensorParts parts;
  parts.gyro_noise = 0.014 * kDegree;
  parts.gyro_offset = 1 * kDegree;
  parts.accelerometer_noise = 1e-6 * kGravity * Vector3d(160, 160, 190);
  parts.accelerometer_offset = 20e-3 * kGravity;
  parts.encoder_angle = 2 * kPi / (1 << 14);
  parts.encoder_length = 5e-6;
  return parts;
}

Sensors::Sensors(const Model& model, const SensorOptions& options)
    : model_(model), options_(options), generator_(options.seed) {
  readings_.motor_positions.setZero(model.nu());
  readings_.motor_torques.setZero(model.nu());
  gyro_offset_ = drawNoise(Vector3d::Constant(options.parts.gyro_offset));
  accelerometer_offset_ = drawNoise(Vector3d::Constant(options.parts.accelerometer_offset));
}

Vector3d Sensors::drawNoise(const Vector3d& deviations) {
  std::normal_distribution<double> normal;
  Vector3d out;
  for (int i = 0; i < 3; ++i) out[i] = options_.noise * deviations[i] * normal(generator_);
  return out;
}

void Sensors::readEncoders(const SensedState& state) {
  for (int m = 0; m < model_.nu(); ++m) {
    const Joint& joint = model_.joints()[model_.motors()[m].joint];
    const double position = state.q[joint.idx_q];
    const double resolution = options_.noise * (joint.kind == JointKind::Prismatic ? options_.parts.encoder_length
                                                                                   : options_.parts.encoder_angle);
    readings_.motor_positions[m] = resolution > 0 ? resolution * std::round(position / resolution) : position;
  }
  readings_.motor_torques = state.torques;
}

void Sensors::reset(const SensedState& state, double time) {
  readings_.time = time;
  readEncoders(state);
  if (!model_.hasFreeFlyer()) return;
  X_WI_ = getTrunk(state.q) * options_.imu;
  const Vector6d twist = options_.imu.actInvMotion(state.v.head<6>());
  v_ = X_WI_.R * twist.head<3>();
  readings_.angular_velocity = twist.tail<3>() + gyro_offset_;
  readings_.specific_force = -(X_WI_.R.transpose() * model_.gravity()) + accelerometer_offset_;
}

const SensorReadings& Sensors::readAtRest(double time, ConstVectorRef torques) {
  const double bandwidth = std::sqrt(0.5 / (time - readings_.time));
  readings_.time = time;
  readings_.motor_torques = torques;
  readings_.angular_velocity = gyro_offset_ + drawNoise(Vector3d::Constant(bandwidth * options_.parts.gyro_noise));
  readings_.specific_force = accelerometer_offset_ - X_WI_.R.transpose() * model_.gravity() +
                             drawNoise(bandwidth * options_.parts.accelerometer_noise);
  return readings_;
}

const SensorReadings& Sensors::read(const SensedState& state) {
  const double period = state.time - readings_.time;
  if (!(period > 0)) return readings_;
  readings_.time = state.time;
  readEncoders(state);
  if (!model_.hasFreeFlyer()) return readings_;
  const SE3 X_WI = getTrunk(state.q) * options_.imu;
  const Vector3d v = X_WI.R * options_.imu.actInvMotion(state.v.head<6>()).head<3>();
  const Vector3d turn = log3(Matrix3d(X_WI_.R.transpose() * X_WI.R));
  const Matrix3d middle = X_WI_.R * exp3(Vector3d(0.5 * turn));
  const double bandwidth = std::sqrt(0.5 / period);
  readings_.angular_velocity =
      turn / period + gyro_offset_ + drawNoise(Vector3d::Constant(bandwidth * options_.parts.gyro_noise));
  readings_.specific_force = middle.transpose() * ((v - v_) / period - model_.gravity()) + accelerometer_offset_ +
                             drawNoise(bandwidth * options_.parts.accelerometer_noise);
  X_WI_ = X_WI;
  v_ = v;
  return readings_;
}

}  // namespace bielle::worlds
