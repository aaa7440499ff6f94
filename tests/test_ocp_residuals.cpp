// Oracles: central differences in tangent space (fourth order), time derivatives, exponentials of what the residuals
// take the logarithm of, a force applied at a known point. Every derivative test also sees a poisoned entry.
#include <memory>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/ground.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/rnea.h"
#include "bielle/ocp/cost.h"
#include "bielle/robots/robot_loader.h"
#include "change_model.h"
#include "check_residual.h"
#include "math/so3.h"
#include "published_robots.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

struct NamedResidual {
  std::string name;
  std::shared_ptr<const Residual> residual;
};

// One of every kind. Two contacts are in force; `dofs` have one coordinate each.
std::vector<NamedResidual> makeResiduals(std::mt19937& rng, const Model& model, const ConstraintSet& set,
                                         const BodyFrame& a, const BodyFrame& b, const std::vector<int>& dofs,
                                         const VectorXd& q_closed) {
  std::vector<NamedResidual> out;
  const auto add = [&out](const std::string& name, std::shared_ptr<const Residual> residual) {
    out.push_back({name, std::move(residual)});
  };
  add("com position", makeComPosition(randomVector(rng, 3)));
  add("com velocity", makeComVelocity(randomVector(rng, 3)));
  add("frame placement", makeFramePlacement(a, randomPlacement(rng)));
  add("frame translation", makeFrameTranslation(a, randomVector(rng, 3)));
  add("frame rotation", makeFrameRotation(a, randomPlacement(rng).R));
  add("frame velocity", makeFrameVelocity(a, randomVector(rng, 6)));
  Ground ground;  // with an inclined step whose ramp reaches under all of the robot
  ground.height = -0.2;
  ground.steps = {{Vector3d(0.1, -0.2, 0.3), 0.2, 0.3, 0.5, 0.2, -0.3}};
  add("sole clearance", makeSoleClearance(a, 0.1, 0.05, ground, 3));
  add("point clearance", makeSoleClearance(b, 0, 0, ground, 3));
  const auto random = [&rng] { return Vector3d(randomVector(rng, 3, 0.2)); };
  add("distance of capsules",
      makeShapeDistance(makeCapsule(a.body, random(), random(), 0.05), makeCapsule(b.body, random(), random(), 0.02)));
  for (int c = set.num_loops; c < static_cast<int>(set.closures.size()); ++c) {
    const int rows = countForces(set, c);
    add("contact force", makeContactForce(set, c, randomVector(rng, rows, 10)));
    add("contact force in the world", makeContactForce(set, c, randomVector(rng, rows, 10), ForceAxes::World));
    add("wrench cone", makeWrenchCone(set, c, 0.1, 0.04, 0.6));
    ConstraintSet aslant = set;
    aslant.closures[c].X_B2 = randomPlacement(rng);
    add("contact force on the ground", makeContactForce(aslant, c, randomVector(rng, rows, 10), ForceAxes::Ground));
    add("wrench cone on the ground", makeWrenchCone(aslant, c, 0.1, 0.04, 0.6, ForceAxes::Ground));
    if (rows != 6) continue;
    add("centre of pressure", makeCenterOfPressure(set, c));
    add("centre of pressure in the world", makeCenterOfPressure(set, c, ForceAxes::World));
    add("centre of pressure on the ground", makeCenterOfPressure(aslant, c, ForceAxes::Ground));
  }
  for (const Linkage& linkage : listLinkages(model, q_closed))
    add("transmission of " + linkage.output, makeTransmission(linkage, 6));
  add("joint position", makeJointPosition(model, dofs));
  add("joint velocity", makeJointVelocity(dofs));
  if (model.nu() > 0) add("electrical power", makeElectricalPower(randomVector(rng, model.nu()).cwiseAbs()));
  if (model.nu() > 1) add("motor power", makeMotorPower(model, {model.nu() - 1, 0}));
  return out;
}

