// Distances (rods without a body) and sliders. Oracles: a four-bar and a slider-crank in closed form, a rod that is a body of next
// to no mass, energy over a swing.
#include <cmath>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/constrained.h"
#include "bielle/dynamics/impact.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/ratio.h"
#include "bielle/robots/robot_loader.h"
#include "check_derivative.h"
#include "dynamics/loop_conflict.h"
#include "get_error.h"
#include "math/constants.h"
#include "robot_directory.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

constexpr double kBaseLength = 0.4, kCrankLength = 0.15, kRodLength = 0.35, kRockerLength = 0.3;  // m

Joint makeJointAt(const std::string& name, JointKind kind, const Vector3d& axis, const Vector3d& p) {
  Joint joint;
  joint.name = name;
  joint.kind = kind;
  joint.axis = axis;
  joint.X_PJ.p = p;
  return joint;
}

Inertia makeBar(double length) {
  Inertia bar;
  bar.mass = length;
  bar.com = {length / 2, 0, 0};
  const double transverse = length * length * length / 12;
  bar.I_com = Vector3d(1e-4, transverse, transverse).asDiagonal();
  return bar;
}

// Crank and rocker on the ground, about y.
ModelBuilder makeCrankAndRocker() {
  ModelBuilder builder("four-bar");
  builder.addLink("crank", "world", makeJointAt("j_crank", JointKind::Revolute, Vector3d::UnitY(), {0, 0, 0}),
                  makeBar(kCrankLength));
  builder.addLink("rocker", "world",
                  makeJointAt("j_rocker", JointKind::Revolute, Vector3d::UnitY(), {kBaseLength, 0, 0}),
                  makeBar(kRockerLength));
  builder.addFrame("crank_end", "crank", {Matrix3d::Identity(), {kCrankLength, 0, 0}});
  builder.addFrame("rocker_end", "rocker", {Matrix3d::Identity(), {kRockerLength, 0, 0}});
  builder.addMotor("j_crank");
  return builder;
}

Model makeRodLinkage() {
  ModelBuilder builder = makeCrankAndRocker();
  builder.addDistance("rod", "crank_end", "rocker_end", kRodLength);
  return builder.build();
}

// The same with the rod as a body of `mass` on a ball and a pin.
Model makeBarLinkage(double mass) {
  ModelBuilder builder = makeCrankAndRocker();
  Inertia bar = makeBar(kRodLength);
  bar.mass *= mass, bar.I_com *= mass;
  builder.addLink("bar", "crank", makeJointAt("j_bar", JointKind::Revolute, Vector3d::UnitY(), {kCrankLength, 0, 0}),
                  bar);
  builder.addFrame("bar_end", "bar", {Matrix3d::Identity(), {kRodLength, 0, 0}});
  builder.addClosure("pin", ClosureKind::Ball3D, "bar_end", "rocker_end");
  return builder.build();
}

// Angles about y turn x to -z.
Vector3d locateEnd(double x, double length, double angle) {
  return {x + length * std::cos(angle), 0, -length * std::sin(angle)};
}

// The rocker's angle at that of the crank, from the triangle of rod and rocker, above the ground.
double calcRockerAngle(double crank) {
  const Vector3d d = locateEnd(0, kCrankLength, crank) - Vector3d(kBaseLength, 0, 0);
  const double distance = d.norm(),
               inner = std::acos((kRockerLength * kRockerLength + distance * distance - kRodLength * kRodLength) /
                                 (2 * kRockerLength * distance));
  return std::atan2(-d.z(), d.x()) + inner;
}

// Speed of the rocker over that of the crank: the rod keeps its length.
double calcRatio(double crank) {
  const double rocker = calcRockerAngle(crank);
  const Vector3d p1 = locateEnd(0, kCrankLength, crank), p2 = locateEnd(kBaseLength, kRockerLength, rocker),
                 along = p2 - p1;
  const Vector3d y = Vector3d::UnitY();
  return along.dot(y.cross(p1)) / along.dot(y.cross(p2 - Vector3d(kBaseLength, 0, 0)));
}

