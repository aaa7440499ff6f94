// Sensors in a world: exact ones read what happens, real ones err as their data sheets say.
#include <catch2/catch.hpp>

#include "bielle/motion/motion.h"
#include "bielle/worlds/bielle_world.h"
#include "bielle/worlds/sensors.h"
#include "own_robots.h"

namespace bielle::worlds {
namespace {

using bielle::testing::getBipetto;

// Bipetto in the air, turning and falling.
std::unique_ptr<World> makeFall() {
  const Model& model = getBipetto();
  auto world = makeBielleWorld(model);
  VectorXd q = makeStandingPosture(model), v = VectorXd::Zero(model.nv());
  q[2] += 5;
  v.segment<6>(0) << 0.5, -0.3, 1, 0.4, 2, -1;
  world->reset(q, v);
  return world;
}

}  // namespace

TEST_CASE("sensors: exact ones read angles, mean angular velocity and no weight in free fall") {
  const Model& model = getBipetto();
  auto world = makeFall();
  SensorOptions options;
  options.noise = 0;
  Sensors sensors(model, options);
  sensors.reset(*world, 0);
  // The centre of mass falls freely; the trunk's own acceleration follows from velocities.
  const SE3 before(Eigen::Quaterniond(Eigen::Vector4d(world->configuration().segment<4>(3))).toRotationMatrix(),
                   world->configuration().head<3>());
  const Vector3d v_before = before.R * world->velocity().head<3>();
  world->advance(1e-3);
  const SensorReadings& readings = sensors.read(*world);
  const VectorXd &q = world->configuration(), &v = world->velocity();
  CHECK(readings.time == world->time());
  for (int m = 0; m < model.nu(); ++m)
    CHECK(readings.motor_positions[m] == q[model.joints()[model.motors()[m].joint].idx_q]);
  CHECK((readings.angular_velocity - v.segment<3>(3)).norm() < 0.02);
  const Matrix3d R = Eigen::Quaterniond(Eigen::Vector4d(q.segment<4>(3))).toRotationMatrix();
  const Vector3d change = R * v.head<3>() - v_before;
  CHECK((R * readings.specific_force - (change / 1e-3 - model.gravity())).norm() < 0.05);
}

TEST_CASE("sensors: offsets and noise are those of the parts, and repeat themselves") {
  const Model& model = getBipetto();
  const auto world = makeBielleWorld(model);
  const VectorXd q = makeStandingPosture(model), u = VectorXd::Zero(model.nu());
  world->reset(q, VectorXd::Zero(model.nv()));
  constexpr int kRobots = 40, kReadings = 500;
  constexpr double kPeriod = 1e-3;
  const SensorParts parts = makeRealParts();
  double offsets = 0, noise = 0, accelerometer_offsets = 0, accelerometer_noise = 0;
  for (unsigned seed = 1; seed <= kRobots; ++seed) {
    Sensors sensors(model, {parts, 1, seed, {}}), same(model, {parts, 1, seed, {}});
    sensors.reset(*world, 0);
    same.reset(*world, 0);
    Vector3d sum = Vector3d::Zero(), squares = sum, force_sum = sum, force_squares = sum;
    for (int i = 1; i <= kReadings; ++i) {
      const SensorReadings& reading = sensors.readAtRest(i * kPeriod, u);
      CHECK(same.readAtRest(i * kPeriod, u).angular_velocity == reading.angular_velocity);
      sum += reading.angular_velocity;
      squares += reading.angular_velocity.cwiseAbs2();
      const Vector3d force = reading.specific_force - Vector3d(0, 0, 9.81);
      force_sum += force;
      force_squares += force.cwiseAbs2();
    }
    const Vector3d mean = sum / kReadings, force_mean = force_sum / kReadings;
    offsets += mean.squaredNorm() / (3 * kRobots);
    noise += (squares / kReadings - mean.cwiseAbs2()).sum() / (3 * kRobots);
    accelerometer_offsets += force_mean.squaredNorm() / (3 * kRobots);
    accelerometer_noise += (force_squares / kReadings - force_mean.cwiseAbs2()).sum() / (3 * kRobots);
  }
  // 120 offsets are known to 6.5 %, 60000 readings to 0.3 %.
  CHECK(std::sqrt(offsets) == Approx(parts.gyro_offset).epsilon(0.2));
  CHECK(std::sqrt(noise) == Approx(parts.gyro_noise * std::sqrt(500.0)).epsilon(0.02));
  CHECK(std::sqrt(accelerometer_offsets) == Approx(parts.accelerometer_offset).epsilon(0.2));
  CHECK(std::sqrt(accelerometer_noise) ==
        Approx(parts.accelerometer_noise.norm() / std::sqrt(3.0) * std::sqrt(500.0)).epsilon(0.02));
}

TEST_CASE("sensors: encoders round to their resolution") {
  const Model& model = getBipetto();
  auto world = makeFall();
  world->advance(0.05);
  Sensors sensors(model, {});
  sensors.reset(*world, 0);
  const double resolution = makeRealParts().encoder_angle;
  CHECK(resolution == Approx(3.835e-4).epsilon(1e-3));
  const SensorReadings& readings = sensors.read(*world);
  int rounded = 0;
  for (int m = 0; m < model.nu(); ++m) {
    const double angle = world->configuration()[model.joints()[model.motors()[m].joint].idx_q];
    const double steps = readings.motor_positions[m] / resolution;
    CHECK(std::abs(steps - std::round(steps)) < 1e-9);
    CHECK(std::abs(readings.motor_positions[m] - angle) <= resolution / 2 + 1e-12);
    rounded += std::abs(readings.motor_positions[m] - angle) > resolution / 20;
  }
  CHECK(rounded > 0);
}

}  // namespace bielle::worlds
