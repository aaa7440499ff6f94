// Random mechanisms with random, mostly unreasonable numbers: singular starts, loops that cannot close, motors and
// links without mass, extreme speeds and gains, time steps from 0 to 10^6 s, one node or ten thousand. Every outcome
// has a status, without NaN under a good one; rejections are InputErrors.
#include <catch2/catch.hpp>
#include <iostream>
#include <map>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/impact.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/model/error.h"
#include "bielle/motion/jump.h"
#include "bielle/motion/record.h"
#include "bielle/motion/squat.h"
#include "bielle/motion/stairs.h"
#include "bielle/motion/walk.h"
#include "bielle/robots/fourbar_chain.h"
#include "bielle/robots/robot_loader.h"
#include "change_option.h"
#include "infinity.h"
#include "mechanisms.h"
#include "solve_in_place.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

using Random = std::mt19937;

int choose(Random& rng, int count) { return std::uniform_int_distribution<int>(0, count - 1)(rng); }
template <typename T>
T pick(Random& rng, std::initializer_list<T> values) {
  return values.begin()[choose(rng, static_cast<int>(values.size()))];
}

Mechanism makeMechanism(Random& rng, MechanismBase base) {
  const JointKind joint = pick(
      rng, {JointKind::Revolute, JointKind::Prismatic, JointKind::Spherical, JointKind::Universal, JointKind::Planar});
  const ClosureKind closure = kClosureKinds[choose(rng, std::size(kClosureKinds))];
  const double kp = pick(rng, {0.0, 0.0, 100.0, 1e12}), kd = pick(rng, {0.0, 0.0, 20.0, 1e12});
  return makeRandomMechanism(rng, joint, closure, base, kp, kd);
}

MechanismBase pickBase(Random& rng) { return pick(rng, {MechanismBase::Fixed, MechanismBase::FreeFlyer}); }

bool areFinite(const std::vector<VectorXd>& vectors) {
  return std::all_of(vectors.begin(), vectors.end(), [](const VectorXd& x) { return x.allFinite(); });
}

}  // namespace

TEST_CASE("dynamics and derivatives: finite, or a status that says they are not") {
  std::map<NumericalStatus, int> count;
  for (unsigned seed = 0; seed < 1500; ++seed) {
    Random rng(seed);
    const Mechanism mechanism = makeMechanism(rng, pickBase(rng));
    const Model& model = mechanism.model;
    const double away = pick(rng, {0.0, 0.0, 1e-9, 0.3, 1e4, 1e12, 1e200});
    const VectorXd q = model.integrate(mechanism.q_closed, randomVector(rng, model.nv(), away));
    const double speed = pick(rng, {0.0, 1.0, 1e-200, 1e8, 1e100, 1e200, 1e308, kInf});
    const VectorXd v = randomVector(rng, model.nv()) * speed;
    const VectorXd tau = randomVector(rng, model.nv()) * pick(rng, {0.0, 1.0, 1e20, 1e300, kInf});
    std::vector<ContactTarget> contacts;
    if (choose(rng, 2)) contacts.push_back({choose(rng, 2), {}, pick(rng, {0.0, 1e12}), pick(rng, {0.0, 1e12})});
    CAPTURE(seed, away, speed);
    Workspace ws(model);
    ConstrainedWorkspace cws;
    const ConstraintSet constraints = makeConstraintSet(model, contacts);
    const NumericalStatus status = updateConstrainedDynamics(model, ws, cws, constraints, q, v, tau);
    ++count[status];
    CHECK(std::string(getMessage(status)) != "");
    if (status != NumericalStatus::Ok) continue;
    CHECK(cws.a.allFinite());
    CHECK(cws.lambda.allFinite());
    if (updateConstrainedDerivatives(model, ws, cws, constraints) != NumericalStatus::Ok) continue;
    for (const MatrixXd* m : {&cws.da_dq, &cws.da_dv, &cws.da_du, &cws.dlambda_dq, &cws.dlambda_dv, &cws.dlambda_du})
      CHECK(m->allFinite());
  }
  CHECK(count[NumericalStatus::Ok] > 500);
  CHECK(count[NumericalStatus::NotFinite] > 50);
}