struct RodMotion {
  VectorXd a, lambda;
};
RodMotion solveRods(const Model& model, const VectorXd& q, const VectorXd& v, double torque) {
  Workspace ws(model);
  ConstrainedWorkspace cws;
  REQUIRE(updateConstrainedDynamics(model, ws, cws, makeConstraintSet(model), q, v,
                                    calcMotorForces(model, VectorXd::Constant(1, torque))) == NumericalStatus::Ok);
  return {cws.a, cws.lambda};
}

double calcRodEnergy(const Model& model, const VectorXd& q, const VectorXd& v) {
  Workspace ws(model);
  updatePositions(model, ws, q);
  updateVelocities(model, ws, v);
  return calcKineticEnergy(model, ws) + calcPotentialEnergy(model, ws);
}

// Classical Runge-Kutta steps; the loop is not put right in between.
void swingRods(const Model& model, double h, int steps, VectorXd& q, VectorXd& v) {
  const auto rate = [&](const VectorXd& q_at, const VectorXd& v_at) { return solveRods(model, q_at, v_at, 0).a; };
  for (int i = 0; i < steps; ++i) {
    const VectorXd a1 = rate(q, v), v2 = v + h / 2 * a1, a2 = rate(q + h / 2 * v, v2), v3 = v + h / 2 * a2,
                   a3 = rate(q + h / 2 * v2, v3), v4 = v + h * a3, a4 = rate(q + h * v3, v4);
    q += h / 6 * (v + 2 * v2 + 2 * v3 + v4);
    v += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
  }
}

std::string makeRodPair(const std::string& closure) {
  return "base: fixed\nclosures: [{name: rod, frames: [crank_tip, rocker_tip], " + closure + "}]\n";
}

const char* const kPairUrdf = R"(<robot name="pair"><link name="ground"/>
<link name="crank"><inertial><mass value="1"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="rocker"><inertial><mass value="1"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="a" type="continuous"><parent link="ground"/><child link="crank"/><axis xyz="0 1 0"/></joint>
<joint name="b" type="continuous"><parent link="ground"/><child link="rocker"/><origin xyz="0.3 0 0"/><axis xyz="0 1 0"/></joint>
<link name="crank_tip"/><joint name="t1" type="fixed"><parent link="crank"/><child link="crank_tip"/><origin xyz="0 0 0.1"/></joint>
<link name="rocker_tip"/><joint name="t2" type="fixed"><parent link="rocker"/><child link="rocker_tip"/><origin xyz="0.1 0 0.4"/></joint>
</robot>)";

}  // namespace

