// Measures of designs against closed forms: electrical energy, and the workspace of a five-bar leg.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/ratio.h"
#include "bielle/model/error.h"
#include "bielle/robots/robot_loader.h"
#include "design/constraint.h"
#include "design/evaluation.h"
#include "design/joint_reach.h"
#include "design/page_data.h"
#include "design/run.h"
#include "design/spec.h"
#include "leg_biped.h"
#include "robot_directory.h"
#include "robots/fivebar_leg.h"
#include "robots/solid.h"

using namespace bielle;
using namespace bielle::testing;
using Catch::Matchers::Contains;

namespace {

MotorTrace makeTrace(const std::vector<double>& dt, const std::vector<double>& torque,
                     const std::vector<double>& speed) {
  MotorTrace trace;
  trace.dt = dt;
  trace.time.resize(dt.size());
  trace.torque = Eigen::Map<const Eigen::RowVectorXd>(torque.data(), torque.size());
  trace.speed = Eigen::Map<const Eigen::RowVectorXd>(speed.data(), speed.size());
  return trace;
}

using Eigen::Vector2d;

TEST_CASE("constraints of designs: what cannot be measured is beyond its bound, on either side") {
  for (const bool at_least : {false, true}) {
    DesignConstraint constraint;
    constraint.at_least = at_least;
    constraint.bound = 2;
    CHECK(calcViolation(constraint, 2) == 0);
    CHECK(calcViolation(constraint, at_least ? 1.9 : 2.1) == Approx(0.05));
    CHECK(calcViolation(constraint, std::numeric_limits<double>::quiet_NaN()) > 1e3);
  }
}

// The five-bar leg on paper, in the plane x, z with the motors at the origin: one side's rods to the foot.
struct Side {
  Vector2d knee, lower;  // from the motor to the knee, from there to the foot
};

Side calcSide(const FiveBarLegParameters& p, const Vector2d& foot, double bend) {
  const double a = p.upper_length, b = p.lower_length, r = foot.norm();
  const double along = (a * a + r * r - b * b) / (2 * r);
  const Vector2d e = foot / r, across(-e.y(), e.x());
  const Vector2d knee = along * e + bend * std::sqrt(a * a - along * along) * across;
  return {knee, foot - knee};
}

// Speeds of the knees per speed of the motors: v (x) l_i = w_i (c_i' . l_i) for both sides gives the velocity v of the
// foot, with c' the derivative of the knee by the motor's angle; then the lower rods turn by the rest.
double calcConditioning(const FiveBarLegParameters& p, const Vector2d& foot) {
  const Side sides[] = {calcSide(p, foot, 1), calcSide(p, foot, -1)};
  const auto turn = [](const Vector2d& v) { return Vector2d(-v.y(), v.x()); };
  Eigen::Matrix2d A, K;
  for (int i = 0; i < 2; ++i) A.row(i) = sides[i].lower.transpose();
  for (int motor = 0; motor < 2; ++motor) {
    Vector2d right = Vector2d::Zero();
    right[motor] = turn(sides[motor].knee).dot(sides[motor].lower);
    const Vector2d v = A.inverse() * right;
    for (int i = 0; i < 2; ++i) {
      const double w = i == motor ? 1 : 0;
      const Vector2d rest = v - w * turn(sides[i].knee);
      K(i, motor) = turn(sides[i].lower).dot(rest) / sides[i].lower.squaredNorm() - w;
    }
  }
  const double sigma = Eigen::JacobiSVD<Eigen::Matrix2d>(K).singularValues()[0];
  return std::sqrt(1 + sigma * sigma);
}

WorkspaceAxis makeRange(double lower, double upper, int points) {
  return {WorkspaceAxis::Kind::Range, lower, upper, points};
}

// A box over the whole annulus and beyond: the foot stands at (0, -depth).
WorkspaceRegion makeBox(double depth) {
  WorkspaceRegion region;
  region.axes[0] = makeRange(-0.35, 0.35, 23);
  region.axes[2] = makeRange(depth - 0.35, depth + 0.35, 23);
  return region;
}

double getDepth(const FiveBarLegParameters& p) {
  const double side = p.upper_length * std::sin(p.stand_angle);
  return p.upper_length * std::cos(p.stand_angle) + std::sqrt(p.lower_length * p.lower_length - side * side);
}

Vector2d getFoot(const WorkspaceGrid& grid, size_t point) {
  return {grid.placements[point].p.x(), grid.placements[point].p.z()};
}

}  // namespace

