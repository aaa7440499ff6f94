#include "edge_trials.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "bielle/dynamics/kinematics.h"
#include "bielle/model/builder.h"
#include "selection.h"
#include "world_trials.h"

namespace bielle::worlds::testing {

Model makeBlock(ContactKind kind, const Vector3d& com, const BlockSize& size) {
  ModelBuilder builder("block");
  Joint base;
  base.name = "base";
  base.kind = JointKind::FreeFlyer;
  builder.addLink("block", "world", base, {size.mass, com, 0.005 * size.mass * Matrix3d::Identity()});
  builder.addContact("foot", "block", kind, size.half_length, kind == ContactKind::Surface6D ? size.half_width : 0);
  return builder.build();
}

namespace {

// How a sole or an edge lies over a step, in the frame of its top.
struct Pose {
  Eigen::Vector2d place = Eigen::Vector2d::Zero();  // m
  double yaw = 0;                                   // rad
  double share = 0;   // of the way of the load from the middle of what bears to the middle of its side in -x
  double height = 0;  // of the centre of mass over the sole, m
};

// What of a foot lies on a step, by samples.
struct Bearing {
  Vector3d centre = Vector3d::Zero(),
           rim = Vector3d::Zero();  // of all, and of what is lowest in x; in the frame of the sole, m
  double part = 0;                  // of the foot
};
Bearing findBearing(const BlockSize& size, const GroundStep& step, const Pose& pose) {
  constexpr int kSamples = 100;
  const int across = size.half_width > 0 ? kSamples : 0;
  const Eigen::Matrix2d R = Eigen::Rotation2Dd(pose.yaw).toRotationMatrix();
  const auto calcX = [&](const Vector3d& p) { return pose.place.x() + R.row(0).dot(p.head<2>()); };
  std::vector<Vector3d> on;
  double lowest = 1e9;
  for (int i = 0; i <= kSamples; ++i)
    for (int k = 0; k <= across; ++k) {
      const Vector3d p(size.half_length * (2.0 * i / kSamples - 1),
                       across > 0 ? size.half_width * (2.0 * k / kSamples - 1) : 0, 0);
      const Eigen::Vector2d at = pose.place + R * p.head<2>();
      if (std::abs(at.x()) > step.length / 2 || std::abs(at.y()) > step.width / 2) continue;
      on.push_back(p);
      lowest = std::min(lowest, calcX(p));
    }
  Bearing out;
  int rims = 0;
  for (const Vector3d& p : on) {
    out.centre += p / double(on.size());
    if (calcX(p) > lowest + 0.02 * size.half_length) continue;
    out.rim += p;
    ++rims;
  }
  if (rims > 0) out.rim /= rims;
  out.part = double(on.size()) / (kSamples + 1) / (across + 1);
  return out;
}

EdgeTrial makeTrial(const BlockSize& size, const GroundStep& step, const Pose& pose) {
  const Bearing bearing = findBearing(size, step, pose);
  REQUIRE(bearing.part > 0);
  const Vector3d com = bearing.centre + pose.share * (bearing.rim - bearing.centre) + Vector3d(0, 0, pose.height);
  const Model model = makeBlock(size.half_width > 0 ? ContactKind::Surface6D : ContactKind::Edge5D, com, size);
  VectorXd q = model.makeNeutral();
  const double yaw = step.yaw + pose.yaw;
  q.head<2>() = step.top.head<2>() + Eigen::Rotation2Dd(step.yaw) * pose.place;
  q.segment<5>(2) << step.top.z(), 0, 0, std::sin(yaw / 2), std::cos(yaw / 2);
  return {model, step, q, size.mass * model.gravity().norm()};
}

void checkStays(const EdgeTrial& trial, const MakeWorld& makeWorld) {
  const ContactFrame& foot = trial.model.contacts()[0];
  CAPTURE(trial.step.top.transpose(), trial.step.length, trial.step.width, trial.step.yaw, trial.q.transpose(),
          foot.half_length, foot.half_width, trial.model.bodies()[1].inertia.com.transpose(), trial.weight);
  WorldOptions options;
  options.ground.height = trial.step.top.z() - 0.3;
  options.ground.steps = {trial.step};
  const auto world = makeWorld(trial.model, options);
  world->reset(trial.q, VectorXd::Zero(trial.model.nv()));
  double load = 0;
  for (int i = 0; i < 300; ++i) {
    REQUIRE(world->advance(1e-3));
    if (i >= 200) load += world->feet()[0].wrench[2] / 100;
  }
  const VectorXd moved = trial.model.difference(trial.q, world->configuration());
  CHECK(moved.head<3>().norm() < 1e-3);
  CHECK(moved.tail<3>().norm() < 0.01);
  CHECK(load == Approx(trial.weight).epsilon(0.02));
}

}  // namespace

std::vector<EdgeTrial> makeEdgeTrials(int count) {
  std::mt19937 rng(5);
  const auto draw = [&](double from, double to) { return std::uniform_real_distribution<double>(from, to)(rng); };
  std::vector<EdgeTrial> trials;
  while (int(trials.size()) < count) {
    const bool is_sole = draw(0, 1) < 0.8;
    BlockSize size;
    size.half_length = draw(0.03, 0.14);
    size.half_width = is_sole ? draw(0.025, std::min(0.08, 1.2 * size.half_length)) : 0;
    size.mass = std::exp(draw(0, 4.4));
    // A wide one, or of the size of the foot along x, y or both.
    GroundStep step = {{draw(-1, 1), draw(-1, 1), draw(-0.2, 0.4)}, 2, 2, draw(-M_PI, M_PI), 0, 0};
    const bool is_short = draw(0, 1) < 0.4, is_narrow = draw(0, 1) < 0.4;
    if (is_short) step.length = std::max(0.03, draw(0.6, 2) * size.half_length);
    if (is_narrow) step.width = std::max(0.03, draw(0.6, 2) * size.half_width);
    Pose pose;
    pose.yaw = is_sole ? draw(-M_PI, M_PI) : draw(-0.35, 0.35);
    const double reach =
        size.half_length * std::abs(std::cos(pose.yaw)) + size.half_width * std::abs(std::sin(pose.yaw));
    pose.place.x() = is_short ? draw(-0.2, 0.2) * step.length : -1 + reach * (1 - 2 * draw(0, 0.5));
    pose.share = draw(0, 0.5);
    pose.height = is_sole ? draw(0.02, 0.3) : -0.05;
    if (findBearing(size, step, pose).part > (is_sole ? 0.25 : 0.4)) trials.push_back(makeTrial(size, step, pose));
  }
  return trials;
}

void checkOverhangs(const MakeWorld& makeWorld) {
  const GroundStep wide = {{0.5, 0, 0}, 1, 1, 0, 0, 0}, corner = {{0.5, 0.49, 0}, 1, 1, 0, 0, 0},
                   tread = {{0.03, 0, 0}, 0.06, 1, 0, 0, 0}, stone = {{0.035, 0, 0}, 0.07, 0.05, 0, 0, 0};
  bielle::testing::Selection selection(9);
  for (const GroundStep& step : {wide, corner, tread, stone})
    for (const bool is_sole : {true, false})
      for (const double overhang : {0.0, 0.1, 0.2, 0.35, 0.45, 0.5})
        for (const double yaw : {0.0, 0.1, -0.3, 0.785, 1.3, 1.5708, 3.0})
          for (const double share : {0.0, 0.5}) {
            if (!is_sole && std::abs(std::cos(yaw)) < 0.9) continue;
            if ((overhang == 0 && share > 0) || selection.isLeftOut()) continue;
            BlockSize size;
            if (!is_sole) size.half_width = 0;
            const double reach = size.half_length * std::abs(std::cos(yaw)) + size.half_width * std::abs(std::sin(yaw));
            // An edge bears along itself alone; its block hangs from it, and so does not roll over.
            const Eigen::Vector2d place(reach * (1 - 2 * overhang) - step.top.x(), -step.top.y());
            checkStays(makeTrial(size, step, {place, yaw, share, is_sole ? 0.05 : -0.05}), makeWorld);
          }
  // What lies on the step has six corners, two more than the sole.
  checkStays(makeTrial({0.027, 0.022, 1.6}, {{0, 0, 0.3}, 2, 0.018, 0, 0, 0}, {{0, 0}, 0.682, 0.47, 0.12}), makeWorld);
  for (const EdgeTrial& trial : makeEdgeTrials(300))
    if (!selection.isLeftOut()) checkStays(trial, makeWorld);
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

void checkTwists(const MakeWorld& makeWorld) {
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

void checkRisers(const MakeWorld& makeWorld) {
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

}  // namespace bielle::worlds::testing