TEST_CASE("a distance in a four-bar: angles, ratio, accelerations and tension in closed form") {
  const Model model = makeRodLinkage();
  Workspace ws(model);
  for (double crank = 0.1; crank < 2 * kPi; crank += 0.61) {
    CAPTURE(crank);
    const AssemblyResult closed = closeConfiguration(model, Eigen::Vector2d(crank, calcRockerAngle(crank) + 0.02));
    REQUIRE(closed.status == NumericalStatus::Ok);
    CHECK(std::abs(closed.q[1] - calcRockerAngle(closed.q[0])) < 1e-10);
    const double at = closed.q[0], ratio = calcRatio(at);
    const VectorXd q = Eigen::Vector2d(at, calcRockerAngle(at));
    const Mobility mobility = calcMobility(model, q);
    CHECK(mobility.rank == 1);
    CHECK(mobility.mobility == 1);

    const double rate = 2.3, torque = 0.7;
    const VectorXd v = Eigen::Vector2d(rate, ratio * rate);
    updatePositions(model, ws, q);
    updateVelocities(model, ws, v);
    CHECK(calcClosureVelocity(ws, model.closures()[0]).norm() < 1e-14);
    // (I1 + n^2 I2) a + n n' I2 w^2 + dV/dcrank = torque, n' = dn/dcrank
    const double I1 = std::pow(kCrankLength, 3) / 3, I2 = std::pow(kRockerLength, 3) / 3, h = 1e-3;
    const double slope =
        (8 * (calcRatio(at + h) - calcRatio(at - h)) - (calcRatio(at + 2 * h) - calcRatio(at - 2 * h))) / (12 * h);
    const auto calcGravityTorque = [](double length, double angle) {
      return 9.81 * length * length / 2 * std::cos(angle);  // -dV/dangle: z falls as the angle grows
    };
    const double acceleration = (torque + calcGravityTorque(kCrankLength, q[0]) +
                                 ratio * calcGravityTorque(kRockerLength, q[1]) - ratio * slope * I2 * rate * rate) /
                                (I1 + ratio * ratio * I2);
    const RodMotion found = solveRods(model, q, v, torque);
    CHECK(found.a[0] == Approx(acceleration).epsilon(1e-8));
    CHECK(found.a[1] == Approx(ratio * acceleration + slope * rate * rate).epsilon(1e-8));
    // The rod pulls the rocker's end towards the crank's.
    const Vector3d p2 = locateEnd(kBaseLength, kRockerLength, q[1]),
                   along = (p2 - locateEnd(0, kCrankLength, q[0])) / kRodLength;
    const double arm = Vector3d::UnitY().dot((p2 - Vector3d(kBaseLength, 0, 0)).cross(-along));
    CHECK(found.lambda[0] * arm ==
          Approx(I2 * found.a[1] - calcGravityTorque(kRockerLength, q[1])).epsilon(1e-8).margin(1e-9));
  }
}

TEST_CASE("the ratio along a linkage with a rod, and its dead points where crank and rod are in line") {
  const Model model = makeRodLinkage();
  const VectorXd q = Eigen::Vector2d(0.8, calcRockerAngle(0.8));
  const RatioSweep sweep = sweepRatio(model, makeLinkage(model, q, {"j_rocker"}), q);
  CHECK(sweep.full_turn);
  for (const RatioSample& sample : sweep.samples) {
    if (sample.dead != DeadPointKind::None) continue;
    const double crank = sample.motors[0];
    CHECK(std::abs(std::remainder(sample.joints[0] - calcRockerAngle(crank), 2 * kPi)) < 1e-9);
    if (std::abs(calcRatio(crank)) > 1e-2) CHECK(sample.ratio.R(0, 0) * calcRatio(crank) == Approx(1).epsilon(1e-8));
  }
  const std::vector<RatioSample> dead = sweep.deadPoints();
  REQUIRE(dead.size() >= 2);
  for (const RatioSample& sample : dead) {
    CHECK(sample.dead == DeadPointKind::Output);
    // The triangle of the ground, the rocker, and the rod beyond the crank or behind it.
    const auto calcInner = [](double side) {
      return std::acos((kBaseLength * kBaseLength + kRockerLength * kRockerLength - side * side) /
                       (2 * kBaseLength * kRockerLength));
    };
    const double inner = kPi - std::abs(std::remainder(sample.joints[0], 2 * kPi));
    CHECK(std::min(std::abs(inner - calcInner(kRodLength + kCrankLength)),
                   std::abs(inner - calcInner(kRodLength - kCrankLength))) < 1e-8);
  }
}