TEST_CASE("links and motors without mass") {
  for (const double mass : {0.0, 1e-300, 1e-12}) {
    for (const double armature : {0.0, 1e-300, 1e-3}) {
      ModelBuilder builder("light");
      Joint joint;
      joint.kind = JointKind::Revolute;
      Inertia inertia;
      inertia.mass = mass;
      inertia.I_com = Matrix3d::Identity() * mass;
      for (const auto& [link, parent] : {std::pair("a", "world"), std::pair("b", "a")}) {
        joint.name = std::string("joint_") + link;
        joint.X_PJ.p = {0.1, 0, 0};
        builder.addLink(link, parent, joint, inertia);
        builder.addMotor(joint.name, armature);
      }
      const Model model = builder.build();
      Workspace ws(model);
      ConstrainedWorkspace cws;
      const VectorXd zero = VectorXd::Zero(2), tau = VectorXd::Ones(2);
      const NumericalStatus status =
          updateConstrainedDynamics(model, ws, cws, makeConstraintSet(model), zero, zero, tau);
      CAPTURE(mass, armature, getMessage(status));
      if (mass == 0 && armature == 0) CHECK(status == NumericalStatus::Singular);
      if (armature == 1e-3) CHECK(status == NumericalStatus::Ok);
      if (status == NumericalStatus::Ok) CHECK(cws.a.allFinite());
    }
  }
}

TEST_CASE("assembling what cannot be assembled") {
  int closed = 0, open = 0;
  for (unsigned seed = 0; seed < 150; ++seed) {
    Random rng(seed);
    const Mechanism mechanism = makeMechanism(rng, pickBase(rng));
    const Model& model = mechanism.model;
    AssemblyProblem problem;
    problem.q_ref =
        model.integrate(mechanism.q_closed, randomVector(rng, model.nv(), pick(rng, {0.01, 1.0, 100.0, 1e8})));
    problem.weights = VectorXd::Constant(model.nv(), pick(rng, {0.0, 1.0, 1e-300, 1e300}));
    if (choose(rng, 3) == 0) {  // out of reach
      FrameTarget target;
      target.name = "far";
      target.body = model.numBodies() - 1;
      target.X_WT.p = randomVector(rng, 3, pick(rng, {1.0, 100.0, 1e12, 1e300}));
      problem.frames.push_back(target);
    }
    AssemblyOptions options;
    options.max_iterations = 40;
    const AssemblyResult result = assemble(model, problem, options);
    CAPTURE(seed, result.message, result.gap);
    CHECK(result.q.size() == model.nq());
    CHECK(result.q.allFinite());
    CHECK_FALSE(result.message.empty());
    if (result.status == NumericalStatus::Ok)
      CHECK(result.gap <= options.tolerance);
    else
      CHECK(result.worst != "");
    ++(result.status == NumericalStatus::Ok ? closed : open);
  }
  CHECK(closed > 20);
  CHECK(open > 20);
  // No triangle has these sides.
  const Model far = makePlanarFourBar(10, 0.1, 0.2, 0.1, 1).model;
  const AssemblyResult result = findClosedConfiguration(far);
  CHECK(result.status == NumericalStatus::NotClosed);
  CHECK(result.gap > 5);
  CHECK(result.q.allFinite());
  // A flattened parallelogram: the loop loses rank there.
  const Mechanism flat = makePlanarFourBar(0.4, 0.2, 0.4, 0.2, 0);
  const Mobility mobility = calcMobility(flat.model, flat.model.makeNeutral());
  CHECK(mobility.rank < 3);
  AssemblyProblem singular;
  singular.q_ref = VectorXd::Zero(4);
  CHECK(assemble(flat.model, singular).q.allFinite());
}

