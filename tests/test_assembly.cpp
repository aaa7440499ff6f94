// Oracles: the requested placements, measured by kinematics of the assembled configuration, and closed-form linkages.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <random>
#include <string>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/constrained.h"
#include "bielle/dynamics/kinematics.h"
#include "dynamics/assembly_refinement.h"
#include "dynamics/target_reach.h"
#include "math/constants.h"
#include "math/so3.h"
#include "mechanisms.h"
#include "own_robots.h"
#include "selection.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

SE3 getFrame(const Model& model, const Workspace& ws, const std::string& name) {
  REQUIRE(model.findFrame(name) >= 0);
  const Frame& frame = model.frames()[model.findFrame(name)];
  return getPlacement(ws, frame.body, frame.X_BF);
}

double calcLoopGap(const Model& model, Workspace& ws, const VectorXd& q) {
  updatePositions(model, ws, q);
  return calcLargestGap(ws, makeConstraintSet(model));
}

}  // namespace

TEST_CASE("assembly: Bipetto half sitting, from scratch") {
  const Model model = loadOwn("bipetto").model;
  Workspace ws(model);
  REQUIRE(calcLoopGap(model, ws, model.makeNeutral()) > 1e-3);  // there is something to close
  const AssemblyResult result = assembleReference(model, "half_sitting");
  CAPTURE(result.message);
  REQUIRE(result.status == NumericalStatus::Ok);
  CHECK(calcLoopGap(model, ws, result.q) < 1e-12);
  CHECK(result.gap < 1e-12);
  CHECK(std::abs(getFrame(model, ws, "torso").p.z() - 0.575) < 1e-12);
  for (const auto& [foot, y] : {std::pair<std::string, double>{"foot_left", 0.125}, {"foot_right", -0.125}}) {
    CAPTURE(foot);
    const SE3 X = getFrame(model, ws, foot);
    CHECK((X.p - Vector3d(0, y, 0)).norm() < 1e-12);
    CHECK((X.R - Matrix3d::Identity()).norm() < 1e-12);
  }
  // Knees bend as wished, not the other way; the wish is soft.
  for (const auto& [joint, angle] : {std::pair<std::string, double>{"knee_left", -0.4890}, {"knee_right", 0.4913}})
    CHECK(std::abs(result.q[model.joints()[model.findJoint(joint)].idx_q] - angle) < 0.02);
}

TEST_CASE("assembly: whole turns of far angles are left out where nothing counts them") {
  const Model model = loadOwn("fourbar").model;
  const VectorXd near = closeConfiguration(model, model.makeNeutral()).q;
  VectorXd far = near;
  far[0] += 2 * kPi * 1e9;  // rounded to 1e-6
  const AssemblyResult result = closeConfiguration(model, far);
  CAPTURE(result.message);
  REQUIRE(result.status == NumericalStatus::Ok);
  CHECK((result.q - near).norm() < 1e-5);
  Reference reference{"turned", {{"crank_joint", {far[0]}}}, "", 0, {}, {}};
  const VectorXd q = assemble(model, makeReferenceProblem(model, reference)).q;
  CHECK(listReferenceJoints(model, reference, q).front().moved < 1e-5);  // as of other references, which are targets
}

TEST_CASE("assembly: a given angle out of reach is listed with where it ends, one within reach stays") {
  const Model model = loadOwn("fourbar").model;
  Reference reference{"bent", {{"crank_joint", {1.047198}}, {"rocker_joint", {0.2}}}, "", 0, {}, {}};
  const AssemblyResult result = assemble(model, makeReferenceProblem(model, reference));
  REQUIRE(result.status == NumericalStatus::Ok);
  const std::vector<ReferenceJoint> joints = listReferenceJoints(model, reference, result.q);
  REQUIRE(joints.size() == 2);
  double moved = 0;
  for (const ReferenceJoint& joint : joints) {
    const Joint& of = model.joints()[joint.joint];
    CHECK(joint.given[0] == reference.joints.at(of.name)[0]);
    CHECK(joint.assembled[0] == result.q[of.idx_q]);
    CHECK(joint.moved == std::abs(joint.assembled[0] - joint.given[0]));
    moved = std::max(moved, joint.moved);
  }
  CHECK(moved > 0.1);
  reference = model.references().front();
  const AssemblyResult as_given = assemble(model, makeReferenceProblem(model, reference));
  for (const ReferenceJoint& joint : listReferenceJoints(model, reference, as_given.q)) CHECK(joint.moved < 1e-5);
}