TEST_CASE("a rod that weighs next to nothing moves and pulls as a distance does, also after an impact") {
  const Model rod = makeRodLinkage(), bar = makeBarLinkage(1e-9);
  const double crank = 0.8, rocker = calcRockerAngle(crank);
  const Vector3d along = locateEnd(kBaseLength, kRockerLength, rocker) - locateEnd(0, kCrankLength, crank);
  const VectorXd q = Eigen::Vector2d(crank, rocker);
  VectorXd q_bar(3);  // in the order of the tree
  q_bar[bar.joints()[bar.findJoint("j_crank")].idx_q] = crank;
  q_bar[bar.joints()[bar.findJoint("j_rocker")].idx_q] = rocker;
  q_bar[bar.joints()[bar.findJoint("j_bar")].idx_q] = std::atan2(-along.z(), along.x()) - crank;
  const auto pick = [&](const VectorXd& v) {
    return Eigen::Vector2d(v[bar.joints()[bar.findJoint("j_crank")].idx_v],
                           v[bar.joints()[bar.findJoint("j_rocker")].idx_v]);
  };
  CHECK((solveRods(rod, q, VectorXd::Zero(2), 0.4).a - pick(solveRods(bar, q_bar, VectorXd::Zero(3), 0.4).a)).norm() <
        1e-6);
  CHECK(std::abs(std::abs(solveRods(rod, q, VectorXd::Zero(2), 0.4).lambda[0]) -
                 solveRods(bar, q_bar, VectorXd::Zero(3), 0.4).lambda.norm()) < 1e-6);

  ImpactWorkspace of_rod(rod), of_bar(bar);
  VectorXd v_bar = VectorXd::Zero(3);
  v_bar[bar.joints()[bar.findJoint("j_rocker")].idx_v] = 1;
  REQUIRE(updateImpact(rod, of_rod, makeConstraintSet(rod), q, Eigen::Vector2d(0, 1)) == NumericalStatus::Ok);
  REQUIRE(updateImpact(bar, of_bar, makeConstraintSet(bar), q_bar, v_bar) == NumericalStatus::Ok);
  CHECK((of_rod.v_plus - pick(of_bar.v_plus)).norm() < 1e-6);
  CHECK(of_rod.v_plus.norm() > 0.1);
}

TEST_CASE("a swing on a rod keeps its energy and its length") {
  const Model model = makeRodLinkage();
  VectorXd q = Eigen::Vector2d(0.5, calcRockerAngle(0.5)), v = VectorXd::Zero(2);
  const double energy = calcRodEnergy(model, q, v);
  double most = 0;
  for (int i = 0; i < 10; ++i) {
    swingRods(model, 1e-3, 50, q, v);
    most = std::max(most, v.norm());
    CHECK(std::abs(calcRodEnergy(model, q, v) - energy) < 1e-7 * 9.81 * kRockerLength);
  }
  CHECK(most > 1);
  Workspace ws(model);
  updatePositions(model, ws, q);
  CHECK(calcClosureGap(ws, model.closures()[0]).position < 1e-7);
}

