// The robots of the project, against closed forms and against the published files (skipped if those are not available).
#include <Eigen/QR>
#include <catch2/catch.hpp>
#include <filesystem>
#include <map>

#include "bielle/robots/robot_loader.h"
#include "model/joint.h"
#include "own_robots.h"
#include "published_robots.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

std::vector<SE3> calcPlacements(const Model& model, const VectorXd& q) {
  std::vector<SE3> X(model.numBodies());
  for (int i = 1; i < model.numBodies(); ++i) {
    const Joint& joint = model.joints()[i];
    X[i] = X[joint.parent] * joint.X_PJ * calcJointPlacement(joint, q.segment(joint.idx_q, joint.nq));
  }
  return X;
}

SE3 calcFrame(const Model& model, const VectorXd& q, const std::string& name) {
  REQUIRE(model.findFrame(name) >= 0);
  const Frame& frame = model.frames()[model.findFrame(name)];
  return calcPlacements(model, q)[frame.body] * frame.X_BF;
}

double& getAngle(const Model& model, VectorXd& q, const std::string& joint) {
  REQUIRE(model.findJoint(joint) >= 0);
  return q[model.joints()[model.findJoint(joint)].idx_q];
}

// Residuals of the closures: all six rows, or for a hinge the distance and the two tilts.
VectorXd calcResidual(const Model& model, const VectorXd& q) {
  const std::vector<SE3> X = calcPlacements(model, q);
  VectorXd residual = VectorXd::Zero(6 * model.closures().size());
  int row = 0;
  for (const Closure& c : model.closures()) {
    const SE3 X_12 = (X[c.body1] * c.X_B1).inverseTimes(X[c.body2] * c.X_B2);
    if (c.kind == ClosureKind::Weld6D) {
      residual.segment<6>(row) = log6(X_12);
    } else {
      residual.segment<3>(row) = X_12.p;
      residual.segment<3>(row + 3) = c.axis.cross(X_12.R * c.axis);
    }
    row += 6;
  }
  return residual;
}

// Gauss-Newton with central differences on the joints that are not held.
VectorXd close(const Model& model, VectorXd q, const std::vector<std::string>& held) {
  std::vector<bool> fixed(model.nv(), false);
  for (const std::string& name : held) {
    const Joint& joint = model.joints()[model.findJoint(name)];
    for (int k = 0; k < joint.nv; ++k) fixed[joint.idx_v + k] = true;
  }
  const double h = 1e-6;
  for (int iteration = 0; iteration < 30 && calcResidual(model, q).norm() > 1e-13; ++iteration) {
    const VectorXd r = calcResidual(model, q);
    MatrixXd J = MatrixXd::Zero(r.size(), model.nv());
    for (int k = 0; k < model.nv(); ++k) {
      const VectorXd d = h * VectorXd::Unit(model.nv(), k);
      if (!fixed[k])
        J.col(k) = (calcResidual(model, model.integrate(q, d)) - calcResidual(model, model.integrate(q, -d))) / (2 * h);
    }
    Eigen::CompleteOrthogonalDecomposition<MatrixXd> solver;
    solver.setThreshold(1e-7);
    const VectorXd step = -solver.compute(J).solve(r);
    q = model.integrate(q, step * std::min(1.0, 0.5 / step.cwiseAbs().maxCoeff()));
  }
  REQUIRE(calcResidual(model, q).norm() < 1e-9);
  return q;
}

VectorXd makeReference(const Model& model, int index) {
  VectorXd q = model.makeNeutral();
  for (const auto& [name, values] : model.references()[index].joints) {
    const Joint& joint = model.joints()[model.findJoint(name)];
    q.segment(joint.idx_q, joint.nq) = Eigen::Map<const VectorXd>(values.data(), joint.nq);
  }
  return q;
}

