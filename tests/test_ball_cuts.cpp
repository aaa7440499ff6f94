// Models cut at their balls are the same mechanisms: at closed states, and under the same torques, their joints have the same
// accelerations as those of the model with welds.
#include <catch2/catch.hpp>
#include <functional>
#include <random>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/ball_cuts.h"
#include "bielle/dynamics/constrained.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/model/builder.h"
#include "bielle/motion/serial_model.h"
#include "mechanisms.h"
#include "model/ball_leaf.h"
#include "own_robots.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

struct ClosedState {
  VectorXd q, v;
};

// Near a closed configuration.
ClosedState drawState(const Model& model, const VectorXd& q_closed, std::mt19937& rng) {
  AssemblyProblem problem;
  problem.q_ref = model.integrate(q_closed, randomVector(rng, model.nv(), 0.05));
  const AssemblyResult closed = assemble(model, problem);
  REQUIRE(closed.status == NumericalStatus::Ok);
  Workspace ws(model);
  return {closed.q, projectVelocity(model, ws, makeConstraintSet(model), closed.q, randomVector(rng, model.nv()))};
}

VectorXd calcAcceleration(const Model& model, const VectorXd& q, const VectorXd& v, const VectorXd& tau) {
  Workspace ws(model);
  ConstrainedWorkspace cws;
  REQUIRE(updateConstrainedDynamics(model, ws, cws, makeConstraintSet(model), q, v, tau) == NumericalStatus::Ok);
  return cws.a;
}

// The largest difference of accelerations, relative to the largest acceleration.
double compare(const Model& model, const Model& cut, const VectorXd& q_closed) {
  std::mt19937 rng(1);
  double worst = 0;
  for (int trial = 0; trial < 5; ++trial) {
    const ClosedState state = drawState(model, q_closed, rng);
    const VectorXd tau_cut = randomVector(rng, cut.nv(), 10);
    VectorXd tau = VectorXd::Zero(model.nv());
    const std::vector<int> dofs = findRestrictedDofs(model, cut);
    for (int i = 0; i < cut.nv(); ++i) tau[dofs[i]] = tau_cut[i];
    const VectorXd q = restrictConfiguration(model, cut, state.q), v = restrictVelocity(model, cut, state.v);
    Workspace ws(cut);
    updatePositions(cut, ws, q);
    CHECK(calcLargestGap(ws, makeConstraintSet(cut)) < 1e-11);
    const VectorXd expected = restrictVelocity(model, cut, calcAcceleration(model, state.q, state.v, tau));
    const VectorXd found = calcAcceleration(cut, q, v, tau_cut);
    worst = std::max(worst, (found - expected).cwiseAbs().maxCoeff() / expected.cwiseAbs().maxCoeff());
  }
  return worst;
}

VectorXd findClosed(const Model& model) {
  const AssemblyResult closed = findClosedConfiguration(model);
  REQUIRE(closed.status == NumericalStatus::Ok);
  return closed.q;
}

Model change(const Model& model, const std::function<void(ModelParts&)>& edit) {
  ModelParts parts = takeParts(model);
  edit(parts);
  return ModelBuilder::restore(std::move(parts));
}

int findLeaf(const Model& model) {
  const int leaf = findBallLeaf(model, model.closures(), model.closures()[0], {});
  REQUIRE(leaf > 0);
  return leaf;
}

}  // namespace

TEST_CASE("ball cuts: six rods of Bipetto lose 18 coordinates and rows, and its joints have the same accelerations") {
  const Model& model = getBipetto();
  const Model cut = cutAtBalls(model);
  CHECK(cut.nv() == 36);
  CHECK(cut.numClosureRows() == 18);
  CHECK(cut.nu() == model.nu());
  CHECK(cut.mass() == Approx(model.mass()).epsilon(1e-14));
  CHECK(cut.contacts().size() == 2);
  for (size_t i = 0; i < model.closures().size(); ++i) CHECK(cut.closures()[i].name == model.closures()[i].name);
  CHECK(cutAtBalls(cut).isCopyOf(cut));  // nothing is left to do
  const VectorXd closed = findClosed(model);
  CHECK(compare(model, cut, closed) < 1e-9);
  // It stands as the model does, all cranks on the same side; where the base is preferred to be counts a little, too.
  const VectorXd stands = assembleReference(model, "half_sitting").q;
  CHECK((assembleReference(cut, "half_sitting").q - restrictConfiguration(model, cut, stands)).norm() < 1e-4);
  // Half a per cent of the mass of one rod shows.
  const int rod = cut.closures()[0].body1;
  const Model heavier = change(cut, [rod](ModelParts& parts) { parts.bodies[rod].inertia.mass *= 1.005; });
  CHECK(compare(model, heavier, closed) > 1e-7);
}

TEST_CASE("ball cuts: whichever side the leaf is on, with springs, frames and visuals on it") {
  const Model& bipetto = getBipetto();
  const int leaf = findLeaf(bipetto);
  const Model model = change(bipetto, [leaf](ModelParts& parts) {
    PointSpring spring;
    spring.name = "coil";
    spring.body1 = 1, spring.body2 = leaf;
    spring.point2 = {0.02, 0.01, 0.03};
    spring.stiffness = 500, spring.damping = 3, spring.rest = 0.1;
    parts.point_springs.push_back(spring);
    spring.name = "within the rod";  // whose ends do not move against each other
    spring.body1 = parts.closures[0].body1;
    parts.point_springs.push_back(spring);
    parts.frames.push_back({"mark", leaf, {Matrix3d::Identity(), Vector3d(0.1, 0, 0)}});
    Closure& first = parts.closures[0];
    std::swap(first.body1, first.body2);
    std::swap(first.X_B1, first.X_B2);
  });
  const Model cut = cutAtBalls(model);
  CHECK(cut.nv() == 36);
  CHECK(compare(model, cut, findClosed(model)) < 1e-9);
  CHECK(cut.visuals().size() == model.visuals().size());
  CHECK(cut.pointSprings().size() == 1);
  const Frame& mark = cut.frames()[cut.findFrame("mark")];
  CHECK(cut.bodies()[mark.body].name == model.bodies()[model.closures()[0].body2].name);
  const Model moved = change(cut, [](ModelParts& parts) { parts.point_springs[0].point2.x() += 0.01; });
  CHECK(compare(model, moved, findClosed(model)) > 1e-6);
}

TEST_CASE("ball cuts: leaves that do something of their own stay") {
  const Model& model = getBipetto();
  const int leaf = findLeaf(model), dof = model.joints()[leaf].idx_v;
  const std::vector<std::function<void(ModelParts&)>> edits = {
      [=](ModelParts& parts) { parts.armature[dof] = 1e-3; },
      [=](ModelParts& parts) { parts.upper_limits[dof + 1] = 1; },
      [=](ModelParts& parts) { parts.velocity_limits[dof + 2] = 1; },
      [=](ModelParts& parts) {
        parts.contacts.push_back({"tip", leaf, {}, ContactKind::Point3D});
      },
      [=](ModelParts& parts) { parts.closures[0].kind = ClosureKind::Ball3D; }};
  for (const auto& edit : edits) {
    const Model other = change(model, edit), cut = cutAtBalls(other);
    CHECK(cut.nv() == 39);
    CHECK(cut.findJoint(model.joints()[leaf].name) > 0);
  }
  const Model fourbar = loadOwn("fourbar").model;
  CHECK(cutAtBalls(fourbar).isCopyOf(fourbar));
}