TEST_CASE("measures: electrical energy of stages by hand") {
  MotorConversion drive;
  drive.motor_constant = 2, drive.regeneration = 0.5;
  // Heat (u / 2)^2 = 2.25 W, 4 W, 2.25 W, 2.25 W; at the shaft 1.5 W, 8 W, -12 W, -1.5 W.
  const MotorTrace trace = makeTrace({0.1, 0.3, 0.2, 0.4}, {3, -4, 3, -3}, {0.5, -2, -4, 0.5});
  const MotorMeasures measures = calcMotorMeasures(trace, {drive})[0];
  CHECK(measures.electrical_energy == Approx(0.1 * 3.75 + 0.3 * 12 - 0.5 * 0.2 * 9.75 + 0.4 * 0.75));
  CHECK(measures.energy == Approx(0.1 * 1.5 + 0.3 * 8 + 0.2 * 12 + 0.4 * 1.5));
  drive.regeneration = 0;
  CHECK(calcMotorMeasures(trace, {drive})[0].electrical_energy == Approx(0.1 * 3.75 + 0.3 * 12 + 0.4 * 0.75));
  CHECK(calcMotorMeasures(trace)[0].electrical_energy ==
        calcMotorMeasures(trace, {MotorConversion()})[0].electrical_energy);
}

TEST_CASE("measures: losses of gears, as in the energies of results, and their gradient") {
  MotorConversion drive;
  drive.motor_constant = 2, drive.regeneration = 0.3, drive.efficiency = 0.9, drive.back_efficiency = 0.8;
  Motor motor;
  motor.torque_loss = 0.25, motor.drive.efficiency = 0.9, motor.drive.back_efficiency = 0.8;
  MotorSlopes motion;
  motion.dt = {0.1, 0.3, 0.2};
  motion.u = Eigen::RowVector3d(3, -1, -4), motion.v = Eigen::RowVector3d(2, 3, -5);
  const auto calc = [&](const MatrixXd& u, const MatrixXd& v) {
    double sum = 0;
    for (int k = 0; k < 3; ++k) sum += motion.dt[k] * calcElectricalPower(motor, u(0, k), v(0, k), 0.3);
    return sum;
  };
  const MotorTrace trace = makeTrace(motion.dt, {3, -1, -4}, {2, 3, -5});
  CHECK(calcMotorMeasures(trace, {drive})[0].electrical_energy == Approx(calc(motion.u, motion.v)));
  motion.du = {Eigen::RowVector3d(0.5, -0.2, 0.7)}, motion.dv = {Eigen::RowVector3d(0.1, 0.4, -0.3)};
  RobotSlopes robot;
  robot.drives = {drive};
  const MeasurePieces pieces = calcMeasurePieces(Measure::ElectricalEnergy, {0}, {motion}, {}, robot);
  const double h = 1e-4, numeric = (calc(motion.u + h * motion.du[0], motion.v + h * motion.dv[0]) -
                                    calc(motion.u - h * motion.du[0], motion.v - h * motion.dv[0])) /
                                   (2 * h);
  CHECK(pieces.values[0] == Approx(calc(motion.u, motion.v)));
  CHECK(pieces.gradients(0, 0) == Approx(numeric).epsilon(1e-6));
}

TEST_CASE("measures: electrical energy of a harmonic motion") {
  // u = U cos wt, v = V cos(wt - phi) over a period T: T (U V cos(phi) / 2 + U^2 / (2 K^2)) with all given back; sums
  // over equal steps are exact.
  const double U = 20, V = 3, K = 1.7, T = 0.8;
  const int n = 100;
  for (double phi : {0.0, 1.0, 2.5}) {
    std::vector<double> u, v;
    for (int k = 0; k < n; ++k) {
      u.push_back(U * std::cos(2 * M_PI * k / n));
      v.push_back(V * std::cos(2 * M_PI * k / n - phi));
    }
    MotorConversion drive;
    drive.motor_constant = K, drive.regeneration = 1;
    const MotorMeasures measures = calcMotorMeasures(makeTrace(std::vector<double>(n, T / n), u, v), {drive})[0];
    CHECK(measures.electrical_energy == Approx(T * (U * V * std::cos(phi) / 2 + U * U / (2 * K * K))));
    CHECK(measures.rms_torque == Approx(U / std::sqrt(2)));
  }
}