TEST_CASE("assembly: the torso at every height within reach; far outside, what stays open is named", "[sweep]") {
  const Model model = loadOwn("bipetto").model;
  Reference reference = model.references().front();
  Workspace ws(model);
  Selection selection;
  for (double height : {0.45, 0.5, 0.55, 0.6, 0.62}) {
    if (selection.isLeftOut()) continue;
    reference.height = height;
    const AssemblyResult result = assemble(model, makeReferenceProblem(model, reference));
    CAPTURE(height, result.message);
    REQUIRE(result.status == NumericalStatus::Ok);
    CHECK(calcLoopGap(model, ws, result.q) < 1e-12);
    CHECK(std::abs(getFrame(model, ws, "torso").p.z() - height) < 1e-12);
  }
  for (double height : {0.9, 2.0}) {
    if (selection.isLeftOut()) continue;
    reference.height = height;
    const AssemblyResult result = assemble(model, makeReferenceProblem(model, reference));
    CAPTURE(height, result.message);
    CHECK(result.status == NumericalStatus::NotClosed);
    CHECK(result.q.allFinite());
    CHECK(!result.worst.empty());
    CHECK(result.message.find(result.worst) != std::string::npos);
    CHECK(result.message.find("stays open by") != std::string::npos);
    CHECK(result.gap == Approx(calcLoopGap(model, ws, result.q)));
  }
  CHECK_THROWS_AS(assembleReference(model, "lotus"), InputError);
}

TEST_CASE("assembly: a four-bar against its closed form over the full turn of the crank") {
  const double ground = 0.4, crank = 0.15, coupler = 0.35, rocker = 0.3;
  const Mechanism start = makePlanarFourBar(ground, crank, coupler, rocker, 0);
  const Model& model = start.model;
  const int steps = 24;
  AssemblyProblem problem;
  problem.q_ref = start.q_closed;
  problem.weights = VectorXd::Unit(4, 0);  // the crank leads, the others follow
  for (int i = 1; i <= steps; ++i) {
    CAPTURE(i);
    problem.q_ref[0] -= 2 * kPi / steps;
    const AssemblyResult result = assemble(model, problem);
    REQUIRE(result.status == NumericalStatus::Ok);
    CHECK(result.q[0] == Approx(problem.q_ref[0]).margin(1e-12));
    const VectorXd exact = makePlanarFourBar(ground, crank, coupler, rocker, -result.q[0]).q_closed;
    // Angles up to whole turns.
    for (int k = 0; k < 4; ++k) CHECK(std::abs(std::remainder(result.q[k] - exact[k], 2 * kPi)) < 1e-10);
    problem.q_ref = result.q;
  }
}

TEST_CASE("assembly: the shortest steps close the same robot, and change nothing without need") {
  const Model model = loadOwn("bipetto").model;
  const VectorXd closed = assembleReference(model, "half_sitting").q;
  AssemblyProblem problem;
  problem.q_ref = model.integrate(closed, 0.02 * VectorXd::Random(model.nv()));
  AssemblyOptions options;
  options.step = AssemblyStep::Shortest;
  const AssemblyResult result = assemble(model, problem, options);
  REQUIRE(result.status == NumericalStatus::Ok);
  Workspace ws(model);
  CHECK(calcLoopGap(model, ws, result.q) < 1e-12);
  CHECK(result.iterations < 10);
  // No closed configuration nearby is closer to the start, to first order: the way there is across the closed motions.
  const ConstraintSet set = makeConstraintSet(model);
  MatrixXd J = MatrixXd::Zero(set.rows, model.nv());
  updatePositions(model, ws, result.q);
  for (size_t c = 0; c < set.closures.size(); ++c)
    calcClosureResidualJacobian(ws, set.closures[c], J.middleRows(set.offsets[c], getRows(set.closures[c].kind)));
  const VectorXd way = model.difference(problem.q_ref, result.q);
  const VectorXd along = way - J.completeOrthogonalDecomposition().solve(J * way);
  CHECK(along.norm() < 0.1 * way.norm());
  // Out of reach: the status must say so.
  problem.frames.push_back({"trunk", 1, SE3(), {Matrix3d::Identity(), Vector3d(0, 0, 0.5)}});
  for (const ContactFrame& foot : model.contacts())
    problem.frames.push_back({foot.name, foot.body, foot.X_BF, {Matrix3d::Identity(), Vector3d(0, 0, -2)}});
  CHECK(assemble(model, problem, options).status == NumericalStatus::NotClosed);
}

