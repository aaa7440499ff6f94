// Loops that do not close: oracles are linkages whose missing lengths are known in closed form, mechanisms of which a known
// place was moved, and models made anew with what is offered.
#include <catch2/catch.hpp>

#include "bielle/dynamics/kinematics.h"
#include "bielle/robots/robot_loader.h"
#include "dynamics/loop_conflict.h"
#include "dynamics/loop_problem.h"
#include "math/constants.h"
#include "math/so3.h"
#include "mechanisms.h"
#include "model/joint.h"
#include "selection.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

Inertia makeUnitInertia() {
  Inertia inertia;
  inertia.mass = 1;
  inertia.I_com = Matrix3d::Identity() * 1e-2;
  return inertia;
}

Joint makeHinge(const std::string& name, const Vector3d& place, const Vector3d& axis = Vector3d::UnitY()) {
  Joint joint;
  joint.name = name;
  joint.kind = JointKind::Revolute;
  joint.axis = axis;
  joint.X_PJ.p = place;
  return joint;
}

// A shared bar from the origin to (0.2, 0, 0), and dyads from its tip to pins: rods of 0.15 m meet in the middle, where a
// ball closes them, both ends free to turn in the plane.
struct Dyad {
  std::string name;
  Vector3d start, pin;  // of the dyad: on the bar, and on the ground
};
Model makeSharedBar(const std::vector<Dyad>& dyads, ClosureKind kind = ClosureKind::Ball3D) {
  ModelBuilder builder("shared");
  builder.addLink("bar", "world", makeHinge("j_bar", Vector3d::Zero()), makeUnitInertia());
  const Vector3d rod(0.15, 0, 0);
  for (const Dyad& dyad : dyads) {
    const auto add = [&](const std::string& name, const std::string& parent, const Vector3d& place) {
      builder.addLink(name + dyad.name, parent, makeHinge("j_" + name + dyad.name, place), makeUnitInertia());
      builder.addFrame("tip_" + name + dyad.name, name + dyad.name, {Matrix3d::Identity(), rod});
    };
    add("a", "bar", dyad.start);
    add("b", "world", dyad.pin);
    builder.addClosure("rod_" + dyad.name, kind, "tip_a" + dyad.name, "tip_b" + dyad.name, Vector3d::UnitY());
  }
  return builder.build();
}

std::vector<std::string> listNames(const Model& model, const LoopConflict& conflict) {
  std::vector<std::string> names;
  for (int c : conflict.closures) names.push_back(model.closures()[c].name);
  return names;
}

// Each remedy closes the whole robot when the model is made anew; a twentieth less of it does not.
void checkRemedies(const Model& model, const LoopConflict& conflict) {
  REQUIRE(!conflict.remedies.empty());
  for (LoopRemedy remedy : conflict.remedies) {
    CAPTURE(static_cast<int>(remedy.place.kind), remedy.place.index, remedy.size);
    AssemblyOptions options;
    options.tolerance = 1e-9;
    const auto calcGapOf = [&](const LoopRemedy& change) {
      const Model changed = applyRemedy(model, change);
      double gap = closeConfiguration(changed, conflict.q, options).gap;
      if (gap > 1e-9) gap = std::min(gap, findClosedConfiguration(changed, options).gap);
      return gap;
    };
    CHECK(calcGapOf(remedy) < 1e-9);
    remedy.change.p *= 0.95;
    remedy.change.R = exp3(0.95 * log3(remedy.change.R));
    remedy.offset *= 0.95;
    CHECK(calcGapOf(remedy) > 1e-6);
  }
}

}  // namespace

TEST_CASE("conflicts: bars too short by a known length, and the least change that closes them", "[sweep]") {
  // Stretched out, crank, coupler and rocker reach 0.8 m; the pins are farther apart.
  Selection selection;
  for (const double ground : {0.83, 1.0, 1.9}) {
    if (selection.isLeftOut()) continue;
    CAPTURE(ground);
    const Model model = makePlanarFourBar(ground, 0.15, 0.35, 0.3, 1).model;
    const AssemblyResult open = findClosedConfiguration(model);
    REQUIRE(open.status == NumericalStatus::NotClosed);
    const std::vector<LoopConflict> conflicts = findLoopConflicts(model, open.q);
    REQUIRE(conflicts.size() == 1);
    CHECK(conflicts[0].closures == std::vector<int>{0});
    CHECK(conflicts[0].gap == Approx(ground - 0.8).epsilon(1e-9));
    REQUIRE(conflicts[0].remedies.size() == 3);
    for (const LoopRemedy& remedy : conflicts[0].remedies) {
      CHECK(std::abs(remedy.size - (ground - 0.8)) < 1e-9);
      CHECK(std::abs(remedy.change.p.norm() - (ground - 0.8)) < 1e-9);
    }
    checkRemedies(model, conflicts[0]);
    const InputError error = makeClosingError(model, "robot.urdf", open);
    CHECK(error.element() == "closure 'loop'");
    CHECK(describeConflict(model, conflicts[0]) == "loop 'loop' cannot close");
    CHECK_THAT(error.remedy(), Catch::Contains("mm along (-1, 0, 0)") || Catch::Contains("mm along (1, 0, 0)"));
    CHECK_THAT(error.remedy(), Catch::Contains(ground == 1.0 ? "200 mm" : " mm"));
  }
}

