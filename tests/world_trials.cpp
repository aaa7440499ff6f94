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
#include "selection.h"

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

Model makeBlock(ContactKind kind, const Vector3d& com) {
  ModelBuilder builder("block");
  Joint base;
  base.name = "base";
  base.kind = JointKind::FreeFlyer;
  builder.addLink("block", "world", base, {10, com, 0.05 * Matrix3d::Identity()});
  builder.addContact("foot", "block", kind, 0.05, kind == ContactKind::Surface6D ? 0.03 : 0);
  return builder.build();
}

namespace {

// What of a sole, 0.1 by 0.06 m or as a line, lies on a step, by samples.
struct Bearing {
  Vector3d centre = Vector3d::Zero(),
           rim = Vector3d::Zero();  // of all, and of what is lowest in x; in the frame of the sole, m
  bool is_any = false;
};
Bearing findBearing(ContactKind kind, const GroundStep& step, const Vector3d& place, double yaw) {
  constexpr int kSamples = 200;
  const Matrix3d R = Eigen::AngleAxisd(yaw, Vector3d::UnitZ()).toRotationMatrix();
  std::vector<Vector3d> on;
  double lowest = 1e9;
  for (int i = 0; i <= kSamples; ++i)
    for (int k = 0; k <= (kind == ContactKind::Surface6D ? kSamples : 0); ++k) {
      const Vector3d p(0.05 * (2.0 * i / kSamples - 1),
                       kind == ContactKind::Surface6D ? 0.03 * (2.0 * k / kSamples - 1) : 0, 0);
      const Vector3d at = place + R * p - step.top;
      if (std::abs(at.x()) > step.length / 2 || std::abs(at.y()) > step.width / 2) continue;
      on.push_back(p);
      lowest = std::min(lowest, at.x());
    }
  Bearing out;
  int rims = 0;
  for (const Vector3d& p : on) {
    out.centre += p / double(on.size());
    if ((place + R * p - step.top).x() > lowest + 1e-3) continue;
    out.rim += p;
    ++rims;
  }
  out.is_any = rims > 0;
  if (rims > 0) out.rim /= rims;
  return out;
}

}  // namespace

void checkOverhangs(const std::function<std::unique_ptr<World>(const Model&, const WorldOptions&)>& makeWorld) {
  const GroundStep wide = {{0.5, 0, 0}, 1, 1, 0, 0, 0}, corner = {{0.5, 0.49, 0}, 1, 1, 0, 0, 0},
                   tread = {{0.03, 0, 0}, 0.06, 1, 0, 0, 0}, stone = {{0.035, 0, 0}, 0.07, 0.05, 0, 0, 0};
  bielle::testing::Selection selection(9);
  for (const GroundStep& step : {wide, corner, tread, stone}) {
    WorldOptions options;
    options.ground.height = -0.3;
    options.ground.steps = {step};
    for (const ContactKind kind : {ContactKind::Surface6D, ContactKind::Edge5D})
      for (const double overhang : {0.0, 0.1, 0.2, 0.35, 0.45, 0.5})
        for (const double yaw : {0.0, 0.1, -0.3, 0.785, 1.3, 1.5708, 3.0})
          for (const double share : {0.0, 0.5}) {  // of the way of the load from the middle of what bears to its rim
            const bool is_sole = kind == ContactKind::Surface6D;
            if (!is_sole && std::abs(std::cos(yaw)) < 0.9) continue;
            if ((overhang == 0 && share > 0) || selection.isLeftOut()) continue;
            const double reach = 0.05 * std::abs(std::cos(yaw)) + (is_sole ? 0.03 * std::abs(std::sin(yaw)) : 0);
            const Vector3d place(reach * (1 - 2 * overhang), 0, 0);
            const Bearing bearing = findBearing(kind, step, place, yaw);
            REQUIRE(bearing.is_any);
            // An edge bears along itself alone; its block hangs from it, and so does not roll over.
            const Vector3d com =
                bearing.centre + share * (bearing.rim - bearing.centre) + Vector3d(0, 0, is_sole ? 0.05 : -0.05);
            CAPTURE(step.top.transpose(), step.length, int(kind), overhang, yaw, share, com.transpose());
            const Model model = makeBlock(kind, com);
            const auto world = makeWorld(model, options);
            VectorXd q = model.makeNeutral();
            q.head<7>() << place, 0, 0, std::sin(yaw / 2), std::cos(yaw / 2);
            world->reset(q, VectorXd::Zero(model.nv()));
            double load = 0;
            for (int i = 0; i < 300; ++i) {
              REQUIRE(world->advance(1e-3));
              if (i >= 200) load += world->feet()[0].wrench[2] / 100;
            }
            const VectorXd moved = model.difference(q, world->configuration());
            CHECK(moved.head<3>().norm() < 1e-3);
            CHECK(moved.tail<3>().norm() < 0.01);
            CHECK(load == Approx(10 * 9.81).epsilon(0.02));
          }
  }
}