TEST_CASE(
    "assembly: under a base that is held, legs come to where they do with a target for the base, which does not move") {
  const Model model = loadOwn("bipetto").model;
  const VectorXd standing = assembleReference(model, "half_sitting").q;
  Workspace ws(model);
  updatePositions(model, ws, standing);
  AssemblyProblem problem;
  problem.q_ref = standing;
  problem.q_ref[2] -= 0.05;
  for (const ContactFrame& foot : model.contacts())
    problem.frames.push_back(makeFrameTarget(foot, getPlacement(ws, foot.body, foot.X_BF)));
  AssemblyOptions options;
  options.step = AssemblyStep::Shortest;
  const AssemblyResult held = assembleUnderBase(model, problem, options);
  REQUIRE(held.status == NumericalStatus::Ok);
  CHECK(held.q.head<7>() == problem.q_ref.head<7>());
  const Eigen::Quaterniond attitude(Eigen::Vector4d(problem.q_ref.segment<4>(3)));
  problem.frames.push_back({"trunk", 1, SE3(), {attitude.toRotationMatrix(), problem.q_ref.head<3>()}});
  const AssemblyResult placed = assemble(model, problem, options);
  REQUIRE(placed.status == NumericalStatus::Ok);
  for (const char* name :
       {"hipz_left", "hipx_left", "hipy_left", "knee_left", "ankley_left", "anklex_left", "motor_knee_left"}) {
    CAPTURE(name);  // rods may spin about themselves
    const int k = model.joints()[model.findJoint(name)].idx_q;
    CHECK(std::abs(held.q[k] - placed.q[k]) < 1e-10);
  }
  CHECK(std::abs(held.iterations - placed.iterations) <= 1);
  problem.frames.pop_back();
  problem.q_ref[2] += 0.35;
  CHECK(assembleUnderBase(model, problem, options).status == NumericalStatus::NotClosed);
}

TEST_CASE(
    "assembly: with little patience what is just out of reach is told sooner; what is within reach is found as well") {
  const Model model = loadOwn("bipetto").model;
  const VectorXd standing = assembleReference(model, "half_sitting").q;
  Workspace ws(model);
  updatePositions(model, ws, standing);
  AssemblyOptions patient;
  patient.step = AssemblyStep::Shortest;
  patient.max_iterations = 15;
  patient.continuation_steps = 0;
  AssemblyOptions impatient = patient;
  impatient.patience = 2;
  int within = 0, beyond = 0;
  for (int i = -8; i <= 17; ++i) {  // of the trunk over feet that stay, cm
    CAPTURE(i);
    AssemblyProblem problem;
    problem.q_ref = standing;
    problem.q_ref[2] += 0.01 * i;
    problem.frames.push_back({"trunk", 1, SE3(), {Matrix3d::Identity(), problem.q_ref.head<3>()}});
    for (const ContactFrame& foot : model.contacts())
      problem.frames.push_back(makeFrameTarget(foot, getPlacement(ws, foot.body, foot.X_BF)));
    const AssemblyResult a = assemble(model, problem, patient), b = assemble(model, problem, impatient);
    CHECK(a.status == b.status);
    if (a.status == NumericalStatus::Ok) {
      ++within;
      CHECK(a.iterations == b.iterations);
      CHECK(a.q == b.q);
    } else {
      ++beyond;
      CHECK(a.iterations == (i > 10 ? 0 : 15));  // farther ones than their span are refused at once
      CHECK(b.iterations <= 11);
    }
  }
  CHECK(within > 8);
  CHECK(beyond > 4);
}