namespace {

// Severity of a problem: half of them are within the range of realistic requests.
enum class Range { Usual, Any };

StageSpec makeStage(Random& rng, Range range, const Model& model, const VectorXd& q0, double dt) {
  const auto weight = [&rng, range] {
    return range == Range::Usual ? pick(rng, {0.1, 1.0, 100.0}) : pick(rng, {0.0, 1e-12, 1.0, 1.0, 1e6, 1e300});
  };
  StageSpec stage;
  stage.dt = dt;
  std::vector<ContactTarget> contacts;
  if (choose(rng, 3) == 0) contacts.push_back({0, {}, 0, pick(rng, {0.0, 1e12})});
  stage.constraints = makeConstraintSet(model, contacts);
  stage.state = {weight(), q0, VectorXd::Zero(model.nv()), VectorXd::Constant(2 * model.nv(), weight())};
  stage.control = {weight(), VectorXd::Zero(model.nu()), VectorXd::Ones(model.nu())};
  if (choose(rng, 2))
    stage.costs.push_back(
        {"com", weight(), Activation::makeQuadratic(Vector3d::Ones()),
         makeComPosition(randomVector(rng, 3, range == Range::Usual ? 1.0 : pick(rng, {1.0, 1e6, 1e200})))});
  if (choose(rng, 3) == 0) stage.effort_limits = VectorXd::Constant(model.nu(), pick(rng, {0.0, 1e-300, 1.0, kInf}));
  return stage;
}

FddpOptions makeHostileOptions(Random& rng) {
  FddpOptions options;
  options.max_iterations = 1 + choose(rng, 8);
  options.threads = 1 + choose(rng, 2);
  options.rollout_segments = 1 + choose(rng, 6);
  options.initial_regularization = options.min_regularization = pick(rng, {1e-9, 1e-300, 1e6});
  options.max_regularization = pick(rng, {1e9, 1e300});
  options.cost_tolerance = pick(rng, {0.0, 1e-13, 1.0});
  return options;
}

}  // namespace

TEST_CASE("optimal control of random mechanisms with random options") {
  std::map<FddpTermination, int> count;
  int refused = 0;
  for (unsigned seed = 0; seed < 400; ++seed) {
    Random rng(seed);
    const Mechanism mechanism = makeMechanism(rng, pickBase(rng));
    const Model& model = mechanism.model;
    const Range range = pick(rng, {Range::Usual, Range::Any});
    const double dt =
        range == Range::Usual ? pick(rng, {1e-3, 0.015}) : pick(rng, {0.0, 1e-12, 1e-3, 0.015, 0.3, 10.0, 1e6});
    const int stages = pick(rng, {1, 1, 2, 5, 20});
    const Formulation formulation = pick(rng, {Formulation::Full, Formulation::Reduced});
    // Sometimes a start that is open, which the reduced formulation refuses.
    const VectorXd q0 =
        choose(rng, 10) ? mechanism.q_closed : model.integrate(mechanism.q_closed, randomVector(rng, model.nv(), 0.3));
    std::vector<StageSpec> specs;
    for (int k = 0; k <= stages; ++k) specs.push_back(makeStage(rng, range, model, q0, dt));
    Motion motion;
    motion.name = "hostile";
    motion.schedule.phases = {{"all", stages, dt, {}}};
    CAPTURE(seed, dt, stages, getName(formulation));
    try {
      motion.problem =
          std::make_unique<RobotProblem>(model, q0, VectorXd::Zero(model.nv()), std::move(specs), formulation);
    } catch (const InputError& error) {
      CHECK(std::string(error.what()) != "");
      ++refused;
      continue;
    }
    ShootingTrajectory trajectory;
    trajectory.xs.assign(stages + 1, motion.problem->initialState());
    trajectory.us.assign(stages, randomVector(rng, model.nu()) *
                                     (range == Range::Usual ? 1.0 : pick(rng, {0.0, 1.0, 1e5, 1e150, 1e300})));
    const FddpSummary summary = test::solveInPlace(*motion.problem, trajectory, makeHostileOptions(rng));
    ++count[summary.termination];
    CAPTURE(getName(summary.termination), summary.message);
    CHECK_FALSE(summary.message.empty());
    CHECK(areFinite(trajectory.xs));
    CHECK(areFinite(trajectory.us));
    if (summary.termination == FddpTermination::Failed) continue;
    CHECK(std::isfinite(summary.cost));
    CHECK(std::isfinite(summary.gap));
    const MotionRecord record = makeRecord(motion, trajectory);
    for (const RowMatrixXd* table : {&record.q, &record.v, &record.a, &record.u, &record.closure_wrenches,
                                     &record.contact_wrenches, &record.com, &record.gap})
      CHECK(table->allFinite());
  }
  std::cout << "random problems: ";
  for (const auto& [termination, n] : count) std::cout << n << " " << getName(termination) << ", ";
  std::cout << refused << " refused\n";
  CHECK(count[FddpTermination::Converged] > 20);
  CHECK(count[FddpTermination::MaxIterations] > 20);
  CHECK(refused > 5);
}

