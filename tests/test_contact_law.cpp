// The contact law: normal force, friction that sticks, energy, derivatives.
#include <catch2/catch.hpp>
#include <random>
#include <tuple>

#include "bielle/robots/robot_loader.h"
#include "worlds/contact_law.h"

namespace bielle::worlds {
namespace {

ContactPoint makePoint() {
  ContactPoint point;
  point.stiffness = 8e4;
  point.damping = 10;
  point.shear_stiffness = 6e4;
  point.shear_damping = 300;
  point.touches = true;
  return point;
}

}  // namespace

TEST_CASE("contact law: the ground never pulls, and does nothing above it") {
  const Terrain terrain;
  ContactPoint point = makePoint();
  CHECK(calcContactForce(terrain, point, {0, 0, 1e-6}, {1, 0, -1}).force.isZero(0));
  const ContactForce still = calcContactForce(terrain, point, {0, 0, -1e-3}, Vector3d::Zero());
  CHECK(still.force.z() == Approx(80));
  CHECK(still.elastic == Approx(0.5 * 8e4 * 1e-6));
  CHECK(calcContactForce(terrain, point, {0, 0, -1e-3}, {0, 0, 0.05}).force.z() == Approx(40));
  CHECK(calcContactForce(terrain, point, {0, 0, -1e-3}, {0, 0, 1}).force.isZero(0));
}

TEST_CASE("contact law: friction holds below the cone without creeping, and drags the anchor beyond") {
  const Terrain terrain;  // friction 0.7
  ContactPoint point = makePoint();
  const double depth = 1e-3, normal = 80;
  const Vector3d held(5e-4, 0, -depth);  // 30 N of 56
  for (int i = 0; i < 1000; ++i) {
    const ContactForce force = calcContactForce(terrain, point, held, Vector3d::Zero());
    updateAnchor(terrain, held, force, point);
    REQUIRE(force.force.x() == Approx(-30).epsilon(1e-12));
  }
  const Vector3d dragged(3e-3, 4e-3, -depth);
  const ContactForce force = calcContactForce(terrain, point, dragged, Vector3d::Zero());
  CHECK(force.force.head<2>().norm() == Approx(0.7 * normal));
  updateAnchor(terrain, dragged, force, point);
  CHECK((calcContactForce(terrain, point, dragged, Vector3d::Zero()).force - force.force).norm() < 1e-10);
  CHECK(point.anchor.head<2>().norm() > 3e-3);
}

TEST_CASE("contact law: every closed path takes energy, none gives any") {
  const Terrain terrain;
  std::mt19937 generator(5);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (int trial = 0; trial < 20; ++trial) {
    ContactPoint point = makePoint();
    point.anchor = {1e-4 * unit(generator), 0, 0};
    const double a = unit(generator), b = unit(generator), c = unit(generator);
    const auto at = [&](double t) {
      return Vector3d(1e-3 * a * std::sin(t), 1e-3 * b * std::sin(2 * t), -1e-3 * (1 + c * std::sin(t + 1)));
    };
    constexpr int kSteps = 20000;
    constexpr double h = 2 * 3.141592653589793 / kSteps;
    double taken = 0;
    const double start = calcContactForce(terrain, point, at(0), Vector3d::Zero()).elastic;
    for (int i = 0; i < kSteps; ++i) {
      const Vector3d x = at((i + 0.5) * h), moved = at((i + 1) * h) - at(i * h);
      const ContactForce force = calcContactForce(terrain, point, x, moved / h * 20);  // fast enough for the dampers
      updateAnchor(terrain, x, force, point);
      taken -= force.force.dot(moved);
      const double stored = calcContactForce(terrain, point, at((i + 1) * h), Vector3d::Zero()).elastic - start;
      REQUIRE(taken - stored > -1e-6);
    }
    CHECK(taken > 1e-4);
  }
}

TEST_CASE("contact law: its damping is the derivative by the velocity") {
  const Terrain terrain;
  const ContactPoint point = makePoint();
  // Inside the cone; sliding; with the spring at the cone, its damper inside; both at the cone.
  for (const auto& [stretch, speed] : {std::pair(2e-4, 0.01), {2e-4, 3.0}, {2e-3, -0.05}, {2e-3, 3.0}}) {
    const Vector3d x(stretch, -0.5 * stretch, -1e-3);
    const Vector3d velocity(speed, 0.5 * speed, 0.001);
    const ContactForce force = calcContactForce(terrain, point, x, velocity, true);
    Matrix3d numeric;
    const double h = 1e-6;
    for (int i = 0; i < 3; ++i) {
      const Vector3d step = h * Vector3d::Unit(i);
      numeric.col(i) = -(calcContactForce(terrain, point, x, velocity + step).force -
                         calcContactForce(terrain, point, x, velocity - step).force) /
                       (2 * h);
    }
    CHECK(force.slides == (stretch > 1e-3 || speed > 1));
    CHECK((force.damping - numeric).norm() < 1e-5 * numeric.norm());
    Matrix3d poisoned = force.damping;
    poisoned(2, 2) *= 1.001;
    CHECK((poisoned - numeric).norm() > 1e-5 * numeric.norm());
  }
}

TEST_CASE("contact law: so is that of a step, whose springs take the work that they hold after it") {
  const Terrain terrain;
  ContactPoint point = makePoint();
  point.damping = point.shear_damping = 0;
  constexpr double kStep = 2e-3;
  // In the ground all along; touching down; lifting off; in the air at its middle.
  for (const auto& [depth, before, after] :
       {std::tuple(1e-3, -0.1, 0.2), {2e-4, -0.5, -0.3}, {2e-4, 0.2, 0.6}, {-1e-4, -0.02, -0.5}}) {
    CAPTURE(depth, before, after);
    const Vector3d x(2e-5, -1e-5, -depth), first(0.01, 0.004, before), second(0.02, -0.01, after);
    const ContactStep step{kStep, first};
    const auto calc = [&](const Vector3d& velocity, bool with_damping = false) {
      return calcContactForce(terrain, point, x, velocity, with_damping, step);
    };
    const Vector3d mean = 0.5 * (first + second);
    const ContactForce force = calc(mean, true);
    Matrix3d numeric;
    const double h = 1e-6;
    for (int i = 0; i < 3; ++i) {
      const Vector3d aside = h * Vector3d::Unit(i);
      numeric.col(i) = -(calc(mean + aside).force - calc(mean - aside).force) / (2 * h);
    }
    CHECK((force.damping - numeric).norm() < 1e-5 * numeric.norm());
    Matrix3d poisoned = force.damping;
    poisoned(2, 2) *= 1.001;
    CHECK((poisoned - numeric).norm() > 1e-5 * numeric.norm());
    // Of the normal force, which is a spring alone here.
    const auto calcHeld = [&](const Vector3d& end) {
      return 0.5 * point.stiffness * std::pow(std::max(0.0, -end.z()), 2);
    };
    const double held = calcHeld(x + 0.5 * kStep * second) - calcHeld(x - 0.5 * kStep * first);
    CHECK(-force.force.z() * mean.z() * kStep == Approx(held).epsilon(1e-9));
    CHECK(std::abs(held) > 1e-6);
  }
  const JointStop stop{0, 0, -1, 2, 1e4, 0};
  for (const auto& [q, before, after] : {std::tuple(2.01, 3.0, -1.0), {1.9999, 3.0, 2.5}, {-1.0005, 2.0, 3.0}}) {
    const auto calcHeld = [&](double end) { return calcStopForce(stop, end, 0).elastic; };
    const double mean = 0.5 * (before + after), h = 1e-6;
    const StopForce force = calcStopForce(stop, q, mean, {kStep, before});
    const double held = calcHeld(q + 0.5 * kStep * after) - calcHeld(q - 0.5 * kStep * before);
    CHECK(-force.force * mean * kStep == Approx(held).epsilon(1e-9));
    const auto calc = [&, q = q, before = before](double v) {
      return calcStopForce(stop, q, v, {kStep, before}).force;
    };
    CHECK(force.damping == Approx(-(calc(mean + h) - calc(mean - h)) / (2 * h)).epsilon(1e-5));
  }
}

TEST_CASE(
    "contact law: a sole bears with its corners, whatever ground is elsewhere, and between them on what comes up "
    "there") {
  const LoadedRobot robot = loadRobot(BIELLE_SOURCE_DIR "/robots/bipetto");
  const ContactFrame& sole = robot.model.contacts()[0];
  const auto press = [&](const Ground& ground, double depth) {  // below z = 0; N
    const Terrain terrain(ground);
    double force = 0;
    for (const ContactPoint& point : makeContactPoints(robot.model, ground)) {
      if (point.contact != 0) continue;
      const Vector3d p = sole.X_BF.inverse().act(point.p) - depth * Vector3d::UnitZ();
      CHECK(std::abs(p.x()) <= sole.half_length * (1 + 1e-12));
      force += calcContactForce(terrain, point, p, Vector3d::Zero()).force.z();
    }
    return force;
  };
  const double weight = robot.model.mass() * robot.model.gravity().norm();
  Ground far, ridge;
  far.steps.push_back({{5, 0, 0.2}, 1, 1, 0, 0, 0});
  CHECK(press({}, 1e-4) == Approx(weight));
  CHECK(press(far, 1e-4) == Approx(weight));
  CHECK(press(far, 4e-4) == Approx(4 * weight));
  // A step under the sole, none of whose corners is over it: three rows of five points are, as deep as its weight makes a sole.
  ridge.height = -0.01;
  ridge.steps.push_back({Vector3d::Zero(), 1.2 * sole.half_length, 1, 0, 0, 0});
  CHECK(press(ridge, 3.9e-4) == 0);
  CHECK(press(ridge, 5e-4) == Approx(weight * 3 / 5));
  CHECK(makeContactPoints(robot.model, {}).size() == 8);
}

TEST_CASE("contact law: stops push back from both sides") {
  const JointStop stop{0, 0, -1, 2, 1e4, 0.5};
  CHECK(calcStopForce(stop, 1.999, 5).force == 0);
  CHECK(calcStopForce(stop, 2.01, 0).force == Approx(-100));
  CHECK(calcStopForce(stop, 2.01, 1).force == Approx(-150));
  CHECK(calcStopForce(stop, -1.01, 0).force == Approx(100));
  CHECK(calcStopForce(stop, -1.01, -1).force == Approx(150));
  CHECK(calcStopForce(stop, -1.01, 10).force == 0);
  CHECK(calcStopForce(stop, -1.01, 0).elastic == Approx(0.5));
}

}  // namespace bielle::worlds