TEST_CASE("measures: shares of limits by hand, distances of shapes") {
  const auto build = [](bool near) {
    ModelBuilder builder("limits");
    for (const char* name : {"a", "b", "c"})
      addSolidLink(
          name,
          name == std::string("a")   ? "world"
          : name == std::string("b") ? "a"
                                     : "b",
          makeRevolute(std::string("to_") + name, {name == std::string("a") ? 0 : 0.3, 0, 0}, Vector3d::UnitY()),
          {makeSphere({name == std::string("c") && near ? -0.5 : 0.0, 0, 0}, 0.05, 1, colors::kRod)}, builder);
    Motor motor;
    motor.name = "to_a";
    motor.drive.ratio = 10, motor.drive.rotor_inertia = 1e-4, motor.drive.torque_constant = 0.1;
    motor.drive.resistance = 0.5, motor.drive.voltage = 24, motor.drive.continuous_current = 5;
    motor.drive.efficiency = 0.8, motor.drive.back_efficiency = 0.5;
    builder.addMotor(motor);
    return builder.build();
  };
  const Model model = build(false);
  MotionMeasures measures;
  measures.trace = makeTrace({0.1, 0.3, 0.2}, {3, -4, 6}, {2, 10, 15});
  measures.motors = calcMotorMeasures(measures.trace);
  ShootingTrajectory trajectory;
  trajectory.xs = {VectorXd::Zero(model.nq() + model.nv())};
  addLimitMeasures(model, trajectory, {Measure::Distance}, {}, measures);
  // A newton metre is an ampere less the loss in the gear: 0.5 / 0.8 V; a radian per second is a volt.
  CHECK(measures.motors[0].envelope == Approx((6 * 0.5 / 0.8 + 15) / 24));
  CHECK(measures.motors[0].heat ==
        Approx(std::sqrt((0.1 * std::pow(3 / 0.8, 2) + 0.3 * std::pow(4 * 0.5, 2) + 0.2 * std::pow(6 / 0.8, 2)) / 0.6) /
               5));
  CHECK(measures.distance == Approx(0.6 - 2 * 0.05));  // of a and c, which no joint connects
  CHECK(measures.margin == 1);                         // not requested
  measures.distance = std::numeric_limits<double>::infinity();
  addLimitMeasures(build(true), trajectory, {Measure::Distance}, {}, measures);
  CHECK(measures.distance == Approx(0.1 - 2 * 0.05).margin(1e-12));
  CHECK(getMeasure(Measure::Envelope, {0}, {measures, measures}) == measures.motors[0].envelope);
  // What the winding says of heat is the default of electrical energies.
  CHECK(makeDrives(model, {})[0].motor_constant == Approx(10 * 0.1 / std::sqrt(0.5)));
}

TEST_CASE("measures: the distance from dead points is the least of all motions, up to half a radian") {
  const Model model = loadRobot(std::string(BIELLE_SOURCE_DIR) + "/robots/fourbar").model;
  const VectorXd q = findClosedConfiguration(model).q;
  const Linkage linkage = makeLinkage(model, q, {"rocker_joint"});
  const RatioSweep sweep = sweepRatio(model, linkage, q);
  const auto measure = [&](double farthest) {  // of a motion that begins where the sweep does
    ShootingTrajectory trajectory;
    for (const RatioSample& sample : sweep.samples) {
      if (sample.s < 0 || sample.s > farthest || sample.dead != DeadPointKind::None) continue;
      VectorXd x = VectorXd::Zero(model.nq() + model.nv());
      x.head(model.nq()) = carryLinkage(model, linkage, sample, q);
      trajectory.xs.push_back(x);
    }
    MotionMeasures measures;
    addLimitMeasures(model, trajectory, {Measure::DeadPointDistance}, {}, measures);
    double least = kFarthestDeadPoint;
    for (const VectorXd& x : trajectory.xs)
      least = std::min(least, findDeadPoint(linkage, model, x.head(model.nq())).distance);
    CHECK(measures.dead_point_distance == Approx(least).epsilon(1e-9));
    return measures;
  };
  const MotionMeasures near = measure(100), far = measure(0);
  CHECK(near.dead_point_distance < 0.05);
  CHECK(getMeasure(Measure::DeadPointDistance, {}, {far, near, far}) == near.dead_point_distance);
  CHECK(MotionMeasures().dead_point_distance == kFarthestDeadPoint);
}