TEST_CASE("a slider-crank whose piston a slider guides: its way in closed form, and energy over a swing") {
  ModelBuilder builder("engine");
  builder.addLink("crank", "world", makeJointAt("j_crank", JointKind::Revolute, Vector3d::UnitY(), {0, 0, 0}),
                  makeBar(kCrankLength));
  builder.addLink("rod", "crank", makeJointAt("j_rod", JointKind::Revolute, Vector3d::UnitY(), {kCrankLength, 0, 0}),
                  makeBar(kRodLength));
  builder.addLink("piston", "rod", makeJointAt("j_pin", JointKind::Revolute, Vector3d::UnitY(), {kRodLength, 0, 0}),
                  {0.2, Vector3d::Zero(), 1e-3 * Matrix3d::Identity()});
  builder.addFrame("guide", "world", {Matrix3d::Identity(), {0.1, 0, 0}});
  builder.addClosure("cylinder", ClosureKind::Slider, "guide", "piston", Vector3d::UnitX());
  builder.addMotor("j_crank");
  const Model model = builder.build();
  const Closure& slider = model.closures()[0];
  CHECK(getRows(slider.kind) == 5);
  Workspace ws(model);
  const auto makePosture = [](double crank) {
    const double rod = -std::asin(kCrankLength / kRodLength * std::sin(crank));
    return VectorXd(Eigen::Vector3d(crank, rod - crank, -rod));
  };
  for (double crank = 0.3; crank < 2 * kPi; crank += 0.7) {
    CAPTURE(crank);
    const AssemblyResult closed =
        closeConfiguration(model, VectorXd(makePosture(crank) + Eigen::Vector3d(0.01, -0.02, 0.01)));
    REQUIRE(closed.status == NumericalStatus::Ok);
    const VectorXd q = makePosture(closed.q[0]);
    CHECK((closed.q - q).norm() < 1e-9);
    updatePositions(model, ws, q);
    const double s = kCrankLength / kRodLength * std::sin(q[0]);
    CHECK(ws.X_WB[3].p.x() == Approx(kCrankLength * std::cos(q[0]) + kRodLength * std::sqrt(1 - s * s)).epsilon(1e-13));
    CHECK(calcClosureResidual(ws, slider).norm() < 1e-14);
    CHECK(calcMobility(model, q).rank == 2);  // three rows say again that the mechanism is plane
  }
  VectorXd q = makePosture(0.5), v = VectorXd::Zero(3);
  const double energy = calcRodEnergy(model, q, v);
  swingRods(model, 1e-3, 300, q, v);
  CHECK(v.norm() > 1);
  CHECK(std::abs(calcRodEnergy(model, q, v) - energy) < 1e-7);
  updatePositions(model, ws, q);
  CHECK(calcClosureResidual(ws, slider).norm() < 1e-7);
}

TEST_CASE("distances of a robot file: the length that is given, that of the zero posture, and what is refused") {
  const RobotDirectory directory;
  const auto load = [&](const std::string& closure) {
    return loadRobot(directory.writeRobot(kPairUrdf, makeRodPair(closure))).model;
  };
  const double neutral = Vector3d(0.4, 0, 0.3).norm();
  CHECK(load("type: distance").closures()[0].length == Approx(neutral).epsilon(1e-15));
  const Model model = load("type: distance, length: 0.45, kp: 3");
  CHECK(model.closures()[0].length == 0.45);
  CHECK(model.closures()[0].kp == 3);
  CHECK(calcMobility(model, findClosedConfiguration(model).q).mobility == 1);
  CHECK(load("type: slider, axis: [1, 0, 0]").closures()[0].axis == Vector3d::UnitX());
  const auto getLoadError = [&](const std::string& closure) { return getError([&] { load(closure); }); };
  CHECK_THAT(
      getLoadError("type: distance, length: 0"),
      Catch::Contains("(line 2): the length of a distance is above 0; correct it; points that coincide are a ball"));
  CHECK_THAT(getLoadError("type: 3d, length: 1"), Catch::Contains("only a distance has a length; use type distance"));
  CHECK_THAT(getLoadError("type: distance, axis: [1, 0, 0]"),
             Catch::Contains("only a hinge or a slider has an axis; use type 5d or slider"));
  CHECK_THAT(getLoadError("type: rod"), Catch::Contains("closure type 'rod' is unknown; use 6d"));
  const Model too_long = load("type: distance, length: 2");
  const std::vector<LoopConflict> conflicts = findLoopConflicts(too_long, too_long.makeNeutral());
  REQUIRE(conflicts.size() == 1);
  REQUIRE(!conflicts[0].remedies.empty());
  CHECK_THAT(describeRemedies(too_long, conflicts[0]), Catch::Contains("the length of distance 'rod' by -"));
  for (const LoopRemedy& remedy : conflicts[0].remedies) {
    const Model mended = applyRemedy(too_long, remedy);
    CHECK(closeConfiguration(mended, conflicts[0].q).gap < 1e-8);  // as long as it just reaches
    if (remedy.place.kind == ModelPlace::Kind::Offset) CHECK(mended.closures()[0].length < 2);
  }
}

