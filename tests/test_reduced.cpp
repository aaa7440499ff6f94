// The reduced formulation. Oracles: central differences of the step itself in the tangent space of closed states, the
// full formulation's accelerations, closing errors.
#include <catch2/catch.hpp>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/model/builder.h"
#include "bielle/motion/motion.h"
#include "bielle/ocp/robot_problem.h"
#include "bielle/robots/robot_loader.h"
#include "check_derivative.h"
#include "dynamics/reduction.h"
#include "mechanisms.h"
#include "problem_probe.h"
#include "selection.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

// A stage with every cost that has a meaning on a mechanism with these contacts, and a terminal node with the kinematic
// ones.
std::vector<StageSpec> makeStages(const Model& model, const std::vector<ContactTarget>& contacts, const VectorXd& q_ref,
                                  std::mt19937& rng, StageKind kind = StageKind::Dynamics,
                                  StepRule rule = StepRule::Euler) {
  std::vector<StageSpec> stages(2);
  for (size_t k = 0; k < 2; ++k) {
    StageSpec& stage = stages[k];
    stage.step = rule;
    stage.dt = 0.01;
    if (k == 0 && kind == StageKind::Impact) {
      stage.kind = kind;
      stage.dt = 0;
    }
    if (k == 0) stage.constraints = makeConstraintSet(model, contacts);
    if (!model.jointForces().empty()) stage.armature = randomVector(rng, model.nv()).cwiseAbs();
    stage.state = {0.7, q_ref, randomVector(rng, model.nv()), randomVector(rng, 2 * model.nv()).cwiseAbs()};
    stage.control = {0.3, randomVector(rng, model.nu()), VectorXd::Ones(model.nu())};
    stage.costs.push_back({"com", 2, Activation::makeQuadratic(Vector3d(1, 2, 3)), makeComPosition(Vector3d(1, 0, 2))});
    stage.costs.push_back(
        {"com velocity", 2, Activation::makeQuadratic(Vector3d(1, 2, 3)), makeComVelocity(Vector3d(1, 0, 2))});
    const BodyFrame frame{model.numBodies() - 1, randomPlacement(rng)};
    stage.costs.push_back(
        {"frame velocity", 0.5, Activation::makeQuadratic(VectorXd::Ones(6)), makeFrameVelocity(frame)});
    if (k > 0) continue;
    for (size_t c = 0; c < contacts.size(); ++c) {
      const int index = stage.constraints.num_loops + static_cast<int>(c);
      const int rows = getRows(stage.constraints.closures[index].kind);
      stage.costs.push_back({"force", 1e-2, Activation::makeQuadratic(VectorXd::Ones(rows)),
                             makeContactForce(stage.constraints, index, VectorXd::Ones(rows))});
    }
  }
  return stages;
}

struct State {
  VectorXd q, v;
  VectorXd x() const {
    VectorXd out(q.size() + v.size());
    out << q, v;
    return out;
  }
};

// A closed state near q with a random velocity that keeps it closed.
State makeClosedState(const Model& model, const VectorXd& q, double distance, double speed, std::mt19937& rng) {
  const AssemblyResult result = closeConfiguration(model, model.integrate(q, randomVector(rng, model.nv(), distance)));
  REQUIRE(result.status == NumericalStatus::Ok);
  Workspace ws(model);
  return {result.q,
          projectVelocity(model, ws, makeConstraintSet(model), result.q, randomVector(rng, model.nv(), speed))};
}

double calcGap(const Model& model, const VectorXd& x) {
  Workspace ws(model);
  updatePositions(model, ws, x.head(model.nq()));
  return calcLargestGap(ws, makeConstraintSet(model));
}

// Largest closure velocity of a state.
double calcClosureSpeed(const Model& model, const VectorXd& x) {
  Workspace ws(model);
  return (x.tail(model.nv()) -
          projectVelocity(model, ws, makeConstraintSet(model), x.head(model.nq()), x.tail(model.nv())))
      .cwiseAbs()
      .maxCoeff();
}