TEST_CASE("measures: drives by name") {
  const Model leg = makeFiveBarLeg();
  DriveTable table;
  table.motor_constant = 1.5;
  table.motor_constants = {{"motor_back", 2.5}};
  const std::vector<MotorConversion> drives = makeDrives(leg, table);
  REQUIRE(drives.size() == 2);
  CHECK(drives[leg.findMotor("motor_front")].motor_constant == 1.5);
  CHECK(drives[leg.findMotor("motor_back")].motor_constant == 2.5);
  table.motor_constants = {{"motor", 2.5}};
  CHECK_THROWS_WITH(makeDrives(leg, table), Contains("no such motor"));
  table.motor_constants = {{"motor_back", 0}};
  CHECK_THROWS_WITH(makeDrives(leg, table), Contains("not positive"));
  table = {};
  table.regeneration = 1.1;
  CHECK_THROWS_WITH(makeDrives(leg, table), Contains("0 .. 1"));
}

TEST_CASE("workspace: the annulus of a five-bar leg, point by point") {
  for (double lower : {0.2, 0.17}) {
    CAPTURE(lower);
    FiveBarLegParameters p;
    p.lower_length = lower;
    const Model leg = makeFiveBarLeg(p);
    const WorkspaceGrid grid = makeWorkspaceGrid(leg, makeBox(getDepth(p)));
    REQUIRE(grid.placements.size() == 23 * 23);
    const WorkspaceCoverage coverage = calcCoverage(leg, grid);
    const double inner = p.lower_length - p.upper_length, outer = p.lower_length + p.upper_length;
    int expected = 0;
    for (size_t i = 0; i < grid.placements.size(); ++i) {
      const double r = getFoot(grid, i).norm();
      const bool inside = r > inner && r < outer;
      CAPTURE(getFoot(grid, i).transpose(), r);
      REQUIRE(std::min(std::abs(r - inner), std::abs(r - outer)) > 1e-5);  // no point stands on the rim
      CHECK(static_cast<bool>(coverage.reached[i]) == inside);
      expected += inside;
    }
    CHECK(coverage.share == Approx(expected / 529.0));
    // And the grid is fine enough for the area.
    CHECK(coverage.share == Approx(M_PI * (outer * outer - inner * inner) / (0.7 * 0.7)).epsilon(0.06));
  }
}

TEST_CASE("workspace: a bound on the conditioning, by the leg's equations") {
  const FiveBarLegParameters p;
  const Model leg = makeFiveBarLeg(p);
  WorkspaceRegion region = makeBox(getDepth(p));
  region.max_conditioning = 1.5;
  const WorkspaceGrid grid = makeWorkspaceGrid(leg, region);
  const WorkspaceCoverage coverage = calcCoverage(leg, grid);
  int good = 0, bad = 0;
  for (size_t i = 0; i < grid.placements.size(); ++i) {
    const Vector2d foot = getFoot(grid, i);
    if (foot.norm() <= 0.1 || foot.norm() >= 0.3) continue;
    CAPTURE(foot.transpose());
    const double conditioning = calcConditioning(p, foot);
    if (std::abs(conditioning - 1.5) < 1e-6) continue;
    CHECK(static_cast<bool>(coverage.reached[i]) == (conditioning < 1.5));
    ++(conditioning < 1.5 ? good : bad);
  }
  CHECK(good > 50);
  CHECK(bad > 20);
}

TEST_CASE("workspace: joint ranges, axes and what is refused") {
  const Model leg = makeFiveBarLeg();
  WorkspaceRegion region;
  const WorkspaceGrid standard = makeWorkspaceGrid(leg, region);
  CHECK(standard.placements.size() == 81);
  CHECK(standard.held.head<3>().all());
  CHECK_FALSE(standard.held.tail<3>().any());  // of a point foot
  CHECK(calcCoverage(leg, standard).share > 0.9);

  const auto refuse = [&](const std::string& problem) {
    CHECK_THROWS_WITH(makeWorkspaceGrid(leg, region), Contains(problem));
    region = {};
  };
  region.foot = "hand";
  refuse("no such contact");
  region.base = "hand";
  refuse("no such link");
  region.axes[0] = makeRange(1, 0, 3);
  refuse("wrong order");
  region.axes[0] = region.axes[1] = region.axes[2] = makeRange(0, 1, 100);
  refuse("100000");

  // A foot that may not be turned: nowhere but where it stands.
  region.axes[0] = makeRange(-0.03, 0.03, 3);
  region.axes[4] = makeRange(0, 0, 1);
  const WorkspaceCoverage level = calcCoverage(leg, makeWorkspaceGrid(leg, region));
  CHECK(level.reached == std::vector<char>{0, 1, 0});
}