TEST_CASE("conflicts: a bar too long, where the linkage folds") {
  // The coupler is longer than all others together: crank, ground and rocker reach 0.85 m.
  const Model model = makePlanarFourBar(0.4, 0.15, 0.9, 0.3, 1).model;
  const std::vector<LoopConflict> conflicts = findLoopConflicts(model, model.makeNeutral());
  REQUIRE(conflicts.size() == 1);
  REQUIRE(conflicts[0].remedies.size() == 3);
  for (const LoopRemedy& remedy : conflicts[0].remedies) CHECK(std::abs(remedy.size - 0.05) < 1e-9);
}

namespace {

// What the dyad `up` lacks where `down` is stretched. Both hold the tip of the bar, (0.2 cos t, 0.2 sin t), from pins at
// (0.2, +-0.4), and reach 0.3 m: with D = (0.2, -0.4) the tip p has p . D = (|p|^2 + |D|^2 - 0.3^2) / 2.
double calcMissingReach() {
  const double distance = std::hypot(0.2, 0.4);
  const double along = (0.2 * 0.2 + distance * distance - 0.3 * 0.3) / (2 * distance);
  const double angle = std::atan2(-0.4, 0.2) + std::acos(along / 0.2);
  return std::hypot(0.2 - 0.2 * std::cos(angle), 0.4 - 0.2 * std::sin(angle)) - 0.3;
}

}  // namespace

TEST_CASE("conflicts: loops that close alone but not together; one beside them has no part in it", "[sweep]") {
  // Both dyads hold the tip of the bar; the one pulls it up, the other down, each by more than half of the way.
  const Vector3d tip(0.2, 0, 0);
  const Dyad up{"up", tip, {0.2, 0, 0.4}}, down{"down", tip, {0.2, 0, -0.4}}, idle{"idle", tip / 2, {0.2, 0, 0.05}};
  Selection selection(2);
  for (const ClosureKind kind : {ClosureKind::Ball3D, ClosureKind::Hinge5D}) {
    if (selection.isLeftOut()) continue;
    for (const Dyad& one : {up, down})
      CHECK(findClosedConfiguration(makeSharedBar({one, idle}, kind)).status == NumericalStatus::Ok);
    const Model model = makeSharedBar({idle, up, down}, kind);
    const AssemblyResult open = findClosedConfiguration(model);
    REQUIRE(open.status == NumericalStatus::NotClosed);
    const std::vector<LoopConflict> conflicts = findLoopConflicts(model, open.q);
    REQUIRE(conflicts.size() == 1);
    CHECK(listNames(model, conflicts[0]) == std::vector<std::string>{"rod_up", "rod_down"});
    const double missing = calcMissingReach();
    REQUIRE(missing > 0.1);
    CHECK(conflicts[0].remedies[0].size <= missing + 1e-9);
    for (const LoopRemedy& remedy : conflicts[0].remedies)
      if (remedy.place.kind != ModelPlace::Kind::Joint) CHECK(std::abs(remedy.size - missing) < 1e-9);
    checkRemedies(model, conflicts[0]);
    const InputError error = makeClosingError(model, "robot.urdf", open);
    CHECK_THAT(error.problem(),
               Catch::Contains("loops 'rod_up' and 'rod_down' cannot close together, although each can alone"));
    CHECK_THAT(error.remedy(), Catch::Contains("the smallest change that closes them is one of: "));
  }
}