TEST_CASE("distances of the builder: lengths that are none are refused") {
  const auto build = [](std::optional<double> length, const std::string& frame2 = "rocker_end") {
    ModelBuilder builder = makeCrankAndRocker();
    builder.addFrame("above", "rocker", {Matrix3d::Identity(), {kCrankLength - kBaseLength, 0, 0}});
    builder.addDistance("rod", "crank_end", frame2, length);
    return builder.build();
  };
  CHECK(build({}).closures()[0].length == Approx(kBaseLength + kRockerLength - kCrankLength).epsilon(1e-15));
  for (const double length : {0.0, -1.0, HUGE_VAL, std::nan("")})
    CHECK_THAT(getError([&] { build(length); }),
               Catch::Contains("closure 'rod': its length is not a finite number above 0"));
  CHECK_THAT(getError([&] { build({}, "above"); }),
             Catch::Contains("its points coincide where all coordinates are neutral; give its length"));
}

TEST_CASE("MuJoCo's spatial tendon of fixed length is a distance") {
  const RobotDirectory directory;
  const auto write = [&](const std::string& sites, const std::string& equality) {
    return directory.write("rod.xml", R"(<mujoco model="rod"><compiler angle="radian"/>
<default><joint axis="0 1 0"/><geom type="capsule" size="0.01" density="1000"/></default><worldbody>
<body name="crank" pos="0 0 0.5"><joint name="crank"/><geom fromto="0 0 0 0.05 0 0.08"/><site name="p" pos="0.05 0 0.08"/></body>
<body name="rocker" pos="0.3 0 0.5"><joint name="rocker"/><geom fromto="0 0 0 0.02 0 0.15"/><site name="q" pos="0.02 0 0.15"/></body>
<site name="fixed"/></worldbody>
<tendon><spatial name="rod">)" + sites + R"(</spatial></tendon>
<equality>)" + equality + R"(</equality></mujoco>)");
  };
  const std::string two = R"(<site site="p"/><site site="q"/>)";
  const LoadedRobot robot = loadRobot(write(two, R"(<tendon tendon1="rod"/>)"));
  const double length = Vector3d(0.27, 0, 0.07).norm();
  REQUIRE(robot.model.closures().size() == 1);
  const Closure& rod = robot.model.closures()[0];
  CHECK(rod.kind == ClosureKind::Distance);
  CHECK(rod.length == Approx(length).epsilon(1e-14));
  CHECK(robot.model.pointSprings().empty());
  for (const std::string& warning : robot.warnings)
    CHECK_THAT(warning, !Catch::Contains("left out") || Catch::Contains("what changes no mechanism"));
  CHECK(calcMobility(robot.model, findClosedConfiguration(robot.model).q).mobility == 1);
  const Model longer = loadRobot(write(two, R"(<tendon tendon1="rod" polycoef="0.01 0 0 0 0"/>)")).model;
  CHECK(longer.closures()[0].length == Approx(length + 0.01).epsilon(1e-14));
  CHECK(loadRobot(write(two, R"(<tendon tendon1="rod" active="false"/>)")).model.closures().empty());
  const auto getLoadError = [&](const std::string& sites, const std::string& equality) {
    return getError([&] { loadRobot(write(sites, equality)); });
  };
  CHECK_THAT(getLoadError(two + R"(<site site="fixed"/>)", R"(<tendon tendon1="rod"/>)"),
             Catch::Contains("its tendon does not run straight between two sites; give it two sites"));
  CHECK_THAT(getLoadError(two, R"(<tendon tendon1="rod" tendon2="rod"/>)"),
             Catch::Contains("it ties a spatial tendon to another tendon; remove tendon2"));
  CHECK_THAT(getLoadError(two, R"(<tendon tendon1="rod" polycoef="-1 0 0 0 0"/>)"),
             Catch::Contains("it leaves its tendon no length; move a site"));
  CHECK_THAT(getLoadError(two, R"(<tendon tendon1="none"/>)"), Catch::Contains("there is no tendon of joints 'none'"));
}