TEST_CASE("workspace: an objective, in a file") {
  const RobotDirectory directory;
  const std::string text = R"(generator: fivebar_leg
variables:
  - {name: lower, parameter: lower_length, bounds: [0.15, 0.25]}
objective:
  - {measure: workspace, region: {x: [-0.35, 0.35, 23], z: [-0.1368, 0.5632, 23]}}
)";
  const DesignSpec spec = readDesignSpec(directory.write("spec.yaml", text));
  const Parametrization robot = makeParametrization(spec);
  const DesignEvaluator evaluator(robot, {}, spec.objective);
  // Points inside the annulus of the design, the box staying where the start design has it.
  const auto countInside = [&](double lower) {
    const WorkspaceGrid grid = makeWorkspaceGrid(robot.startModel(), spec.objective[0].region);
    int count = 0;
    for (size_t i = 0; i < grid.placements.size(); ++i) {
      const double r = getFoot(grid, i).norm();
      count += r > lower - 0.1 && r < lower + 0.1;
    }
    return count;
  };
  CHECK(evaluator.start().terms[0] == Approx(529.0 / countInside(0.2)));
  const Evaluation longer = evaluator.evaluate(VectorXd::Constant(1, 0.23));
  CHECK(longer.terms[0] == Approx(529.0 / countInside(0.23)));
  CHECK(longer.value == Approx(static_cast<double>(countInside(0.2)) / countInside(0.23)));

  const auto refuse = [&](const std::string& from, const std::string& to, const std::string& problem) {
    const std::string path = directory.write("wrong.yaml", replaceOnce(text, from, to));
    CHECK_THROWS_WITH(readDesignSpec(path), Contains(problem));
  };
  refuse("x: [-0.35, 0.35, 23]", "x: [0.35, -0.35, 23]", "wrong order");
  refuse("x: [-0.35, 0.35, 23]", "x: [0.35]", "not a range");
  refuse("x: [-0.35, 0.35, 23]", "x: most", "not a number");
  refuse("region: {", "region: {max_conditioning: 0.5, ", "at least 1");
  refuse("workspace, region", "energy, region", "only a workspace");
  refuse("region: {", "motors: [motor_front], region: {", "does not depend on motors");
  CHECK_THROWS_WITH(DesignEvaluator(robot, {}, {{Measure::Energy, {}, 1, {}}}), Contains("motions"));
  EvaluationOptions kept;
  kept.mode = MotionMode::Kept;
  const DesignEvaluator without(robot, {}, spec.objective, kept);
  CHECK_THROWS_WITH(without.differentiate(robot.start()), Contains("workspace does not have"));
}

namespace {

// An arm of 2 kg that includes the motor of its elbow.
const char* const kArmUrdf = R"(<robot name="robot"><link name="world"/>
  <link name="arm"><inertial><origin xyz="0.1 0 0"/><mass value="2"/>
    <inertia ixx="0.01" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="hand"><inertial><origin xyz="0.1 0 0"/><mass value="0.5"/>
    <inertia ixx="0.001" iyy="0.002" izz="0.002" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="shoulder" type="continuous"><parent link="world"/><child link="arm"/><axis xyz="0 1 0"/></joint>
  <joint name="elbow" type="continuous"><origin xyz="0.3 0 0.02"/><parent link="arm"/><child link="hand"/>
    <axis xyz="0 1 0"/></joint></robot>)";

DesignSpec readArmSpec(const RobotDirectory& directory, const std::string& elbow) {
  directory.writeRobot(kArmUrdf, "base: fixed\nmotors:\n  elbow: " + elbow + "\n");
  return readDesignSpec(directory.write("spec.yaml", "robot: " + directory.path() + R"(
variables:
  - {name: motor, motor: elbow, choices: [ak80-9, ak10-9]}
objective: [{measure: mass}]
)"));
}

}  // namespace