// Every block of the linearization of stage 0 about (state, u) against differences of the step, with a node state some
// way off.
void checkLinearization(const Model& model, const std::vector<ContactTarget>& contacts, const State& state,
                        const VectorXd& x_node, std::mt19937& rng, StageKind kind = StageKind::Dynamics,
                        Formulation formulation = Formulation::Reduced, StepRule rule = StepRule::Euler) {
  const bool reduced = formulation == Formulation::Reduced;
  const RobotProblem whole(model, state.q, state.v, makeStages(model, contacts, state.q, rng, kind, rule), formulation);
  ProblemProbe problem(whole);
  const VectorXd x = state.x(), u = randomVector(rng, model.nu(), 5);
  const int ndx = problem.tangentSize(0);
  StageModel stage;
  REQUIRE(problem.linearize(0, x, u, x_node, stage) == NumericalStatus::Ok);
  const StageModel linear = stage;
  const auto step = [&](const VectorXd& at, const VectorXd& control) {
    VectorXd x_next(x.size()), out(ndx + 1);
    double cost = 0;
    REQUIRE(problem.step(0, at, control, x_next, cost) == NumericalStatus::Ok);
    if (reduced) CHECK(calcGap(model, x_next) < 1e-10);
    if (reduced) CHECK(calcClosureSpeed(model, x_next) < 1e-9);
    out << problem.difference(x_node, x_next), cost;
    return out;
  };
  const VectorXd at_x = step(x, u);
  CHECK((at_x.head(ndx) - linear.gap).cwiseAbs().maxCoeff() < 1e-10);
  const auto along = [&](const VectorXd& dx) {
    const VectorXd moved = problem.integrate(x, dx);
    if (reduced) CHECK(calcGap(model, moved) < 1e-10);
    CHECK((problem.difference(x, moved) - dx).cwiseAbs().maxCoeff() < 1e-9);
    return step(moved, u);
  };
  const MatrixXd dx = differentiate(VectorXd::Zero(ndx), 1e-4, along);
  checkDerivative(linear.Fx(), dx.topRows(ndx));
  checkDerivative(linear.lx.transpose(), dx.bottomRows(1));
  const MatrixXd du = differentiate(u, 1e-2, [&](const VectorXd& control) { return step(x, control); });
  if (kind == StageKind::Impact)
    CHECK(linear.Fu().isZero(0));
  else
    checkDerivative(linear.Fu(), du.topRows(ndx));
  checkDerivative(linear.lu.transpose(), du.bottomRows(1));
}

}  // namespace

TEST_CASE("reduced step: random mechanisms, every joint kind times every closure kind", "[sweep]") {
  const StepRule rule = GENERATE(StepRule::Euler, StepRule::Midpoint);
  std::mt19937 rng(11);
  Selection selection(5);
  for (const MechanismKind& kind : listMechanismKinds()) {
    if (selection.isLeftOut()) continue;
    CAPTURE(getName(rule), kind);
    const Mechanism mechanism = makeRandomMechanism(rng, kind.joint, kind.closure, kind.base);
    const Model& model = mechanism.model;
    std::vector<ContactTarget> contacts;
    if (kind.base == MechanismBase::FreeFlyer) contacts = {{1, {}, 0, 10}};
    const State state = makeClosedState(model, mechanism.q_closed, 0, 1, rng);
    const RobotProblem whole(model, state.q, state.v,
                             makeStages(model, contacts, state.q, rng, StageKind::Dynamics, rule),
                             Formulation::Reduced);
    ProblemProbe problem(whole);
    VectorXd x_next(state.x().size());
    double cost = 0;
    REQUIRE(problem.step(0, state.x(), VectorXd::Zero(model.nu()), x_next, cost) == NumericalStatus::Ok);
    checkLinearization(model, contacts, state, x_next, rng, StageKind::Dynamics, Formulation::Reduced, rule);
    const State node = makeClosedState(model, x_next.head(model.nq()), 0.05, 1, rng);
    checkLinearization(model, contacts, state, node.x(), rng, StageKind::Dynamics, Formulation::Reduced, rule);
  }
}

