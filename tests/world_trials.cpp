#include "world_trials.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/constrained.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/model/builder.h"
#include "bielle/motion/motion.h"
#include "bielle/robots/robot_loader.h"

namespace bielle::worlds::testing {
namespace {

Vector3d calcTrunkCom(const World& world, const Model& model) {
  Workspace ws(model);
  updatePlacements<double>(model, ws, world.configuration());
  return ws.X_WB[1].act(model.bodies()[1].inertia.com);
}

double calcLoad(const World& world) {
  double load = 0;
  for (const FootReport& foot : world.feet()) load += foot.wrench[2];
  return load;
}

}  // namespace

bool hold(World& world, const PostureHold& posture, double duration, const std::function<Vector3d(double)>& push) {
  const int ticks = static_cast<int>(std::lround(duration / 1e-3));
  for (int i = 0; i < ticks; ++i) {
    world.setTorques(posture.calcTorques(world));
    if (push) world.setPush(push(world.time()));
    if (!world.advance(1e-3)) return false;
  }
  return true;
}

double calcBalanceError(const Books& start, const Books& end) {
  const double change = end.energy() - start.energy();
  const double losses = end.contact_loss + end.stop_loss + end.other_loss;
  const double largest = std::max({std::abs(change), std::abs(end.motor_work), std::abs(end.push_work), losses, 1e-12});
  return std::abs(change - end.motor_work - end.push_work + losses) / largest;
}

void checkStanding(World& world, const Model& model, const TrialTolerances& tolerances) {
  const PostureHold posture(model);
  world.reset(posture.posture(), VectorXd::Zero(model.nv()));
  const auto lean = [](double) { return Vector3d(0, 13, 0); };  // friction has to hold it
  REQUIRE(hold(world, posture, 1.5, lean));
  std::vector<double> slips;
  for (const FootReport& foot : world.feet()) slips.push_back(foot.slip);
  REQUIRE(hold(world, posture, 0.5, lean));
  const double weight = model.mass() * model.gravity().norm();
  CHECK(calcLoad(world) == Approx(weight).epsilon(1e-3));
  for (size_t c = 0; c < slips.size(); ++c) {
    CHECK(world.feet()[c].touches);
    CHECK(world.feet()[c].wrench.head<2>().norm() > 4);
    CHECK(std::abs(world.feet()[c].slip - slips[c]) < tolerances.creep);
  }
  CHECK((world.configuration().head<3>() - posture.posture().head<3>()).norm() < 0.01);
  CHECK(world.gap() < tolerances.gap);
  CHECK(world.time() == Approx(2.0));
  // A state that is none is refused, and the world is where it was.
  const VectorXd stood = world.configuration(), rest = VectorXd::Zero(model.nv());
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    VectorXd q = stood, v = rest;
    q[9] = v[7] = bad;
    CHECK_THROWS_AS(world.reset(q, rest), std::invalid_argument);
    CHECK_THROWS_AS(world.reset(stood, v), std::invalid_argument);
  }
  CHECK(world.configuration() == stood);
  CHECK(world.time() == Approx(2.0));
  CHECK(hold(world, posture, 0.01));
}

void checkDropped(World& world, const Model& model, const TrialTolerances& tolerances) {
  const PostureHold posture(model);
  VectorXd q = posture.posture();
  constexpr double kHeight = 0.05;
  q[2] += kHeight;
  world.reset(q, VectorXd::Zero(model.nv()));
  const Books start = world.books();
  REQUIRE(hold(world, posture, 0.03));
  CHECK(calcLoad(world) == 0);
  REQUIRE(hold(world, posture, 0.97));
  const Books end = world.books();
  CHECK(calcBalanceError(start, end) < tolerances.balance);
  CHECK(end.contact_loss > 0);
  CHECK(end.stop_loss >= -1e-9);
  CHECK(calcLoad(world) == Approx(model.mass() * model.gravity().norm()).epsilon(0.1));
  // Books that omit half of what the ground took must not balance.
  Books poisoned = end;
  poisoned.contact_loss /= 2;
  CHECK(calcBalanceError(start, poisoned) > 2 * tolerances.balance);
}

void checkPushed(World& world, const Model& model, const TrialTolerances& tolerances) {
  const PostureHold posture(model);
  world.reset(posture.posture(), VectorXd::Zero(model.nv()));
  REQUIRE(hold(world, posture, 0.5));
  const Books start = world.books();
  const Vector3d force(30, 20, 0);
  const Vector3d before = calcTrunkCom(world, model);
  REQUIRE(hold(world, posture, 0.1, [&](double) { return force; }));
  const Vector3d after = calcTrunkCom(world, model);
  Books end = world.books();
  const double work = force.dot(after - before);
  CHECK(work > 0.01);
  CHECK(end.push_work == Approx(work).epsilon(0.01));
  end.motor_work -= start.motor_work;
  end.contact_loss -= start.contact_loss;
  end.stop_loss -= start.stop_loss;
  end.other_loss -= start.other_loss;
  CHECK(calcBalanceError(start, end) < tolerances.balance);
}