TEST_CASE("assembly: feet that are farther apart than legs are long are refused without a step") {
  const Model& model = getBipetto();
  Reference reference = model.references()[0];
  REQUIRE(reference.feet.size() == 2);
  REQUIRE(assemble(model, makeReferenceProblem(model, reference)).status == NumericalStatus::Ok);
  for (auto& [name, place] : reference.feet) place *= 1000;  // mm
  const AssemblyResult feet = assemble(model, makeReferenceProblem(model, reference));
  CHECK(feet.status == NumericalStatus::NotClosed);
  CHECK(feet.iterations == 0);
  CHECK_THAT(feet.message, Catch::Contains(" m from target '") && Catch::Contains("within reach, in m"));
  // The height of a frame over the feet, likewise.
  reference = model.references()[0];
  if (reference.height_frame.empty()) reference.height_frame = model.bodies()[1].name, reference.height = 0.4;
  reference.height *= 1000;
  const AssemblyResult height = assemble(model, makeReferenceProblem(model, reference));
  CHECK(height.iterations == 0);
  CHECK_THAT(height.message, Catch::Contains("height of ") && Catch::Contains("within reach, in m"));
  // At exactly the length of a stretched arm it is tried, and found; beyond, not.
  ModelBuilder builder("arm");
  Joint joint;
  joint.kind = JointKind::Revolute;
  joint.axis = Vector3d::UnitY();
  std::mt19937 rng(1);
  joint.name = "shoulder";
  builder.addLink("upper", "world", joint, randomInertia(rng));
  joint.name = "elbow";
  joint.X_PJ.p.x() = 0.3;
  builder.addLink("lower", "upper", joint, randomInertia(rng));
  const Model arm = builder.build();
  FrameTarget hand;
  hand.name = "hand";
  hand.body = 2;
  hand.X_BF.p = {0.2, 0, 0};
  hand.mask.tail<3>().setConstant(false);
  AssemblyProblem problem;
  problem.q_ref = VectorXd::Zero(2);
  hand.X_WT.p = {0.5, 0, 0};
  problem.frames = {hand};
  CHECK(assemble(arm, problem).status == NumericalStatus::Ok);
  problem.frames[0].X_WT.p = {0, 0, 0.51};
  const AssemblyResult far = assemble(arm, problem);
  CHECK(far.iterations == 0);
  CHECK_THAT(far.message,
             Catch::Contains("0.51 m from the origin of the world") && Catch::Contains("bridges 0.5 m at most"));
  // With its direction given, too, the joint at the hand has its place, which what is before it has to bridge.
  problem.frames[0].mask.setConstant(true);
  problem.frames[0].X_WT.p = {0.15, 0, 0};
  problem.frames[0].X_WT.R = makeAxisRotation(Vector3d::UnitZ(), 3.0);
  const AssemblyResult turned = assemble(arm, problem);
  CHECK(turned.iterations == 0);
  CHECK_THAT(turned.message, Catch::Contains("stays open by at least 0.049"));
}

TEST_CASE("assembly: places that a robot takes are never called out of reach, and those beyond its length are") {
  std::mt19937 rng(5);
  for (int i = 0; i < 300; ++i) {
    CAPTURE(i);
    ModelBuilder builder("tree");
    const int bodies = 3 + i % 4;
    double length = 0;
    for (int k = 0; k < bodies; ++k) {
      Joint joint;
      joint.name = "joint" + std::to_string(k);
      joint.kind = k % 3 == 2 ? JointKind::Spherical : JointKind::Revolute;
      joint.axis = randomVector(rng, 3).normalized();
      joint.X_PJ = randomPlacement(rng);
      length += joint.X_PJ.p.norm();
      const int parent = std::uniform_int_distribution<int>(-1, k - 1)(rng);
      builder.addLink("body" + std::to_string(k), parent < 0 ? "world" : "body" + std::to_string(parent), joint,
                      randomInertia(rng));
    }
    const Model model = builder.build();
    Workspace ws(model);
    updatePositions(model, ws, model.integrate(model.makeNeutral(), randomVector(rng, model.nv(), 3)));
    std::vector<FrameTarget> targets(3);
    for (FrameTarget& target : targets) {
      target.body = std::uniform_int_distribution<int>(1, bodies)(rng);
      target.X_BF = randomPlacement(rng);
      target.X_WT = getPlacement(ws, target.body, target.X_BF);
    }
    targets[2].mask.tail<3>().setConstant(false);
    CHECK(findTargetsApart(model, targets).second == "");
    targets[i % 3].X_WT.p += (2 * length + 10) * randomVector(rng, 3).normalized();
    CHECK(findTargetsApart(model, targets).second != "");
  }
}