// Total inertia at q, in the frame of the first body.
Inertia calcTotalInertia(const Model& model, const VectorXd& q) {
  const std::vector<SE3> X = calcPlacements(model, q);
  Inertia total;
  for (int i = 1; i < model.numBodies(); ++i)
    total = total + model.bodies()[i].inertia.transformed(X[1].inverse() * X[i]);
  return total;
}

const std::vector<std::string> kBipettoMotors = {
    "hipz_left",  "hipy_left",  "hipx_left",  "motor_knee_left",  "motor_ankle1_left",  "motor_ankle2_left",
    "hipz_right", "hipy_right", "hipx_right", "motor_knee_right", "motor_ankle1_right", "motor_ankle2_right"};

std::vector<std::string> getMotorNames(const Model& model) {
  std::vector<std::string> names;
  for (const Motor& motor : model.motors()) names.push_back(motor.name);
  return names;
}

// Four clusters: a knee of 6 rows and an ankle of 12 per leg.
void checkClusters(const Model& model, const std::map<int, int>& dofs_of_rows) {
  REQUIRE(model.clusters().size() == 4);
  for (const LoopCluster& cluster : model.clusters()) {
    REQUIRE(dofs_of_rows.count(cluster.rows) == 1);
    CHECK(static_cast<int>(cluster.dofs.size()) == dofs_of_rows.at(cluster.rows));
  }
}

const std::vector<std::string> kSerial = {"hipz_right",   "hipx_right",   "hipy_right",  "knee_right",
                                          "ankley_right", "anklex_right", "hipz_left",   "hipx_left",
                                          "hipy_left",    "knee_left",    "ankley_left", "anklex_left"};

std::vector<std::string> getHeld() {
  std::vector<std::string> held = kSerial;
  held.push_back("root_joint");
  return held;
}

}  // namespace

TEST_CASE("Bipetto: sizes, motors, clusters, mass") {
  const LoadedRobot robot = loadOwn("bipetto");
  const Model& model = robot.model;
  CHECK(robot.warnings.empty());
  CHECK(model.name() == "bipetto");
  CHECK(model.nv() == 54);
  CHECK(model.nq() == 61);
  CHECK(getMotorNames(model) == kBipettoMotors);
  CHECK(model.closures().size() == 6);
  CHECK(model.closures()[0].name == "closure_knee_left");
  CHECK(model.closures()[2].name == "closure_ankle1_right");
  checkClusters(model, {{6, 7}, {12, 14}});
  CHECK(std::abs(model.mass() - 25.676) < 5e-4);
  CHECK(model.armature().sum() == Approx(12e-3));
  CHECK(model.serialJoints().size() == 12);
  for (const Motor& motor : model.motors()) CHECK(std::isinf(motor.effort_limit));
  for (const Body& body : model.bodies()) CHECK((body.name == "world" || body.inertia.mass > 0.01));
}

TEST_CASE("Bipetto at half-sitting: soles flat, each under its own leg, loops closed within the ranges") {
  const Model model = loadOwn("bipetto").model;
  REQUIRE(model.references().size() == 1);
  const VectorXd q = close(model, makeReference(model, 0), getHeld());
  const SE3 torso = calcFrame(model, q, "torso");
  for (const auto& [name, y] : {std::pair("foot_left", 0.125), std::pair("foot_right", -0.125)}) {
    const ContactFrame& foot = model.contacts()[model.findContact(name)];
    const SE3 X = calcPlacements(model, q)[foot.body] * foot.X_BF;
    CAPTURE(name);
    CHECK((X.R - Matrix3d::Identity()).cwiseAbs().maxCoeff() < 1e-4);  // z up, x forward: the angles have four digits
    CHECK((X.p - Vector3d(0, y, torso.p.z() - 0.575)).cwiseAbs().maxCoeff() < 2e-4);
    CHECK((X.p - calcFrame(model, q, name).p).norm() == 0);
    CHECK(foot.half_length == 0.05);
    CHECK(foot.half_width == 0.05);
    const std::string leg = std::string(name).substr(5);
    const std::vector<int>& support = model.supportDofs(foot.body);
    CHECK(std::count(support.begin(), support.end(), model.joints()[model.findJoint("anklex_" + leg)].idx_v) == 1);
  }
  for (const Joint& joint : model.joints()) {
    if (joint.nv != 1) continue;
    CAPTURE(joint.name);
    CHECK(q[joint.idx_q] > model.lowerLimits()[joint.idx_v]);
    CHECK(q[joint.idx_q] < model.upperLimits()[joint.idx_v]);
  }
}

