// Motors that brake before dead points of their linkages.
#include <catch2/catch.hpp>
#include <cmath>

#include "bielle/motion/motion.h"
#include "bielle/robots/robot_loader.h"
#include "bielle/worlds/bielle_world.h"
#include "control/dead_point_stop.h"
#include "control/passive_joints.h"
#include "own_robots.h"

namespace bielle {
namespace {

using bielle::testing::getBipetto;

constexpr double kControlPeriod = 1e-3;  // s
constexpr double kStop = 0.08;

const Model& getFourBar() {
  static const LoadedRobot robot = loadRobot(BIELLE_SOURCE_DIR "/robots/fourbar");
  return robot.model;
}

VectorXd getMotorPositions(const Model& model, const VectorXd& q) {
  VectorXd positions(model.nu());
  for (int m = 0; m < model.nu(); ++m) positions[m] = q[model.joints()[model.motors()[m].joint].idx_q];
  return positions;
}

// A four-bar whose crank is driven by a constant torque for a second: the least transmission on its way.
double driveCrank(double torque, double stop, double delay) {
  const Model& model = getFourBar();
  const VectorXd q0 = makeStandingPosture(model);
  const Linkage linkage = listLinkages(model, q0).at(0);
  DeadPointStop dead_point_stop(model, q0, stop);
  const auto world = worlds::makeBielleWorld(model);
  world->reset(q0, VectorXd::Zero(model.nv()));
  VectorXd u(model.nu());
  std::vector<VectorXd> sent(static_cast<size_t>(std::lround(delay / kControlPeriod)), VectorXd::Zero(model.nu()));
  double least = 1;
  for (int tick = 0; tick < 1000; ++tick) {
    u.setConstant(torque);
    dead_point_stop.add({world->time(), world->configuration(), world->velocity(), {}, delay}, u);
    sent.push_back(u);
    world->setTorques(sent[tick]);
    REQUIRE(world->advance(kControlPeriod));
    least = std::min(least, calcTransmission(linkage, model, world->configuration()));
  }
  return least;
}

}  // namespace

TEST_CASE("dead point stop: the gradient of transmissions by the motors is that of differences") {
  const Model& model = getBipetto();
  const VectorXd q0 = makeStandingPosture(model);
  const VectorXd motors = getMotorPositions(model, q0);
  PassiveJoints joints(model, q0);
  VectorXd gradient(model.nu());
  const double step = 1e-5;
  int tried = 0;
  LinkageWorkspaces memory;
  for (const Linkage& linkage : listLinkages(model, q0)) {
    VectorXd q = q0, moved = q0;
    const VectorXd offset = VectorXd::LinSpaced(model.nu(), -0.15, 0.2);
    REQUIRE(joints.reset(q0));
    REQUIRE(joints.update(motors + offset, q) == NumericalStatus::Ok);
    calcTransmission(linkage, memory, model, q, gradient);
    VectorXd differences(model.nu());
    for (int m = 0; m < model.nu(); ++m) {
      double change = 0;
      for (double sign : {-1.0, 1.0}) {
        VectorXd to = motors + offset;
        to[m] += sign * step;
        REQUIRE(joints.update(to, moved) == NumericalStatus::Ok);
        change += sign * calcTransmission(linkage, model, moved);
      }
      differences[m] = change / (2 * step);
    }
    REQUIRE(gradient.norm() > 1e-3);
    CHECK((gradient - differences).norm() < 1e-6 * gradient.norm());
    Eigen::Index largest = 0;
    gradient.cwiseAbs().maxCoeff(&largest);
    gradient[largest] *= 1.001;  // a wrong entry is found
    CHECK((gradient - differences).norm() > 1e-6 * gradient.norm());
    ++tried;
  }
  CHECK(tried == 4);
}

TEST_CASE("dead point stop: a crank that is driven past its dead points stops before them") {
  for (double torque : {-0.5, 0.5})
    for (double delay : {0.0, 5e-3}) {
      CAPTURE(torque, delay);
      CHECK(driveCrank(torque, 0, delay) < 0);
      CHECK(driveCrank(torque, kStop, delay) > 0.2 * kStop);
    }
}

TEST_CASE("dead point stop: torques far from dead points are left alone") {
  const Model& model = getBipetto();
  const VectorXd q = makeStandingPosture(model), u0 = VectorXd::LinSpaced(model.nu(), -3, 3);
  DeadPointStop stop(model, q, kStop);
  VectorXd u = u0;
  for (double time : {0.0, kControlPeriod}) stop.add({time, q, VectorXd::Zero(model.nv())}, u);
  CHECK(u == u0);
}

}  // namespace bielle