TEST_CASE("reduced step: springs, dampers and friction on joints in and outside loops, and between points of both",
          "[sweep]") {
  const StepRule rule = GENERATE(StepRule::Euler, StepRule::Midpoint);
  std::mt19937 rng(17);
  Selection selection;
  for (JointKind kind : kJointKinds)
    for (ClosureKind closure : {ClosureKind::Ball3D, ClosureKind::Coupler}) {
      if (selection.isLeftOut()) continue;
      CAPTURE(getName(rule), getName(kind), getName(closure));
      const Mechanism mechanism = makeSprungMechanism(rng, kind, closure, MechanismBase::FreeFlyer);
      const Model& model = mechanism.model;
      const State state = makeClosedState(model, mechanism.q_closed, 0, 1, rng);
      const State node = makeClosedState(model, mechanism.q_closed, 0.05, 1, rng);
      checkLinearization(model, {{1, {}, 0, 10}}, state, node.x(), rng, StageKind::Dynamics, Formulation::Reduced,
                         rule);
    }
}

TEST_CASE("steps: with an armature of h^2 k / 4 a step of any length takes a spring implicitly, in both formulations") {
  constexpr double kMass = 2, kStiffness = 800, kLength = 0.3;  // h omega = 6
  ModelBuilder builder("oscillator");
  Joint slide;
  slide.name = "slide";
  slide.kind = JointKind::Prismatic;
  slide.axis = Vector3d::UnitX();
  builder.addLink("mass", "world", slide, {kMass, Vector3d::Zero(), Matrix3d::Identity()});
  builder.addMotor("slide");
  JointForce spring;
  spring.stiffness = kStiffness;
  builder.addJointForce("slide", spring);
  const Model model = builder.build();
  const auto calcEnergy = [&](const VectorXd& x) { return 0.5 * (kStiffness * x[0] * x[0] + kMass * x[1] * x[1]); };
  for (Formulation formulation : {Formulation::Full, Formulation::Reduced})
    for (bool implicit : {true, false}) {
      CAPTURE(getName(formulation), implicit);
      std::vector<StageSpec> stages(2);
      stages[0].step = StepRule::Midpoint;
      stages[0].dt = kLength;
      if (implicit) stages[0].armature = VectorXd::Constant(1, kLength * kLength * kStiffness / 4);
      const RobotProblem whole(model, VectorXd::Zero(1), VectorXd::Zero(1), std::move(stages), formulation);
      ProblemProbe problem(whole);
      VectorXd x = Eigen::Vector2d(0.1, -0.4), next(2);
      const double energy = calcEnergy(x);
      for (int i = 0; i < 5; ++i) {
        double cost = 0;
        REQUIRE(problem.step(0, x, VectorXd::Zero(1), next, cost) == NumericalStatus::Ok);
        const double force = -kStiffness * (x[0] + next[0]) / 2;
        if (implicit) CHECK(next[1] == Approx(x[1] + kLength * force / kMass).margin(1e-12));
        CHECK(next[0] == Approx(x[0] + kLength * (x[1] + next[1]) / 2).margin(1e-12));
        x = next;
      }
      if (implicit)
        CHECK(calcEnergy(x) == Approx(energy).epsilon(1e-12));
      else
        CHECK(calcEnergy(x) > 1e6 * energy);
    }
}

TEST_CASE("reduced step: couplers in the loops of other closures", "[sweep]") {
  const StepRule rule = GENERATE(StepRule::Euler, StepRule::Midpoint);
  std::mt19937 rng(18);
  Selection selection(5);
  for (JointKind kind : kJointKinds)
    for (ClosureKind closure : kClosureKinds)
      for (bool repeated : {false, true}) {
        if (selection.isLeftOut()) continue;
        CAPTURE(getName(rule), getName(kind), getName(closure), repeated);
        const Mechanism mechanism = makeBeltedMechanism(rng, kind, closure, MechanismBase::FreeFlyer, repeated);
        const Model& model = mechanism.model;
        const State state = makeClosedState(model, mechanism.q_closed, 0, 1, rng);
        const State node = makeClosedState(model, mechanism.q_closed, 0.05, 1, rng);
        checkLinearization(model, {{1, {}, 0, 10}}, state, node.x(), rng, StageKind::Dynamics, Formulation::Reduced,
                           rule);
      }
}