TEST_CASE("Bipetto is the published robot up to rounding: same joints, same loops, same inertia") {
  const std::string directory = findPublished("battobot_6d");
  if (directory.empty()) return;
  const Model published = loadRobot(directory).model, own = loadOwn("bipetto").model;
  REQUIRE(published.numBodies() == own.numBodies());
  for (int i = 1; i < own.numBodies(); ++i) {
    const Joint &a = own.joints()[i], &b = published.joints()[i];
    CAPTURE(a.name);
    CHECK(a.name == b.name);
    CHECK(a.kind == b.kind);
    CHECK(a.parent == b.parent);
    CHECK((a.axis - b.axis).norm() + (a.axis2 - b.axis2).norm() == 0);
    CHECK((a.X_PJ.p - b.X_PJ.p).cwiseAbs().maxCoeff() < 5.1e-7);
    CHECK((a.X_PJ.R - b.X_PJ.R).cwiseAbs().maxCoeff() < 1e-6);
  }
  CHECK(getMotorNames(own) == getMotorNames(published));
  for (const VectorXd& start : {own.makeNeutral(), makeReference(own, 0)}) {
    const VectorXd q = close(own, start, getHeld()), q_published = close(published, start, getHeld());
    CHECK((q - q_published).cwiseAbs().maxCoeff() < 3e-5);
    const Inertia a = calcTotalInertia(own, q), b = calcTotalInertia(published, q_published);
    CHECK(a.mass == Approx(b.mass).epsilon(1e-6));
    CHECK((a.com - b.com).norm() < 2e-6);
    CHECK((a.I_com - b.I_com).cwiseAbs().maxCoeff() < 1e-5 * b.I_com.cwiseAbs().maxCoeff());
  }
  // The published sole frames are named after the other leg.
  const VectorXd q = own.makeNeutral();
  CHECK((calcFrame(own, q, "foot_right").p - calcFrame(published, q, "foot_left").p).norm() < 1e-5);
}

TEST_CASE("the four published files load unchanged") {
  std::string directory = findPublished("battobot_6d");
  if (directory.empty()) return;
  const LoadedRobot battobot = loadRobot(directory);
  REQUIRE(battobot.warnings.size() == 1);  // its meshes are elsewhere
  CHECK_THAT(battobot.warnings[0], Catch::Contains("174 mesh(es) cannot be read"));
  CHECK(battobot.model.nv() == 54);
  CHECK(getMotorNames(battobot.model) == kBipettoMotors);
  CHECK(battobot.model.mass() == Approx(25.67604671).epsilon(1e-9));
  CHECK(battobot.model.findClosure("closedloop_knee_left") == 0);
  CHECK(battobot.model.findClosure("closedloop_ankle_right_1") == 2);
  checkClusters(battobot.model, {{6, 7}, {12, 14}});
  CHECK(battobot.model.motors()[0].effort_limit == 1);
  CHECK(battobot.model.motors()[0].velocity_limit == 20);
  CHECK(loadRobot(directory, {BaseKind::Fixed}).model.nv() == 48);

  directory = findPublished("digit_like_2legs");
  const Model digit = loadRobot(directory).model;
  CHECK(digit.nv() == 54);
  CHECK(digit.nu() == 12);
  checkClusters(digit, {{6, 8}, {12, 14}});
  CHECK(digit.joints()[digit.findJoint("spherical_free_knee")].kind == JointKind::Universal);

  directory = findPublished("robot_delta");
  const Model delta = loadRobot(directory, {BaseKind::Fixed}).model;
  CHECK(delta.nv() == 14);
  CHECK(delta.nu() == 2);
  CHECK(delta.clusters().size() == 1);

  directory = findPublished("5bar_linkage");
  const LoadedRobot linkage = loadRobot(directory);
  CHECK(linkage.warnings.size() == 3);  // two spheres of 654 t, and no meshes
  // Its closure names two joints, each with a leaf link.
  CHECK(linkage.model.closures()[0].body1 == linkage.model.findJoint("closedloop1_A"));
}