void checkStopped(World& world, const Model& model, const TrialTolerances& tolerances) {
  const PostureHold posture(model);
  VectorXd q = posture.posture();
  q[2] += 5;
  world.reset(q, VectorXd::Zero(model.nv()));
  const Books start = world.books();
  const Motor& motor = model.motors()[model.findMotor("hipx_right")];
  const int at = model.joints()[motor.joint].idx_q;
  const double upper = model.upperLimits()[motor.dof];
  REQUIRE(upper < 1);
  double farthest = -upper;
  for (int i = 0; i < 300; ++i) {
    VectorXd u = posture.calcTorques(world);
    u[model.findMotor("hipx_right")] = 10;
    world.setTorques(u);
    REQUIRE(world.advance(1e-3));
    farthest = std::max(farthest, world.configuration()[at]);
  }
  CHECK(farthest > upper);
  CHECK(farthest < upper + 0.05);
  const Books end = world.books();
  CHECK(end.stop_loss > 0.01);
  CHECK(end.contact_loss == Approx(0).margin(1e-9));
  CHECK(calcBalanceError(start, end) < tolerances.balance);
  Books poisoned = end;
  poisoned.stop_loss *= 0.5;
  CHECK(calcBalanceError(start, poisoned) > calcBalanceError(start, end));
}

Model makeSprungFivebar() {
  ModelParts parts = takeParts(loadRobot("fivebar").model);
  PointSpring spring;
  spring.name = "across", spring.body1 = 1, spring.body2 = parts.joints.back().parent;
  spring.point1 = {0.05, 0, 0.02}, spring.point2 = {0.1, 0.01, 0};
  spring.stiffness = 60, spring.rest = 0.1, spring.preload = 1, spring.damping = 1;
  parts.point_springs.push_back(spring);
  spring.name = "down", spring.body1 = 0, spring.body2 = 2;
  spring.point1 = {0.1, 0.02, -0.3};
  parts.point_springs.push_back(spring);
  return ModelBuilder::restore(parts);
}

namespace {

// By steps of h in x = (q, v) with accelerations of the full system.
VectorXd swing(const Model& model, VectorXd q, double duration, double h) {
  Workspace ws(model);
  ConstrainedWorkspace cws;
  const ConstraintSet loops = makeConstraintSet(model);
  VectorXd v = VectorXd::Zero(model.nv());
  const VectorXd tau = v;
  const auto calcAcceleration = [&](const VectorXd& x, const VectorXd& rate) {
    REQUIRE(updateConstrainedDynamics(model, ws, cws, loops, x, rate, tau) == NumericalStatus::Ok);
    return cws.a;
  };
  for (int i = 0; i < std::lround(duration / h); ++i) {  // all joints turn about fixed axes: q + dq
    const VectorXd v1 = v, a1 = calcAcceleration(q, v1), v2 = v + h / 2 * a1;
    const VectorXd a2 = calcAcceleration(q + h / 2 * v1, v2), v3 = v + h / 2 * a2;
    const VectorXd a3 = calcAcceleration(q + h / 2 * v2, v3), v4 = v + h * a3;
    const VectorXd a4 = calcAcceleration(q + h * v3, v4);
    q += h / 6 * (v1 + 2 * v2 + 2 * v3 + v4);
    v += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
  }
  return q;
}

}  // namespace

double checkSprung(World& world, const Model& model, double balance) {
  constexpr double kDuration = 0.5;
  const VectorXd q = findClosedConfiguration(model).q;
  world.reset(q, VectorXd::Zero(model.nv()));
  const Books start = world.books();
  REQUIRE(world.advance(kDuration));
  const Books end = world.books();
  const VectorXd expected = swing(model, q, kDuration, 1e-3);
  REQUIRE((expected - q).cwiseAbs().maxCoeff() > 0.1);
  const double error = (world.configuration() - expected).cwiseAbs().maxCoeff();
  CHECK(calcBalanceError(start, end) < balance);
  // Dampers that are booked by half, or springs that are not, must show.
  Books poisoned = end;
  poisoned.other_loss /= 2;
  CHECK(calcBalanceError(start, poisoned) > 2 * balance);
  ModelParts slack = takeParts(model);
  slack.point_springs.clear();
  const Model without = ModelBuilder::restore(slack);
  Workspace ws(model), other(without);
  const auto calcSpringEnergy = [&](const VectorXd& x) {
    updatePositions(model, ws, x);
    updatePositions(without, other, x);
    return calcPotentialEnergy(model, ws) - calcPotentialEnergy(without, other);
  };
  poisoned = end;
  poisoned.potential -= calcSpringEnergy(world.configuration()) - calcSpringEnergy(q);
  CHECK(calcBalanceError(start, poisoned) > 2 * balance);
  return error;
}

}  // namespace bielle::worlds::testing