TEST_CASE("design: a given robot has other motors with their masses") {
  const RobotDirectory directory;
  const Parametrization robot = makeParametrization(readArmSpec(directory, "{type: ak80-9}"));
  CHECK(robot.start()[0] == 0);
  const Model small = robot.make(VectorXd::Zero(1)), large = robot.make(VectorXd::Ones(1));
  CHECK(small.mass() == Approx(2.5).epsilon(1e-12));
  CHECK(large.mass() - small.mass() == Approx(0.94 - 0.49).epsilon(1e-12));
  CHECK(large.motors()[0].drive.type == "ak10-9");
  // By hand, about the joint of the elbow: the difference adds nothing there, and its weight moves the centre of mass.
  const Inertia &before = small.bodies()[1].inertia, &after = large.bodies()[1].inertia;
  const Vector3d elbow(0.3, 0, 0.02);
  CHECK((after.mass * after.com - before.mass * before.com - 0.45 * elbow).norm() < 1e-12);
  const SE3 to_elbow(Matrix3d::Identity(), -elbow);
  const Matrix6d difference = after.transformed(to_elbow).toMatrix() - before.transformed(to_elbow).toMatrix();
  CHECK(difference.bottomRightCorner<3, 3>().norm() < 1e-12);
  const SE3 beside(Matrix3d::Identity(), -elbow + Vector3d(0.01, 0, 0));  // would the check see another place?
  CHECK(
      (after.transformed(beside).toMatrix() - before.transformed(beside).toMatrix()).bottomRightCorner<3, 3>().norm() >
      1e-5);
  // There and back.
  CHECK(robot.make(VectorXd::Zero(1)).bodies()[1].inertia.mass == before.mass);

  CHECK_THROWS_WITH(makeParametrization(readArmSpec(directory, "{effort: 10}")),
                    Contains("the mass of motor 'elbow', which its link includes, is not known"));
  CHECK_THROWS_WITH(makeParametrization(readArmSpec(directory, "{effort: 10, mass: 30}")),
                    Contains("link 'arm': it cannot include the mass of the motor"));
}

TEST_CASE("design: corners of what a motor can give lie on its limits") {
  Motor motor;
  motor.effort_limit = 50, motor.velocity_limit = 30;
  motor.drive.ratio = 9, motor.drive.torque_constant = 0.16, motor.drive.resistance = 0.25, motor.drive.voltage = 48;
  const auto corners = listEnvelopeCorners(motor, 100, 100);
  REQUIRE(corners.size() == 6);
  double area = 0;
  for (size_t i = 0; i < corners.size(); ++i) {
    const auto& [w, u] = corners[i];
    const auto& [next_w, next_u] = corners[(i + 1) % corners.size()];
    CAPTURE(w, u);
    area += (w * next_u - next_w * u) / 2;
    const double volts = motor.voltsPerEffort() * u + motor.voltsPerSpeed() * w;
    const auto shares = {std::abs(u) / 50, std::abs(w) / 30, std::abs(volts) / 48};
    CHECK(std::max(shares) == Approx(1).epsilon(1e-12));
    CHECK(std::count_if(shares.begin(), shares.end(), [](double share) { return share > 1 - 1e-12; }) == 2);
    CHECK(motor.clampEffort(u, w) == Approx(u).epsilon(1e-12));
    CHECK(motor.clampEffort(1.01 * u, 1.01 * w) != Approx(1.01 * u).epsilon(1e-12));
  }
  CHECK(area > 0);
  CHECK(area < 4 * 50 * 30);  // two corners are cut off
  // Without a winding, a box; a side without limit is as far away as is asked for.
  motor.drive = {}, motor.velocity_limit = HUGE_VAL;
  CHECK(listEnvelopeCorners(motor, 100, 100) ==
        std::vector<std::pair<double, double>>{{100, -50}, {100, 50}, {-100, 50}, {-100, -50}});
}

namespace {

// A four-bar at the knee (robots/parts/knee/four_bar.yaml) is dead where crank and rod are in line, l +- c from the motor to the end
// of the arm, which is at the angle psi from the thigh, cos psi = sin(knee - middle); at the middle the ratio is arm / crank.
struct FourBarKnee {
  double thigh = 0.22, arm = 0.05, middle = 1.2;

  Model make(double crank) const {
    return makeLegBiped({{"knee", "four_bar"},
                         {"ankle", "rsu"},
                         {"thigh_length", thigh},
                         {"knee_crank", crank},
                         {"knee_arm", arm},
                         {"knee_middle", middle}});
  }
  double calcKnee(double reach) const {
    return middle + std::asin((thigh * thigh + arm * arm - reach * reach) / (2 * thigh * arm));
  }
  // Crank and rod stretched: the end of the range at its lower side.
  double calcLower(double crank) const { return calcKnee(std::hypot(thigh, crank - arm) + crank); }
};

}  // namespace