TEST_CASE("the four-bar linkage obeys Freudenstein's equation all the way round") {
  const LoadedRobot robot = loadOwn("fourbar");
  const Model& model = robot.model;
  CHECK(robot.warnings.empty());
  CHECK(model.nv() == 4);
  CHECK(getMotorNames(model) == std::vector<std::string>{"crank_joint"});
  const double a = 0.15, b = 0.35, c = 0.30, d = 0.40;
  const double K1 = d / a, K2 = d / c, K3 = (a * a - b * b + c * c + d * d) / (2 * a * c);
  VectorXd q = makeReference(model, 0);
  CHECK(calcResidual(model, q).norm() < 3e-6);
  for (int i = 0; i < 24; ++i) {
    q = close(model, q, {"crank_joint"});
    const double crank = getAngle(model, q, "crank_joint"), rocker = getAngle(model, q, "rocker_joint");
    CHECK(std::abs(K1 * std::cos(rocker) - K2 * std::cos(crank) + K3 - std::cos(crank - rocker)) < 1e-8);
    CHECK(std::sin(rocker) > 0);  // one branch
    getAngle(model, q, "crank_joint") += 2 * M_PI / 24;
  }
  // Slender rods of 2 kg/m.
  CHECK(model.mass() == Approx(2 * (a + b + c)));
  for (int i = 1; i < model.numBodies(); ++i) {
    const Inertia& rod = model.bodies()[i].inertia;
    const double length = rod.mass / 2;
    CHECK((rod.com - Vector3d(length / 2, 0, 0)).norm() < 1e-12);
    CHECK(rod.I_com(2, 2) == Approx(rod.mass * length * length / 12));
  }
}

TEST_CASE("the pin of the five-bar linkage is the intersection of two circles") {
  const LoadedRobot robot = loadOwn("fivebar");
  const Model& model = robot.model;
  CHECK(robot.warnings.empty());
  CHECK(model.nv() == 4);
  CHECK(model.nu() == 2);
  CHECK(model.numClosureRows() == 5);
  const double e = 0.1, l1 = 0.2, l2 = 0.25;
  const VectorXd home = makeReference(model, 0);
  CHECK(calcResidual(model, home).norm() < 3e-6);
  CHECK((calcFrame(model, home, "tip_left").p - Vector3d(0, 0, -0.35)).norm() < 1e-6);
  for (double left : {-0.3, 0.0, 0.3})
    for (double right : {-0.3, 0.1, 0.3}) {
      VectorXd q = home;
      getAngle(model, q, "shoulder_left") += left;
      getAngle(model, q, "shoulder_right") += right;
      const auto elbow = [&](const std::string& side, double x) {
        const double angle = getAngle(model, q, "shoulder_" + side);
        return Eigen::Vector2d(x + l1 * std::cos(angle), l1 * std::sin(angle));
      };
      const Eigen::Vector2d E1 = elbow("left", -e), E2 = elbow("right", e), w = E2 - E1;
      const Eigen::Vector2d P =
          (E1 + E2) / 2 + std::sqrt(l2 * l2 / w.squaredNorm() - 0.25) * Eigen::Vector2d(w.y(), -w.x());
      q = close(model, q, {"shoulder_left", "shoulder_right"});
      CAPTURE(left, right);
      CHECK((calcFrame(model, q, "tip_right").p - Vector3d(P.x(), 0, P.y())).norm() < 1e-8);
    }
  CHECK(model.mass() == Approx(4 * (l1 + l2)));
}