TEST_CASE("ten thousand nodes") {
  const FourBarChain chain = makeFourBarChain();
  const Model& model = chain.model;
  Random rng(1);
  constexpr int kStages = 10000;
  std::vector<StageSpec> specs;
  for (int k = 0; k <= kStages; ++k) {
    StageSpec stage;
    stage.dt = 1e-3;
    stage.constraints = makeConstraintSet(model);
    stage.state = {1, chain.q_closed, VectorXd::Zero(model.nv()), VectorXd::Ones(2 * model.nv())};
    stage.control = {1e-2, VectorXd::Zero(model.nu()), VectorXd::Ones(model.nu())};
    specs.push_back(std::move(stage));
  }
  RobotProblem problem(model, chain.q_closed, VectorXd::Zero(model.nv()), std::move(specs), Formulation::Reduced);
  ShootingTrajectory trajectory;
  trajectory.xs.assign(kStages + 1, problem.initialState());
  trajectory.us.assign(kStages, VectorXd::Zero(model.nu()));
  FddpOptions options;
  options.max_iterations = 10;
  const FddpSummary summary = test::solveInPlace(problem, trajectory, options);
  CHECK(summary.iterations > 0);
  CHECK(std::isfinite(summary.cost));
  CHECK(areFinite(trajectory.xs));
  CHECK(areFinite(trajectory.us));
}

namespace {

// A motion of Bipetto with two of its numbers replaced.
template <typename Options>
void tryMotion(Random& rng, const Model& model, Motion (*make)(const Model&, const Options&, const ProblemOptions&),
               int& solved, int& refused) {
  Options options;
  const OptionValues values = listOptions(options).listValues();
  const std::pair<const char*, double> few[] = {{"time_step", 0.03}, {"duration", 0.3}, {"settle", 0.1},
                                                {"stand", 0.1},      {"steps", 2},      {"stairs", 1}};
  for (const auto& [name, value] : few)  // stages, where nothing else is requested
    if (listOptions(options).find(name)) options = changeOption(options, name, value);
  std::vector<std::pair<std::string, double>> changes;
  std::string changed;
  for (int i = 0; i < 2; ++i) {
    const std::string& name = values[choose(rng, static_cast<int>(values.size()))].first;
    changes.emplace_back(name, pick(rng, {0.0, -1.0, 1e-300, 1e-9, 10.0, 1e9, 1e300, -1e300, kInf, std::nan("")}));
    changed += name + "=" + std::to_string(changes.back().second) + " ";
  }
  ProblemOptions problem;
  problem.formulation = pick(rng, {Formulation::Full, Formulation::Reduced});
  CAPTURE(changed, getName(problem.formulation));
  try {
    for (const auto& [name, value] : changes) options = changeOption(options, name, value);
    Motion motion = make(model, options, problem);
    if (motion.problem->numStages() > 500) return;  // allowed, and too long for here
    FddpOptions solver;
    solver.max_iterations = 2;
    const FddpSummary summary = test::solveInPlace(*motion.problem, motion.guess, solver);
    CHECK_FALSE(summary.message.empty());
    CHECK(areFinite(motion.guess.xs));
    CHECK(areFinite(motion.guess.us));
    if (summary.termination != FddpTermination::Failed) CHECK(std::isfinite(summary.cost));
    ++solved;
  } catch (const InputError& error) {
    CHECK(std::string(error.what()).find("; ") != std::string::npos);
    ++refused;
  }
}

}  // namespace

TEST_CASE("motions with numbers that nobody should ask for") {
  const Model model = loadRobot("bipetto").model;
  int solved = 0, refused = 0;
  for (unsigned seed = 0; seed < 48; ++seed) {
    Random rng(seed);
    CAPTURE(seed);
    tryMotion<SquatOptions>(rng, model, makeSquat, solved, refused);
    tryMotion<WalkOptions>(rng, model, makeWalk, solved, refused);
    tryMotion<StairsOptions>(rng, model, makeStairs, solved, refused);
    tryMotion<JumpOptions>(rng, model, makeJump, solved, refused);
  }
  std::cout << "hostile motions: " << solved << " solved, " << refused << " refused\n";
  CHECK(solved > 30);
  CHECK(refused > 30);
}