TEST_CASE("designs tell how far joints reach through their linkages, before and after") {
  const FourBarKnee fourbar;
  const double arm = fourbar.arm;
  const auto make = [&](double crank) { return fourbar.make(crank); };
  const auto find = [](const std::vector<JointReach>& reaches, const std::string& joint) {
    const auto it =
        std::find_if(reaches.begin(), reaches.end(), [&](const auto& reach) { return reach.joint == joint; });
    REQUIRE(it != reaches.end());
    return *it;
  };
  for (const double crank : {0.035, 0.045}) {
    CAPTURE(crank);
    const Model model = make(crank);
    const std::vector<JointReach> reaches = listReaches(model);
    const JointReach knee = find(reaches, "knee_left");
    const int dof = model.joints()[static_cast<size_t>(model.findJoint("knee_left"))].idx_v;
    const double rod = std::hypot(fourbar.thigh, crank - arm);
    CHECK(knee.lower == Approx(std::max(model.lowerLimits()[dof], fourbar.calcLower(crank))).margin(1e-6));
    CHECK(knee.upper == Approx(std::min(model.upperLimits()[dof], fourbar.calcKnee(rod - crank))).margin(1e-6));
    REQUIRE(knee.ratio.has_value());
    CHECK(knee.ratio->first <= arm / crank);
    CHECK(knee.ratio->second >= arm / crank);
    CHECK_FALSE(find(reaches, "ankley_left").ratio.has_value());  // two motors
  }
  CHECK(listReachChanges(make(0.04), make(0.04)).empty());
  std::vector<std::string> changed;
  for (const ReachChange& change : listReachChanges(make(0.035), make(0.045))) {
    changed.push_back(change.before.joint);
    CHECK(change.before.upper - change.before.lower < change.after.upper - change.after.lower);
  }
  CHECK(changed == std::vector<std::string>{"knee_left", "knee_right"});
  CHECK(formatRange({"knee", -1e-12, 2.1, {}}) == "0 .. 2.1");
}

TEST_CASE("measures: the share of its angles that a joint reaches, and its ratios there") {
  const FourBarKnee fourbar;
  const double crank = 0.035, lower = fourbar.calcLower(crank);  // it does not reach 0
  REQUIRE(lower > 0.1);
  const Model model = fourbar.make(crank);
  JointWays ways(model);
  const RangeCoverage all = ways.calcCoverage({"knee_right", 0, 2});
  CHECK(all.share == Approx((2 - lower) / 2).epsilon(1e-7));
  CHECK(all.largest == std::numeric_limits<double>::infinity());  // at the dead point where it ends
  const RangeCoverage none = ways.calcCoverage({"knee_right", -0.5, lower - 1e-3});
  CHECK((none.share == 0 && none.least == 0 && none.largest == all.largest));
  // Next to the middle, and anywhere against a sweep of small steps.
  const RangeCoverage next = ways.calcCoverage({"knee_right", fourbar.middle - 1e-3, fourbar.middle + 1e-3});
  CHECK(next.share == Approx(1));
  CHECK(next.least == Approx(fourbar.arm / crank).epsilon(1e-3));
  CHECK(next.largest == Approx(fourbar.arm / crank).epsilon(1e-3));
  const VectorXd q = findClosedConfiguration(model).q;
  SweepOptions fine;
  fine.step = 1e-3;
  const RatioSweep sweep = sweepRatio(model, makeLinkage(model, q, {"knee_right"}), q, 0, fine);
  for (const double from : {lower + 0.02, 0.73, 1.401})
    for (const double width : {0.005, 0.3}) {
      CAPTURE(from, width);
      const RangeCoverage found = ways.calcCoverage({"knee_right", from, from + width});
      double least = HUGE_VAL, largest = 0;
      for (const RatioSample& sample : sweep.samples) {
        if (sample.branch != 0 || sample.joints[0] < from || sample.joints[0] > from + width) continue;
        least = std::min(least, std::abs(sample.ratio.R(0, 0)));
        largest = std::max(largest, std::abs(sample.ratio.R(0, 0)));
      }
      CHECK(found.share == Approx(1));
      CHECK(found.least == Approx(least).epsilon(0.01));
      CHECK(found.largest == Approx(largest).epsilon(0.01));
    }
  // A joint with a motor of its own and without limits goes round and round, with the ratio 1.
  const RangeCoverage direct = ways.calcCoverage({"hipy_left", 1, 8});
  CHECK((direct.share == 1 && direct.least == 1 && direct.largest == 1));

  // Which joints: all of linkages, those of one motor, or by name; the angles are those of the start.
  CHECK(findRanges(model, {}, false, "").size() == 6);  // knees, and the two joints of each ankle
  const std::vector<JointRange> knees = findRanges(model, {}, true, "");
  REQUIRE(knees.size() == 2);
  CHECK(knees[0].lower == Approx(lower).epsilon(1e-7));
  CHECK(findRanges(model, {{"*"}, {}}, true, "").size() > 2);
  CHECK_THROWS_WITH(findRanges(model, {{"ankley_left"}, {}}, true, "constraints"), Contains("several motors"));
  CHECK_THROWS_WITH(findRanges(model, {{"crank_knee_left"}, {}}, false, "constraints"),
                    Contains("motors drive no joint"));
}