namespace {

// A block on a foot, which a flywheel over a place of it twists about the vertical. On an edge, it hangs.
Model makeTwister(ContactKind kind, double place) {
  const double height = kind == ContactKind::Surface6D ? 0.02 : -0.02;
  ModelBuilder builder("twister");
  Joint base, axle;
  base.name = "base";
  base.kind = JointKind::FreeFlyer;
  builder.addLink("block", "world", base, {8, {place, 0, height}, 0.05 * Matrix3d::Identity()});
  axle.name = "axle";
  axle.kind = JointKind::Revolute;
  axle.X_PJ.p = {place, 0, height};
  builder.addLink("wheel", "block", axle, {2, Vector3d::Zero(), Matrix3d::Identity()});
  builder.addMotor("axle");
  builder.addContact("foot", "block", kind, 0.05, kind == ContactKind::Surface6D ? 0.03 : 0);
  return builder.build();
}

}  // namespace

void checkTwists(const std::function<std::unique_ptr<World>(const Model&, const WorldOptions&)>& makeWorld) {
  constexpr double kWeight = 10 * 9.81, kRise = 0.2;  // N; of the torque to its value, s
  WorldOptions level, elsewhere, edge;
  elsewhere.ground.steps = {{{5, 0, 0.1}, 1, 1, 0, 0, 0}};
  edge.ground.height = -0.3;
  edge.ground.steps = {{{0.5, 0, 0}, 1, 1, 0, 0, 0}};
  for (const ContactKind kind : {ContactKind::Surface6D, ContactKind::Edge5D})
    for (const WorldOptions* options : {&level, &elsewhere, &edge}) {
      const bool overhangs = options == &edge;
      const double X = overhangs ? 0.025 : 0.05, Y = kind == ContactKind::Surface6D ? 0.03 : 0;  // of what bears
      const Model model = makeTwister(kind, overhangs ? X : 0);
      const auto turn = [&](double torque) {  // rad
        const auto world = makeWorld(model, *options);
        const VectorXd q = model.makeNeutral();
        world->reset(q, VectorXd::Zero(model.nv()));
        for (int i = 0; i < 500; ++i) {
          world->setTorques(VectorXd::Constant(1, torque * std::min(1.0, world->time() / kRise)));
          REQUIRE(world->advance(1e-3));
        }
        return std::abs(model.difference(q, world->configuration())[5]);
      };
      const double friction = options->ground.friction * kWeight;
      CAPTURE(int(kind), overhangs, options->ground.steps.size());
      CHECK(turn(0.99 * friction / std::sqrt(2) * (X + Y)) < 0.01);  // cost.h, Eq. (2), drawn in as in motions
      CHECK(turn(1.03 * friction * std::hypot(X, Y)) > 0.05);
    }
}

void checkRisers(const std::function<std::unique_ptr<World>(const Model&, const WorldOptions&)>& makeWorld) {
  constexpr double kWay = 0.004, kTread = 0.2;  // from the riser, m
  constexpr double kPush = 60;                  // N
  WorldOptions options;
  options.ground.friction = 0.4;
  options.ground.steps = {{{-0.5, 0, kTread}, 1, 1, 0, 0, 0}, {{0.5, 0, kTread + 0.1}, 1, 1, 0, 0, 0}};
  for (const double yaw : {0.0, 0.2, 0.785}) {
    const Model model = makeBlock(ContactKind::Surface6D, {0, 0, 0.02});
    const ContactFrame& sole = model.contacts()[0];
    const auto world = makeWorld(model, options);
    const double reach = sole.half_length * std::cos(yaw) + sole.half_width * std::sin(yaw);
    VectorXd q = model.makeNeutral();
    q.head<7>() << -reach - kWay, 0, kTread, 0, 0, std::sin(yaw / 2), std::cos(yaw / 2);
    world->reset(q, VectorXd::Zero(model.nv()));
    const Books start = world->books();
    for (int i = 0; i < 200; ++i) REQUIRE(world->advance(1e-3));
    for (int i = 0; i < 300; ++i) {
      world->setPush({kPush, 0, 0});
      REQUIRE(world->advance(1e-3));
    }
    Workspace ws(model);
    updatePlacements(model, ws, world->configuration());
    const SE3 X_WF = getPlacement(ws, sole.body, sole.X_BF);
    double front = -1;
    for (const double x : {-1, 1})
      for (const double y : {-1, 1})
        front = std::max(front, X_WF.act({x * sole.half_length, y * sole.half_width, 0}).x());
    CAPTURE(yaw, world->configuration().transpose());
    CHECK(std::abs(front) < 1e-3);
    CHECK(world->configuration()[2] == Approx(kTread).margin(1e-3));
    CHECK(calcBalanceError(start, world->books()) < 0.01);
  }
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