TEST_CASE("reduced step: polynomials in couplers, with and without other loops") {
  const StepRule rule = GENERATE(StepRule::Euler, StepRule::Midpoint);
  std::mt19937 rng(19);
  Selection selection(1);
  for (JointKind kind : {JointKind::Revolute, JointKind::Prismatic, JointKind::Spherical})
    for (ClosureKind closure : {ClosureKind::Hinge5D, ClosureKind::Coupler}) {
      if (selection.isLeftOut()) continue;
      CAPTURE(getName(rule), getName(kind), getName(closure));
      const Mechanism mechanism = makeCammedMechanism(rng, kind, closure, MechanismBase::FreeFlyer);
      const Model& model = mechanism.model;
      const State state = makeClosedState(model, mechanism.q_closed, 0, 1, rng);
      const State node = makeClosedState(model, mechanism.q_closed, 0.05, 1, rng);
      checkLinearization(model, {{1, {}, 0, 10}}, state, node.x(), rng, StageKind::Dynamics, Formulation::Reduced,
                         rule);
      checkLinearization(model, {{1, {}, 0, 10}}, state, node.x(), rng, StageKind::Impact, Formulation::Reduced);
    }
}

TEST_CASE("reduced step: Bipetto, four-bar, five-bar, redundant planar four-bar", "[sweep]") {
  const StepRule rule = GENERATE(StepRule::Euler, StepRule::Midpoint);
  std::mt19937 rng(12);
  Selection selection(2);
  for (const std::string name : {"bipetto", "fourbar", "fivebar", "planar"}) {
    if (selection.isLeftOut()) continue;
    CAPTURE(getName(rule), name);
    Mechanism mechanism;
    if (name == "planar") {
      mechanism = makePlanarFourBar(1, 0.4, 0.9, 0.8, 0.7);
    } else {
      mechanism.model = loadRobot(name).model;
      mechanism.q_closed = makeStandingPosture(mechanism.model);
    }
    const Model& model = mechanism.model;
    std::vector<ContactTarget> contacts;
    if (name == "bipetto") contacts = makeContactTargets(model, mechanism.q_closed, {0, 1}, 500, 100);
    for (double distance : {0.0, 0.05}) {
      const State state = makeClosedState(model, mechanism.q_closed, distance, 1, rng);
      const State node = makeClosedState(model, mechanism.q_closed, distance + 0.02, 1, rng);
      checkLinearization(model, contacts, state, node.x(), rng, StageKind::Dynamics, Formulation::Reduced, rule);
    }
  }
}

namespace {

// The parameters of bipeds of every hip, knee and ankle.
std::vector<OptionSet> listLegBipeds() {
  std::vector<OptionSet> bipeds;
  OptionSet parameters = findGenerator("leg_biped").parameters;
  const OptionSet all = parameters;
  for (const std::string& hip : all.get("hip").choices)
    for (const std::string& knee : all.get("knee").choices)
      for (const std::string& ankle : all.get("ankle").choices) {
        parameters.set("hip", hip);
        parameters.set("knee", knee);
        parameters.set("ankle", ankle);
        bipeds.push_back(parameters);
      }
  return bipeds;
}

}  // namespace

TEST_CASE("reduced step: combinations of the parts of leg_biped", "[sweep]") {
  std::mt19937 rng(19);
  const Generator& generator = findGenerator("leg_biped");
  const std::vector<OptionSet> bipeds = listLegBipeds();
  Selection selection;
  for (size_t i = 0; i < bipeds.size();
       i += 7) {  // every hip, knee and ankle has its turns: 7 divides none of their numbers
    if (selection.isLeftOut()) continue;
    const Model model = generator.make(bipeds[i]);
    CAPTURE(model.findMotor("motor_hip1_left"), model.findMotor("motor_knee_left"),
            model.findMotor("motor_ankle1_left"));
    const VectorXd standing = makeStandingPosture(model);
    const State state = makeClosedState(model, standing, 0.05, 1, rng);
    const State node = makeClosedState(model, state.q, 0.02, 1, rng);
    checkLinearization(model, makeContactTargets(model, standing, {0, 1}, 500, 100), state, node.x(), rng);
  }
}