VectorXd makeForces(std::mt19937& rng, const ConstraintSet& set) {
  VectorXd lambda = randomVector(rng, set.rows, 20);
  for (size_t c = set.num_loops; c < set.closures.size(); ++c) lambda[set.offsets[c] + 2] = 50;
  return lambda;
}

}  // namespace

TEST_CASE("every residual against differences, on mechanisms of every joint kind") {
  std::mt19937 rng(11);
  for (JointKind kind : kJointKinds) {
    const Mechanism mechanism = makeRandomMechanism(rng, kind, ClosureKind::Ball3D, MechanismBase::FreeFlyer);
    const Model& model = mechanism.model;
    const ConstraintSet set = makeConstraintSet(model, {{0, {}, 0, 0}, {1, {}, 0, 0}});
    const std::vector<int> dofs = {model.joints()[model.findJoint("joint_a1")].idx_v,
                                   model.joints()[model.findJoint("joint_b2")].idx_v};
    const BodyFrame a{model.frames()[model.findFrame("a2k")].body, randomPlacement(rng)};
    const BodyFrame b{model.frames()[model.findFrame("b1k")].body, randomPlacement(rng)};
    const VectorXd q = model.integrate(mechanism.q_closed, randomVector(rng, model.nv(), 0.1));
    const VectorXd v = randomVector(rng, model.nv(), 1), lambda = makeForces(rng, set);
    for (const NamedResidual& entry : makeResiduals(rng, model, set, a, b, dofs, mechanism.q_closed)) {
      CAPTURE(getName(kind), entry.name);
      checkResidual(model, set, *entry.residual, q, v, lambda);
    }
  }
}

TEST_CASE("forces of edges against differences, and the cone of a sole that has shrunk to one") {
  std::mt19937 rng(15);
  const Mechanism mechanism =
      makeRandomMechanism(rng, JointKind::Spherical, ClosureKind::Ball3D, MechanismBase::FreeFlyer);
  ModelParts parts = takeParts(mechanism.model);
  for (ContactFrame& contact : parts.contacts)
    contact = {contact.name, contact.body, contact.X_BF, ContactKind::Edge5D, 0.1, 0};
  const Model model = ModelBuilder::restore(parts);
  const ConstraintSet set =
      makeConstraintSet(model, {{0, randomPlacement(rng), 0, 0}, {1, randomPlacement(rng), 0, 0}});
  REQUIRE(getRows(set.closures.back().kind) == 5);
  const VectorXd q = mechanism.q_closed, v = randomVector(rng, model.nv()), lambda = makeForces(rng, set);
  const int c = set.num_loops;
  for (ForceAxes axes : {ForceAxes::Contact, ForceAxes::World, ForceAxes::Ground}) {
    checkResidual(model, set, *makeContactForce(set, c, randomVector(rng, 6, 10), axes), q, v, lambda);
    checkResidual(model, set, *makeWrenchCone(set, c, 0.1, 0, 0.6, axes), q, v, lambda);
  }
  // The same wrench on a sole without width: each of its rows is one of the edge's.
  parts.contacts[0].kind = ContactKind::Surface6D;
  const Model sole = ModelBuilder::restore(parts);
  const ConstraintSet of_sole = makeConstraintSet(sole, {{0, set.closures[c].X_B2, 0, 0}});
  TestNode edge_node(model, set), sole_node(sole, of_sole);
  VectorXd wrench = VectorXd::Zero(of_sole.rows);
  wrench.tail<6>() = expandRows(set.closures[c], lambda.segment(set.offsets[c], 5));
  const VectorXd edge = edge_node.calc(*makeWrenchCone(set, c, 0.1, 0, 0.6), q, v, lambda),
                 all = sole_node.calc(*makeWrenchCone(of_sole, c, 0.1, 0, 0.6), q, v, wrench);
  REQUIRE(edge.size() == 11);
  CHECK(edge.minCoeff() == Approx(std::min(all.head<5>().minCoeff(), all.tail<10>().minCoeff())));
}