TEST_CASE("assembly: bodies are never farther apart than their span, which for a leg is that of thigh and shank") {
  // Hinges about z, x and y meet in a hip, whatever their origins are along their axes; knee and ankle are about y.
  ModelBuilder builder("leg");
  const auto add = [&builder](const char* name, const char* parent, const Vector3d& axis, const Vector3d& p) {
    Joint joint;
    joint.name = std::string(name) + "_joint";
    joint.kind = JointKind::Revolute;
    joint.axis = axis;
    joint.X_PJ.p = p;
    std::mt19937 rng(3);
    builder.addLink(name, parent, joint, randomInertia(rng));
  };
  add("yaw", "world", Vector3d::UnitZ(), {0, 0.1, 0.5});
  add("roll", "yaw", Vector3d::UnitX(), {-0.05, 0, -0.14});
  add("thigh", "roll", Vector3d::UnitY(), {0.05, 0.08, 0});
  add("shank", "thigh", Vector3d::UnitY(), {0, -0.03, -0.3});
  add("foot", "shank", Vector3d::UnitY(), {0, -0.02, -0.4});
  const Model model = builder.build();
  FrameTarget world, foot;
  foot.body = model.findJoint("foot_joint");
  foot.X_BF.p = {0.1, 0, -0.05};
  const Span span = calcSpan(model, world, foot);
  CHECK(span.length == Approx(0.7));
  CHECK((span.one - Vector3d(0, 0.1, 0.36)).norm() < 1e-12);  // the hip
  foot.mask.tail<3>().setConstant(false);                     // it may turn
  const Span turning = calcSpan(model, world, foot);
  CHECK(turning.length == Approx(std::hypot(0.7 + std::hypot(0.1, 0.05), 0.03)));  // unfolded, 0.03 m aside
  std::mt19937 rng(4);
  Workspace ws(model);
  double farthest = 0, farthest_turning = 0;
  for (int i = 0; i < 20000; ++i) {
    updatePositions(model, ws, randomVector(rng, model.nq(), 3));
    const SE3& X_WB = ws.X_WB[static_cast<size_t>(foot.body)];
    farthest = std::max(farthest, (X_WB.act(span.other) - span.one).norm());
    farthest_turning = std::max(farthest_turning, (X_WB.act(turning.other) - turning.one).norm());
  }
  CHECK(farthest <= span.length);
  CHECK(farthest > 0.999 * span.length);
  CHECK(farthest_turning <= turning.length);
  CHECK(farthest_turning > 0.95 * turning.length);
}

TEST_CASE("assembly: a loop too short to close is named, with its gap") {
  // The rods reach 0.2 m, the pins are 0.4 m apart.
  ModelBuilder builder("short");
  Joint joint;
  joint.kind = JointKind::Revolute;
  joint.axis = Vector3d::UnitY();
  Inertia inertia;
  inertia.mass = 1;
  inertia.I_com = Matrix3d::Identity() * 1e-2;
  joint.name = "first";
  builder.addLink("rod1", "world", joint, inertia);
  joint.name = "second";
  joint.X_PJ.p.x() = 0.1;
  builder.addLink("rod2", "rod1", joint, inertia);
  builder.addFrame("tip", "rod2", {Matrix3d::Identity(), {0.1, 0, 0}});
  builder.addFrame("pin", "world", {Matrix3d::Identity(), {0.4, 0, 0}});
  builder.addClosure("gap to the pin", ClosureKind::Ball3D, "tip", "pin");
  const Model model = builder.build();
  const AssemblyResult result = closeConfiguration(model, Eigen::Vector2d(0.4, 0.3));
  CAPTURE(result.message);
  CHECK(result.status == NumericalStatus::NotClosed);
  CHECK(result.worst.find("gap to the pin") != std::string::npos);
  CHECK(result.message.find("gap to the pin") != std::string::npos);
  CHECK(result.gap >= 0.2 - 1e-9);
  CHECK(result.gap < 0.4);
}

TEST_CASE("assembly: velocities are projected on the closures, and stay when they are there") {
  std::mt19937 rng(31);
  for (const bool redundant : {false, true}) {
    const Mechanism mechanism =
        redundant ? makePlanarFourBar(0.4, 0.15, 0.35, 0.3, 0.7)
                  : makeRandomMechanism(rng, JointKind::Spherical, ClosureKind::Hinge5D, MechanismBase::FreeFlyer);
    const Model& model = mechanism.model;
    const ConstraintSet set = makeConstraintSet(model);
    Workspace ws(model);
    const VectorXd v = projectVelocity(model, ws, set, mechanism.q_closed, randomVector(rng, model.nv()));
    CHECK(v.norm() > 1e-2);
    updatePositions(model, ws, mechanism.q_closed);
    updateVelocities(model, ws, v);
    CHECK(calcClosureVelocity(ws, set.closures[0]).norm() < 1e-12);
    CHECK((projectVelocity(model, ws, set, mechanism.q_closed, v) - v).norm() < 1e-12);
  }
}