TEST_CASE("impact stages, in both formulations: random mechanisms and Bipetto, with and without a gap", "[sweep]") {
  std::mt19937 rng(14);
  std::vector<Mechanism> mechanisms;
  for (JointKind kind : {JointKind::Spherical, JointKind::Universal, JointKind::Planar})
    for (ClosureKind closure : kClosureKinds)
      mechanisms.push_back(makeRandomMechanism(rng, kind, closure, MechanismBase::FreeFlyer));
  mechanisms.emplace_back();
  mechanisms.back().model = loadRobot("bipetto").model;
  mechanisms.back().q_closed = makeStandingPosture(mechanisms.back().model);
  Selection selection;
  for (const Mechanism& mechanism : mechanisms)
    for (const Formulation formulation : {Formulation::Full, Formulation::Reduced}) {
      if (selection.isLeftOut()) continue;
      const Model& model = mechanism.model;
      CAPTURE(model.name(), getName(formulation));
      const std::vector<ContactTarget> contacts = {{1, {}, 0, 10}};
      const State state = makeClosedState(model, mechanism.q_closed, 0, 1, rng);
      const RobotProblem whole(model, state.q, state.v, makeStages(model, contacts, state.q, rng, StageKind::Impact),
                               formulation);
      ProblemProbe problem(whole);
      VectorXd x_next(state.x().size());
      double cost = 0;
      REQUIRE(problem.step(0, state.x(), VectorXd::Zero(model.nu()), x_next, cost) == NumericalStatus::Ok);
      CHECK(x_next.head(model.nq()) == state.q);
      Workspace ws(model);
      const VectorXd v_next = x_next.tail(model.nv());
      CHECK((v_next - projectVelocity(model, ws, makeConstraintSet(model, contacts), state.q, v_next)).norm() < 1e-9);
      CHECK((v_next - state.v).norm() > 1e-2);
      checkLinearization(model, contacts, state, x_next, rng, StageKind::Impact, formulation);
      const State node = makeClosedState(model, state.q, 0.05, 1, rng);
      checkLinearization(model, contacts, state, node.x(), rng, StageKind::Impact, formulation);
    }
}

TEST_CASE("reduced accelerations are those of the full formulation", "[sweep]") {
  std::mt19937 rng(13);
  const Generator& generator = findGenerator("leg_biped");
  const std::vector<OptionSet> bipeds = listLegBipeds();
  Selection selection(12);
  for (size_t i = 0; i <= bipeds.size(); ++i) {
    if (selection.isLeftOut()) continue;
    const Model model = i < bipeds.size() ? generator.make(bipeds[i]) : loadRobot("bipetto").model;
    const State state = makeClosedState(model, makeStandingPosture(model), 0.05, 1, rng);
    const std::vector<ContactTarget> contacts = {{0, {}, 0, 0}, {1, {}, 0, 0}};
    const double h = 1e-5;
    std::vector<StageSpec> stages = makeStages(model, contacts, state.q, rng);
    for (StageSpec& stage : stages) stage.dt = h;
    const RobotProblem whole(model, state.q, state.v, std::move(stages), Formulation::Reduced);
    ProblemProbe problem(whole);
    const VectorXd u = randomVector(rng, model.nu(), 5);
    VectorXd x_next(state.x().size()), a, lambda;
    double cost = 0;
    REQUIRE(problem.step(0, state.x(), u, x_next, cost) == NumericalStatus::Ok);
    REQUIRE(problem.calcDynamics(0, state.x(), u, a, lambda) == NumericalStatus::Ok);
    // The projection moves the velocity by O(h^2), the acceleration seen by O(h).
    CHECK(((x_next.tail(model.nv()) - state.v) / h - a).norm() < 1e-2 * a.norm());
  }
}