TEST_CASE("force residuals: a point has no centre of pressure, and a reference is as long as the force") {
  const Model sole = loadRobot("bipetto").model;
  for (const ContactKind kind : {ContactKind::Point3D, ContactKind::Edge5D, ContactKind::Surface6D}) {
    const Model model = changeModel(sole, [kind](ModelParts& parts) {
      parts.contacts[0].kind = kind;
      if (kind != ContactKind::Surface6D) parts.contacts[0].half_width = 0;
    });
    const ConstraintSet set = makeConstraintSet(model, {{}});
    const int c = set.num_loops, entries = kind == ContactKind::Point3D ? 3 : 6;
    CAPTURE(entries);
    CHECK(makeContactForce(set, c, VectorXd::Zero(entries))->size() == entries);
    for (const int other : {3, 5, 6})
      if (other != entries)
        CHECK_THROWS_WITH(
            makeContactForce(set, c, VectorXd::Zero(other)),
            Catch::Contains("contact '" + model.contacts()[0].name + "'") && Catch::Contains(std::to_string(entries)));
    if (kind == ContactKind::Point3D)
      CHECK_THROWS_WITH(makeCenterOfPressure(set, c), Catch::Contains("contact '" + model.contacts()[0].name + "'") &&
                                                          Catch::Contains("a sole (6d) or an edge (5d)"));
    else
      CHECK(makeCenterOfPressure(set, c)->size() == 2);
  }
}

TEST_CASE("every residual against differences, on Bipetto in motion") {
  std::mt19937 rng(12);
  const Model model = loadRobot("bipetto").model;
  const ConstraintSet set = makeConstraintSet(model, {{0, {}, 0, 0}, {1, {}, 0, 0}});
  const VectorXd q = assembleReference(model, "half_sitting").q;
  const VectorXd v = randomVector(rng, model.nv(), 1), lambda = makeForces(rng, set);
  const BodyFrame left = getBodyFrame(model, "foot_left"), right = getBodyFrame(model, "foot_right");
  for (const NamedResidual& entry : makeResiduals(rng, model, set, left, right, {}, q)) {
    CAPTURE(entry.name);
    if (entry.residual->size() > 0) checkResidual(model, set, *entry.residual, q, v, lambda);
  }
}

TEST_CASE("transmissions against differences, on every linkage of the robots, at and off closed configurations") {
  std::mt19937 rng(14);
  for (const char* name : {"bipetto", "rsu_biped", "digit", "cleobot", "fivebar_leg", "fivebar"}) {
    if (std::string(name) == "digit" && findPublished("digit_like_2legs").empty()) continue;
    const Model model = loadRobot(name).model;
    const ConstraintSet set = makeConstraintSet(model);
    const VectorXd q0 = assembleReference(model, model.references().front().name).q;
    const VectorXd q = closeConfiguration(model, model.integrate(q0, randomVector(rng, model.nv(), 0.05))).q;
    const VectorXd v = randomVector(rng, model.nv()), lambda = VectorXd::Zero(set.rows);
    const std::vector<Linkage> linkages = listLinkages(model, q0);
    CHECK(linkages.size() >= (std::string(name) == "cleobot" ? 4 : model.hasFreeFlyer() ? 2 : 1));
    for (const Linkage& linkage : linkages) {
      CAPTURE(name, linkage.output);
      const auto residual = makeTransmission(linkage, 6);
      TestNode node(model, set);
      CHECK(std::abs(node.calc(*residual, q0, v, lambda)[0] - 1) < 1e-10);
      checkResidual(model, set, *residual, q, v, lambda);
      checkResidual(model, set, *residual, model.integrate(q, randomVector(rng, model.nv(), 1e-3)), v, lambda);
    }
  }
}