TEST_CASE("conflicts: of random mechanisms, no remedy is larger than what was moved") {
  std::mt19937 rng(5);
  int open = 0;
  for (int seed = 0; seed < 12; ++seed) {
    CAPTURE(seed);
    // Two branches of two hinges each, in space: a weld leaves them no motion and is redundant by two rows.
    ModelBuilder builder("random");
    const auto add = [&](const std::string& name, const std::string& parent) {
      Joint joint = makeHinge("j_" + name, {}, randomVector(rng, 3).normalized());
      joint.X_PJ = randomPlacement(rng);
      builder.addLink(name, parent, joint, makeUnitInertia());
    };
    add("a1", "world"), add("a2", "a1"), add("b1", "world"), add("b2", "b1");
    const Model tree = builder.build();
    const VectorXd q = randomVector(rng, 4);
    Workspace ws(tree);
    updatePositions(tree, ws, q);
    const SE3 tip = randomPlacement(rng);
    builder.addFrame("tip_a", "a2", tip);
    builder.addFrame("tip_b", "b2", ws.X_WB[4].inverseTimes(ws.X_WB[2] * tip));
    builder.addClosure("weld", ClosureKind::Weld6D, "tip_a", "tip_b");
    const Model closed = builder.build();
    REQUIRE(closeConfiguration(closed, q).status == NumericalStatus::Ok);
    CHECK(findLoopConflicts(closed, q).empty());
    LoopRemedy moved;
    moved.place = {seed % 2 ? ModelPlace::Kind::Joint : ModelPlace::Kind::Frame1, seed % 2 ? 3 : 0};
    if (seed % 4 < 2)
      moved.change.p = randomVector(rng, 3, 0.02);
    else
      moved.change.R = exp3(randomVector(rng, 3, 0.02));
    const Model model = applyRemedy(closed, moved);
    AssemblyOptions options;
    options.max_iterations = 50;  // of the starts, none closes
    const AssemblyResult start = closeConfiguration(model, q, options);
    REQUIRE(start.status == NumericalStatus::NotClosed);
    const std::vector<LoopConflict> conflicts = findLoopConflicts(model, start.q);
    REQUIRE(conflicts.size() == 1);
    REQUIRE(!conflicts[0].remedies.empty());
    const LoopRemedy& least = conflicts[0].remedies[0];
    const double turn = log3(moved.change.R).norm(), length = calcTypicalLength(model, {0});
    CHECK(least.size <= moved.change.p.norm() + length * turn + 1e-9);
    const Model again = applyRemedy(model, least);
    CHECK(findLoopConflicts(again, conflicts[0].q).empty());
    ++open;
  }
  CHECK(open == 12);
}

TEST_CASE("conflicts: belts that disagree are closed by an offset") {
  ModelBuilder builder("belted");
  for (const std::string name : {"a", "b", "c"})
    builder.addLink(name, "world", makeHinge("j_" + name, {0.3, 0, 0}), makeUnitInertia());
  builder.addCoupler("belt", {{"j_a", 1}, {"j_b", -2}}, 0.5);
  builder.addCoupler("free", {{"j_a", 1}, {"j_c", 1}}, 1);
  builder.addCoupler("twin", {{"j_a", 2}, {"j_b", -4}}, 1.2);
  const Model model = builder.build();
  const std::vector<LoopConflict> conflicts = findLoopConflicts(model, model.makeNeutral());
  REQUIRE(conflicts.size() == 1);
  CHECK(listNames(model, conflicts[0]) == std::vector<std::string>{"belt", "twin"});
  // The offset of the second should be twice that of the first; or that of the first half of it.
  REQUIRE(conflicts[0].remedies.size() == 2);
  CHECK(conflicts[0].remedies[0].place.index == 0);
  CHECK(conflicts[0].remedies[0].offset == Approx(0.1).epsilon(1e-9));
  CHECK(conflicts[0].remedies[1].place.index == 2);
  CHECK(conflicts[0].remedies[1].offset == Approx(-0.2).epsilon(1e-9));
  checkRemedies(model, conflicts[0]);
  CHECK_THAT(describeRemedies(model, conflicts[0]), Catch::Contains("the offset of coupler 'belt' by 0.1"));
}

TEST_CASE("conflicts: derivatives of residuals by configuration and by a change of any place") {
  std::mt19937 rng(8);
  for (const ClosureKind kind : kClosureKinds) {
    Mechanism mechanism = makeBeltedMechanism(rng, JointKind::Revolute, kind, MechanismBase::Fixed, false);
    const Model& model = mechanism.model;
    LoopPoint z{model.integrate(mechanism.q_closed, randomVector(rng, model.nv(), 0.1)), {}, 0};
    const auto check = [&](Change change, const ModelPlace& place) {
      CAPTURE(getName(kind), static_cast<int>(change), static_cast<int>(place.kind), place.index);
      z.change = {}, z.offset = 0;
      if (change == Change::Translation) z.change.p = randomVector(rng, 3, 0.1);
      if (change == Change::Rotation) z.change.R = exp3(randomVector(rng, 3, 0.1));
      if (change == Change::Offset) z.offset = 0.1;
      LoopProblem problem(model, 0.7, change, place);
      MatrixXd J = problem.calcJacobian(z), differences(J.rows(), J.cols());
      const double h = 1e-5;
      for (Eigen::Index k = 0; k < J.cols(); ++k) {
        const VectorXd step = h * VectorXd::Unit(J.cols(), k);
        differences.col(k) =
            (problem.calcResidual(problem.move(z, step)) - problem.calcResidual(problem.move(z, -step))) / (2 * h);
      }
      CHECK(calcRelativeError(J, differences) < 1e-8);
      Eigen::Index row = 0, col = 0;
      J.cwiseAbs().maxCoeff(&row, &col);
      J(row, col) *= 1.001;
      CHECK(calcRelativeError(J, differences) > 1e-4);
    };
    for (const Change change : {Change::Translation, Change::Rotation}) {
      check(change, {ModelPlace::Kind::Joint, 3});
      if (kind == ClosureKind::Coupler) continue;
      check(change, {ModelPlace::Kind::Frame1, 0});
      check(change, {ModelPlace::Kind::Frame2, 0});
    }
    check(Change::Offset, {ModelPlace::Kind::Offset, 1});
    if (kind == ClosureKind::Distance) check(Change::Offset, {ModelPlace::Kind::Offset, 0});
  }
}

