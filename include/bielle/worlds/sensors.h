#pragma once
/// \file The sensors of a robot in a world: encoders of the motors and an inertial measurement unit in the trunk.
#include <random>

#include "bielle/control/estimator.h"
#include "bielle/worlds/world.h"

namespace bielle::worlds {

/// Figures of a data sheet. An offset is one standard deviation of what an axis reads at rest.
struct SensorParts {
  double gyro_noise = 0, gyro_offset = 0;           ///< rad/s/sqrt(Hz), rad/s
  Vector3d accelerometer_noise = Vector3d::Zero();  ///< per axis, m/s^2/sqrt(Hz)
  double accelerometer_offset = 0;                  ///< m/s^2
  double encoder_angle = 0, encoder_length = 0;     ///< resolutions, rad, m
};

/// Bosch BMI088: 0.014 deg/s/sqrt(Hz) and 1 deg/s; 160 (x, y) and 190 (z) ug/sqrt(Hz) and 20 mg. Encoders: 14 bits per turn
/// of the motor's joint (ams AS5047P); 5 um for linear motors (RLS LM13).
SensorParts makeRealParts();

struct SensorOptions {
  SensorParts parts = makeRealParts();
  double noise = 1;  ///< factor of all figures; 0: exact sensors
  unsigned seed = 1;
  SE3 imu;  ///< placement of the IMU in the trunk
};

/// What sensors feel: a state of a robot, and the torques of its motors.
struct SensedState {
  double time;             ///< s
  ConstVectorRef q, v;     ///< nq, of the motors (World::motorConfiguration()); nv
  ConstVectorRef torques;  ///< nu, N m or N
};

/// Encoders round. A reading of the IMU is the mean since the reading before it, with an offset drawn once and white noise
/// of the bandwidth 1 / (2 period).
class Sensors {
 public:
  Sensors(const Model& model, const SensorOptions& options);

  /// From a state, that in which a world is; the first readings come after a time, s.
  void reset(const SensedState& state, double time);
  void reset(const World& world, double time) { reset(sense(world), time); }
  /// While the robot stands still in the state of the world, under given torques of the motors (nu), at a time before that of
  /// the world, s.
  const SensorReadings& readAtRest(double time, ConstVectorRef torques);
  /// At the time of the state, that of the world. No allocation.
  const SensorReadings& read(const SensedState& state);
  const SensorReadings& read(const World& world) { return read(sense(world)); }

 private:
  static SensedState sense(const World& world) {
    return {world.time(), world.motorConfiguration(), world.velocity(), world.torques()};
  }
  Vector3d drawNoise(const Vector3d& deviations);
  void readEncoders(const SensedState& state);

  Model model_;
  const SensorOptions options_;
  std::mt19937 generator_;
  Vector3d gyro_offset_ = Vector3d::Zero(), accelerometer_offset_ = Vector3d::Zero();
  SE3 X_WI_;                       // of the reading before
  Vector3d v_ = Vector3d::Zero();  // of the IMU then, in the world
  SensorReadings readings_;
};

}  // namespace bielle::worlds