TEST_CASE("frame residuals: exponentials give the placement back, velocities are time derivatives") {
  std::mt19937 rng(13);
  const Mechanism mechanism =
      makeRandomMechanism(rng, JointKind::Spherical, ClosureKind::Ball3D, MechanismBase::FreeFlyer);
  const Model& model = mechanism.model;
  const ConstraintSet set = makeConstraintSet(model);
  const BodyFrame frame = getBodyFrame(model, "tip2");
  const VectorXd q = mechanism.q_closed, v = randomVector(rng, model.nv()), lambda = VectorXd::Zero(set.rows);
  const SE3 X_WT = randomPlacement(rng);
  TestNode node(model, set);
  const VectorXd placement = node.calc(*makeFramePlacement(frame, X_WT), q, v, lambda);
  const SE3 X_WF = getPlacement(node.ws, frame.body, frame.X_BF), again = X_WT * exp6(placement);
  CHECK((again.p - X_WF.p).norm() < 1e-12);
  CHECK((again.R - X_WF.R).norm() < 1e-12);
  const Vector3d rotation = node.calc(*makeFrameRotation(frame, X_WT.R), q, v, lambda);
  CHECK((X_WT.R * exp3(rotation) - X_WF.R).norm() < 1e-12);
  const VectorXd offset = node.calc(*makeFrameTranslation(frame, X_WT.p), q, v, lambda);
  CHECK((offset - (X_WF.p - X_WT.p)).norm() < 1e-14);

  const VectorXd velocity = node.calc(*makeFrameVelocity(frame), q, v, lambda);
  const auto along = [&](const Residual& residual) {
    return VectorXd(differentiate(VectorXd::Zero(1), 1e-3, [&](const VectorXd& t) {
      return node.calc(residual, model.integrate(q, t[0] * v), v, lambda);
    }));
  };
  CHECK(calcRelativeError(velocity.head<3>(), along(*makeFrameTranslation(frame, X_WT.p))) < 1e-9);
  // With the target at the present rotation, the rate of Log3 is the angular velocity in the axes of the frame.
  CHECK(calcRelativeError(velocity.tail<3>(), X_WF.R * along(*makeFrameRotation(frame, X_WF.R))) < 1e-9);
  CHECK(calcRelativeError(node.calc(*makeComVelocity(Vector3d::Zero()), q, v, lambda),
                          along(*makeComPosition(Vector3d::Zero()))) < 1e-9);
}

TEST_CASE("force residuals: a force at a known point of the sole") {
  const Model model = loadRobot("bipetto").model;
  const ConstraintSet set = makeConstraintSet(model, {{0, {}, 0, 0}, {1, {}, 0, 0}});
  const int constraint = set.num_loops + 1, row = set.offsets[constraint];
  const Vector3d point(0.03, -0.02, 0), force(-20, 10, 100);
  VectorXd lambda = VectorXd::Constant(set.rows, 7);  // the other feet and loops do not matter
  lambda.segment<3>(row) = force;
  lambda.segment<3>(row + 3) = point.cross(force);
  TestNode node(model, set);
  const VectorXd q = model.makeNeutral(), v = VectorXd::Zero(model.nv());
  const VectorXd pressure = node.calc(*makeCenterOfPressure(set, constraint), q, v, lambda);
  CHECK((pressure - point.head<2>()).norm() < 1e-14);
  VectorXd turned = q;  // about the vertical, and the sole with the base
  turned.segment<4>(3) << 0, 0, std::sin(0.2), std::cos(0.2);
  const Matrix3d R = makeAxisRotation(Vector3d::UnitZ(), 0.4);
  const VectorXd level = node.calc(*makeCenterOfPressure(set, constraint, ForceAxes::World), q, v, lambda);
  const VectorXd in_world = node.calc(*makeCenterOfPressure(set, constraint, ForceAxes::World), turned, v, lambda);
  CHECK((in_world - R.topLeftCorner<2, 2>() * level).norm() < 1e-14);
  const VectorXd cone = node.calc(*makeWrenchCone(set, constraint, 0.1, 0.04, 0.5), q, v, lambda);
  CHECK((cone.segment<4>(1) - Eigen::Vector4d(70, 30, 40, 60)).norm() < 1e-12);
  lambda[row + 2] = 0.5;  // hardly loaded: bounded, and its derivative follows
  CHECK(node.calc(*makeCenterOfPressure(set, constraint), q, v, lambda).allFinite());
  checkResidual(model, set, *makeCenterOfPressure(set, constraint), q, v, lambda);
}