TEST_CASE("conflicts: two dyads among many on one bar of a robot of 51 joints") {
  const Vector3d tip(0.2, 0, 0);
  std::vector<Dyad> dyads;
  for (int i = 0; i < 23; ++i) {
    const double turn = 2 * 3.14159265358979323846 * i / 23;
    dyads.push_back({std::to_string(i), tip / 2, tip / 2 + 0.1 * Vector3d(std::cos(turn), 0, std::sin(turn))});
  }
  dyads.insert(dyads.begin() + 7, {"up", tip, {0.2, 0, 0.4}});
  dyads.insert(dyads.begin() + 15, {"down", tip, {0.2, 0, -0.4}});
  const Model model = makeSharedBar(dyads);
  REQUIRE(model.nv() == 51);
  REQUIRE(model.clusters().size() == 1);
  const std::vector<LoopConflict> conflicts = findLoopConflicts(model, model.makeNeutral());
  REQUIRE(conflicts.size() == 1);
  CHECK(listNames(model, conflicts[0]) == std::vector<std::string>{"rod_up", "rod_down"});
  REQUIRE(conflicts[0].remedies.size() == 3);
  for (const LoopRemedy& remedy : conflicts[0].remedies) CHECK(remedy.size < calcMissingReach() + 1e-9);
}

TEST_CASE("conflicts: robots that close have none, from closed and from far starts") {
  for (const char* name : {"bipetto", "fourbar", "fivebar", "delta", "belt_biped"}) {
    CAPTURE(name);
    const Model model = loadRobot(std::string(BIELLE_SOURCE_DIR) + "/robots/" + name).model;
    CHECK(findLoopConflicts(model, findClosedConfiguration(model).q).empty());
    CHECK(findLoopConflicts(model, model.makeNeutral()).empty());
  }
}

TEST_CASE("conflicts: a hinge whose axes are opposite is named with its angle, alone and beside other loops") {
  const auto make = [](bool turned, double off) {
    Mechanism mechanism = makePlanarFourBar(0.4, 0.15, 0.35, 0.3, 1);
    ModelParts parts = takeParts(mechanism.model);
    REQUIRE(parts.closures.size() == 1);
    Closure& closure = parts.closures[0];
    closure.kind = ClosureKind::Hinge5D;
    closure.axis = closure.X_B1.R.transpose() * Vector3d::UnitY();
    if (turned) closure.X_B2.R = closure.X_B2.R * makeAxisRotation(makePlaneBasis(closure.axis).col(1), kPi - off);
    return ModelBuilder::restore(std::move(parts));
  };
  CHECK(findClosedConfiguration(make(false, 0)).status == NumericalStatus::Ok);
  for (const double off : {0.0, 1e-15, 1e-13, 1e-12}) {
    CAPTURE(off);
    const Model model = make(true, off);
    const AssemblyResult open = findClosedConfiguration(model);
    CHECK(open.status == NumericalStatus::NotClosed);
    Workspace ws(model);
    updatePositions(model, ws, open.q);
    CHECK(calcClosureGap(ws, model.closures()[0]).angle == Approx(kPi).epsilon(1e-9));
    const InputError error = makeClosingError(model, "robot.urdf", open);
    CHECK_THAT(error.problem(), Catch::Contains("3.14159 rad: its axes point in opposite directions"));
    CHECK_THAT(error.remedy(), Catch::Contains("turn frame '") && Catch::Contains("by pi"));
  }
}

TEST_CASE("gaps: what is not a number is never the smaller one") {
  const Model model = makePlanarFourBar(0.4, 0.15, 0.35, 0.3, 1).model;
  Workspace ws(model);
  updatePositions(model, ws, VectorXd::Constant(model.nq(), std::numeric_limits<double>::quiet_NaN()));
  std::string worst;
  CHECK(std::isnan(calcLargestGap(ws, makeConstraintSet(model), &worst)));
  CHECK(worst == "loop");
}