TEST_CASE("measures: a search keeps the range of a joint, and ends where it would be lost") {
  const RobotDirectory directory;
  const FourBarKnee fourbar;
  const std::string text = R"(generator: leg_biped
set: {knee: four_bar, ankle: rsu, thigh_length: 0.22, knee_crank: 0.049, knee_arm: 0.05, knee_middle: 1.2}
variables:
  - {name: crank, parameter: knee_crank, bounds: [0.03, 0.05]}
objective:
  - {measure: least_ratio, joints: "knee*", angles: [1, 1.4]}
constraints:
  - {measure: range, joints: ["knee*"], angles: [0.1, 2]}
  - {measure: largest_ratio, joints: ["knee*"], angles: [0.4, 2], at_most: 50}
search: {searches: 1, stages: [{algorithm: sbplx, evaluations: 60, tolerance: 1e-6}]}
)";
  const auto run = [&](const std::string& content, const std::string& name) {
    const DesignSpec spec = readDesignSpec(directory.write(name + ".yaml", content));
    const DesignEvaluator evaluator = makeEvaluator(spec);
    DesignRunOptions options;
    options.directory = directory.path() + "/" + name;
    return std::pair{evaluator.start(), runDesign(evaluator, spec, options)};
  };
  const auto [before, kept] = run(text, "kept");
  // The range is kept up to a thousandth of it, at the crank whose dead point is there.
  double shortest = 0.03, longest = 0.05;
  while (longest - shortest > 1e-9) {
    const double crank = (shortest + longest) / 2;
    (fourbar.calcLower(crank) > 0.1 + kConstraintSlack * 1.9 ? shortest : longest) = crank;
  }
  CHECK(before.constraints[0] == Approx(1));
  CHECK(kept.evaluation.status == DesignStatus::Feasible);
  CHECK(kept.best[0] == Approx(longest).epsilon(1e-4));
  CHECK(kept.evaluation.constraints[0] == Approx(1 - kConstraintSlack).epsilon(1e-5));
  CHECK(kept.evaluation.terms[0] < 0.95 * before.terms[0]);  // the inverse of the ratio
  // Without the constraint it is lost.
  const size_t first = text.find("  - {measure: range"), second = text.find("  - {measure: largest_ratio");
  const auto [unused, lost] =
      run(replaceOnce(std::string(text).erase(first, second - first), "evaluations: 60", "evaluations: 20"), "lost");
  CHECK(fourbar.calcLower(lost.best[0]) > 0.2);
  // Designs that lose it say so.
  const DesignEvaluator evaluator = makeEvaluator(readDesignSpec(directory.write("spec.yaml", text)));
  const Evaluation loses = evaluator.evaluate(VectorXd::Constant(1, 0.031));
  CHECK(loses.status == DesignStatus::Violated);
  CHECK_THAT(loses.message, Contains("range is 0.") && Contains("< 1"));

  const auto check = [&](const std::string& from, const std::string& to, const std::string& problem) {
    std::string changed = text;
    changed.replace(changed.find(from), from.size(), to);
    const std::string path = directory.write("spec.yaml", changed);
    CAPTURE(to);
    CHECK_THROWS_WITH(makeEvaluator(readDesignSpec(path)), Contains(problem));
  };
  check("angles: [0.1, 2]", "angles: [2, 0.1]", "wrong order");
  check("angles: [0.1, 2]", "angles: [2]", "it is not a range");
  check("angles: [0.1, 2]", "at_least: 1.2", "at most 1");
  check("angles: [0.1, 2]", "at_most: 1", "give `at_least`");
  check("angles: [0.1, 2]", "motors: [motor_knee_left]", "does not depend on motors");
  check("\"knee*\"], angles: [0.1, 2]", "elbow]", "motors drive no joint 'elbow'");
  check("measure: range", "measure: margin, at_least: 0.2", "only ranges and ratios are about joints");
  check("measure: least_ratio, joints", "measure: mass, joints", "only ranges and ratios are about joints");
  check("sbplx", "slsqp", "the constraint on range does not have");
}