TEST_CASE("force residuals: a sole that rests aslant is carried by the ground it was planned for") {
  const Model model = loadRobot("bipetto").model;
  const Matrix3d heading = makeAxisRotation(Vector3d::UnitZ(), 0.4);
  const ConstraintSet set = makeConstraintSet(model, {{0, {heading, Vector3d::Zero()}, 0, 0}});
  const int constraint = set.num_loops, row = set.offsets[constraint];
  const auto cone = makeWrenchCone(set, constraint, 0.1, 0.04, 0.3);
  const auto on_ground = makeWrenchCone(set, constraint, 0.1, 0.04, 0.3, ForceAxes::Ground);
  TestNode node(model, set);
  const VectorXd v = VectorXd::Zero(model.nv());
  VectorXd q = model.makeNeutral();
  const auto turnFoot = [&](double roll) {
    const Matrix3d R = heading * makeAxisRotation(Vector3d::UnitX(), roll);
    updatePositions(model, node.ws, model.makeNeutral());
    const ContactFrame& foot = model.contacts()[0];
    const Eigen::Quaterniond turn(R * (node.ws.X_WB[foot.body].R * foot.X_BF.R).transpose() * node.ws.X_WB[1].R);
    q.segment<4>(3) = turn.coeffs();
    return R;
  };
  // 100 N along the vertical, in the middle of the sole.
  for (double roll : {0.0, 0.4}) {
    const Matrix3d R = turnFoot(roll);
    VectorXd lambda = VectorXd::Zero(set.rows);
    lambda.segment<3>(row) = R.transpose() * Vector3d(0, 0, 100);
    const VectorXd own = node.calc(*cone, q, v, lambda), ground = node.calc(*on_ground, q, v, lambda);
    CAPTURE(roll);
    CHECK((ground.head<5>() - (VectorXd(5) << 100, 30, 30, 30, 30).finished()).norm() < 1e-10);
    CHECK((own.head<5>().minCoeff() > 0) == (roll == 0));
    if (roll == 0) CHECK((own - ground).norm() < 1e-10);
  }
}

TEST_CASE("sole clearance: over steps, beside them and between") {
  const Model model = loadRobot("bipetto").model;
  const ConstraintSet set = makeConstraintSet(model);
  const BodyFrame base{1, {}};
  TestNode node(model, set);
  Ground ground;
  ground.steps = {{Vector3d(1, 0, 0.2), 0.4, 0.6, 0.3}, {Vector3d(1.4, 0.1, 0.3), 0.4, 0.6, 0.3}};
  const double ramp = 0.05;
  const auto residual = makeSoleClearance(base, 0.1, 0.05, ground, ramp);
  std::mt19937 rng(15);
  int equal = 0, less = 0;
  for (int i = 0; i < 500; ++i) {
    VectorXd q = model.makeNeutral();
    q.head<3>() = Vector3d(1.2, 0, 0.5) + Vector3d(randomVector(rng, 3, 0.5));
    const VectorXd r = node.calc(*residual, q, VectorXd::Zero(model.nv()), {});
    int row = 0;
    for (double x : {0.1, -0.1})
      for (double y : {0.05, -0.05}) {
        const Vector3d corner = q.head<3>() + Vector3d(x, y, 0);
        const double height = corner.z() - ground.calcHeight(corner.x(), corner.y());
        CHECK(r[row] <= height + 1e-12);
        CHECK(r[row] >= height - 0.3);
        (r[row] < height - 1e-9 ? less : equal) += 1;
        ++row;
      }
  }
  CHECK(equal > 1000);
  CHECK(less > 50);
}

TEST_CASE("distance of capsules: of segments that cross, pass, end and are points") {
  const Model model = loadRobot("bipetto").model;
  const ConstraintSet set = makeConstraintSet(model);
  TestNode node(model, set);
  const int body = 1;
  const auto calc = [&](const Vector3d& a0, const Vector3d& a1, const Vector3d& b0, const Vector3d& b1) {
    const auto residual = makeShapeDistance(makeCapsule(body, a0, a1, 0.1), makeCapsule(body, b0, b1, 0.3));
    return node.calc(*residual, model.makeNeutral(), VectorXd::Zero(model.nv()), {})[0] + 0.4;
  };
  const Vector3d x = Vector3d::UnitX(), y = Vector3d::UnitY(), z = Vector3d::UnitZ();
  CHECK(calc(-x, x, -y + 2 * z, y + 2 * z) == Approx(2));
  CHECK(calc(-x, x, -y, y) == Approx(0).margin(1e-12));
  CHECK(calc(Vector3d::Zero(), x, 3 * y, x + 3 * y) == Approx(3));
  CHECK(calc(Vector3d::Zero(), x, 2 * x + y, 3 * x + y) == Approx(std::sqrt(2)));
  CHECK(calc(Vector3d::Zero(), x, 4 * x, 5 * x) == Approx(3));
  CHECK(calc(x, x, -y, y) == Approx(1));
  CHECK(calc(-y, y, 3 * x, 3 * x) == Approx(3));
  CHECK(calc(x, x, z, z) == Approx(std::sqrt(2)));
  // Against a search over both segments.
  std::mt19937 rng(16);
  for (int i = 0; i < 20; ++i) {
    const Vector3d a0 = randomVector(rng, 3), a1 = randomVector(rng, 3), b0 = randomVector(rng, 3),
                   b1 = randomVector(rng, 3);
    double least = 1e9;
    const int steps = 300;
    for (int s = 0; s <= steps; ++s)
      for (int t = 0; t <= steps; ++t)
        least = std::min(least, (a0 + s * (a1 - a0) / steps - b0 - t * (b1 - b0) / steps).norm());
    CHECK(calc(a0, a1, b0, b1) <= least + 1e-12);
    CHECK(calc(a0, a1, b0, b1) > least - 0.02);
  }
}

TEST_CASE("distance from the ground: the plane, the sides and edges of steps, inclined tops; with its derivative") {
  Ground ground;
  ground.height = 0.1;
  Shape box;
  box.half = {0.2, 0.1, 0.05};
  const auto calc = [&](const Shape& shape, const Vector3d& p) {
    return calcGroundDistance(ground, shape, {Matrix3d::Identity(), p}).distance;
  };
  CHECK(calc(box, {3, 4, 1}) == Approx(0.85));
  CHECK(calc(box, {3, 4, 0.1}) == Approx(-0.05));
  CHECK(calc(makeCapsule(0, {0, 0, 0.3}, {0, 1, 0.7}, 0.1), Vector3d::Zero()) == Approx(0.1));
  ground.steps = {{{1, 0, 0.5}, 0.6, 2}};                            // from x = 0.7 to 1.3, 0.4 over the plane
  CHECK(calc(box, {0.4, 0, 0.3}) == Approx(0.1));                    // beside its side
  CHECK(calc(box, {0.1, 0, 0.7}) == Approx(std::hypot(0.4, 0.15)));  // off its edge
  CHECK(calc(box, {1, 0, 0.7}) == Approx(0.15));                     // over its top
  CHECK(calc(box, {0.6, 0, 0.3}) == Approx(-0.1));                   // in its side
  ground.steps[0].pitch = 0.2;
  const Vector3d up(std::sin(0.2), 0, std::cos(0.2));
  Shape ball;
  ball.radius = 0.05;
  CHECK(calc(ball, Vector3d(1, 0.3, 0.5) + 0.2 * up) == Approx(0.15));

  const Model model = loadRobot("bipetto").model;
  std::mt19937 rng(17);
  const VectorXd q = model.integrate(model.makeNeutral(), randomVector(rng, model.nv(), 0.3));
  ground.steps[0].top = {0.3, 0.1, 0.2};
  ground.steps[0].yaw = 0.3;
  Workspace ws(model);
  constexpr double kShortStep = 5e-5;  // some edges are nearly level here: farther off, another corner is lowest
  for (const Shape& shape : model.shapes()) {
    const auto calcHere = [&] { return calcGroundDistance(ground, shape, ws.X_WB[shape.body]); };
    updatePositions(model, ws, q);
    MatrixXd gradient = MatrixXd::Zero(1, model.nv());
    addDistanceGradient(model, ws, shape, Shape(), calcHere(), gradient);
    checkDerivative(gradient,
                    differentiateTangent(model, q, kShortStep,
                                         [&](const VectorXd& x) {
                                           updatePlacements(model, ws, x);
                                           return VectorXd(VectorXd::Constant(1, calcHere().distance));
                                         }),
                    model.bodies()[shape.body].name);
  }
}

TEST_CASE("joint positions without a list are those of the joints with one dof and finite limits") {
  ModelBuilder builder("limited");
  std::mt19937 rng(14);
  const auto add = [&](const std::string& link, const std::string& parent, JointKind kind, const JointLimits& limits) {
    Joint joint;
    joint.name = "joint_" + link;
    joint.kind = kind;
    builder.addLink(link, parent, joint, randomInertia(rng), limits);
  };
  add("base", "world", JointKind::Planar, {Vector3d(-1, -1, -1), Vector3d(1, 1, 1), {}});
  add("arm", "base", JointKind::Revolute, {VectorXd::Constant(1, -2), VectorXd::Constant(1, 2), {}});
  add("hand", "arm", JointKind::Revolute, {});
  const Model model = builder.build();
  const ConstraintSet set = makeConstraintSet(model);
  const auto residual = makeJointPosition(model, {});
  REQUIRE(residual->size() == 1);
  const VectorXd q = randomVector(rng, model.nq()), v = randomVector(rng, model.nv());
  CHECK(TestNode(model, set).calc(*residual, q, v, {})[0] == q[3]);
  checkResidual(model, set, *residual, q, v, {});
}

TEST_CASE("activations: derivatives against differences, a barrier is flat inside") {
  const VectorXd weights = Eigen::Vector4d(1, 2, 0.5, 3);
  const VectorXd lower = Eigen::Vector4d(-1, -1, -1, -std::numeric_limits<double>::infinity());
  const VectorXd upper = Eigen::Vector4d(1, 1, 1, 2);
  const VectorXd r = Eigen::Vector4d(0.5, 1.5, -2, 3);
  for (const Activation& activation :
       {Activation::makeQuadratic(weights), Activation::makeBarrier(weights, lower, upper)}) {
    VectorXd gradient(4), hessian(4), unused(4);
    activation.calcDerivatives(r, gradient, hessian);
    checkDerivative(gradient.transpose(), differentiate(r, 1e-2, [&](const VectorXd& x) {
                      return VectorXd::Constant(1, activation.calc(x));
                    }));
    checkDerivative(hessian.asDiagonal(), differentiate(r, 1e-2, [&](const VectorXd& x) {
                      VectorXd g(4);
                      activation.calcDerivatives(x, g, unused);
                      return g;
                    }));
  }
  const Activation barrier = Activation::makeBarrier(weights, lower, upper);
  CHECK(barrier.calc(r) == Approx(0.5 * (2 * 0.25 + 0.5 * 1 + 3 * 1)));
  CHECK(barrier.calc(Eigen::Vector4d(-1, 1, 0, -1e9)) == 0);
}
