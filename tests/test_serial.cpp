// The Approximate Serial model and the lift back. Oracles: inertia of the closed model with its linkages locked, and
// the closed model's constrained dynamics under the lifted torques.
#include <catch2/catch.hpp>
#include <cmath>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/constrained.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/rnea.h"
#include "bielle/model/builder.h"
#include "bielle/model/error.h"
#include "bielle/motion/lift.h"
#include "bielle/motion/squat.h"
#include "bielle/robots/robot_loader.h"
#include "solve_in_place.h"

using namespace bielle;

namespace {

constexpr double kRockerEnd = 2.636232143305636;  // of robots/fourbar: pi - acos(7/8)

struct Bipetto {
  Model closed = loadRobot("bipetto").model;
  VectorXd q = makeStandingPosture(closed);
  SerialModel serial = makeSerialModel(closed, q);
};

// Entries of v of the closed model that the serial one has, in its order.
std::vector<int> listSerialDofs(const Model& closed, const Model& serial) {
  std::vector<int> dofs;
  for (const Joint& joint : serial.joints())
    for (int k = 0; k < joint.nv; ++k) dofs.push_back(closed.joints()[closed.findJoint(joint.name)].idx_v + k);
  return dofs;
}

// A solved motion of the serial model as lift() takes it.
SerialTrajectory makeTrajectory(const Motion& motion) {
  const Model& model = motion.problem->model();
  SerialTrajectory out;
  RobotEvaluator evaluator(*motion.problem);
  for (size_t k = 0; k < motion.guess.xs.size(); ++k) {
    const VectorXd& x = motion.guess.xs[k];
    out.q.push_back(x.head(model.nq()));
    out.v.push_back(x.tail(model.nv()));
    if (k + 1 == motion.guess.xs.size()) break;
    const RobotEvaluation& at = evaluator.evaluate(static_cast<int>(k), x, motion.guess.us[k]);
    REQUIRE(at.status == NumericalStatus::Ok);
    out.a.push_back(at.a);
    out.forces.push_back(at.lambda);
    out.dt.push_back(motion.problem->spec(static_cast<int>(k)).dt);
    out.constraints.push_back(motion.problem->spec(static_cast<int>(k)).constraints);
  }
  return out;
}

// The rocker of the four-bar at a constant speed from where it stands.
SerialTrajectory makeRockerSwing(const SerialModel& serial, int stages, double dt, double speed) {
  SerialTrajectory out;
  out.dt.assign(stages, dt);
  const double start = serial.q_reference[2];
  for (int k = 0; k <= stages; ++k) {
    out.q.push_back(VectorXd::Constant(1, start + k * dt * speed));
    out.v.push_back(VectorXd::Constant(1, speed));
  }
  out.a.assign(stages, VectorXd::Zero(1));
  out.forces.assign(stages, VectorXd());
  out.constraints.resize(stages);
  return out;
}

}  // namespace

TEST_CASE("serial model: the closed one with its linkages locked") {
  const Bipetto robot;
  const Model &closed = robot.closed, &serial = robot.serial.model;
  CHECK(serial.closures().empty());
  CHECK(serial.nv() == 18);
  CHECK(serial.nu() == 12);
  CHECK(serial.mass() == Approx(closed.mass()).epsilon(1e-14));
  Workspace full(closed), reduced(serial);
  updatePositions(closed, full, robot.q);
  updateMassMatrix(closed, full);
  const VectorXd q_s = restrictConfiguration(closed, serial, robot.q);
  updatePositions(serial, reduced, q_s);
  updateMassMatrix(serial, reduced);
  CHECK((calcCom(closed, full) - calcCom(serial, reduced)).norm() < 1e-14);
  CHECK((full.Yc[1] - reduced.Yc[1]).norm() < 1e-12 * full.Yc[1].norm());
  const std::vector<int> dofs = listSerialDofs(closed, serial);
  const MatrixXd M = full.M - MatrixXd(closed.armature().asDiagonal());
  const MatrixXd M_s = reduced.M - MatrixXd(serial.armature().asDiagonal());
  for (int i = 0; i < serial.nv(); ++i)
    for (int j = 0; j < serial.nv(); ++j) CHECK(std::abs(M_s(i, j) - M(dofs[i], dofs[j])) < 1e-13 * M.norm());

  // Frozen parts matter: without those of the knee's linkage the thigh would be lighter.
  double frozen = 0;
  for (const std::string& name : robot.serial.frozen_joints)
    frozen += closed.bodies()[closed.findJoint(name)].inertia.mass;
  CHECK(frozen > 0.5);

  for (const Frame& frame : closed.frames()) {
    const int index = serial.findFrame(frame.name);
    REQUIRE(index >= 0);
    const SE3 there = getPlacement(reduced, serial.frames()[index].body, serial.frames()[index].X_BF);
    const SE3 here = getPlacement(full, frame.body, frame.X_BF);
    CHECK((there.p - here.p).norm() + (there.R - here.R).norm() < 1e-12);
  }
  CHECK(serial.visuals().size() == closed.visuals().size());
  CHECK(serial.references().size() == closed.references().size());
  CHECK(serial.serialJoints().size() == 12);
  for (const ContactFrame& contact : closed.contacts()) {
    const ContactFrame& other = serial.contacts()[serial.findContact(contact.name)];
    CHECK(other.half_length == contact.half_length);
    CHECK((getPlacement(reduced, other.body, other.X_BF).p - getPlacement(full, contact.body, contact.X_BF).p).norm() <
          1e-13);
  }
}

TEST_CASE("serial model: what was changed is reported, motors keep their places") {
  const Bipetto robot;
  std::vector<std::string> motors;
  for (const Motor& motor : robot.serial.model.motors()) {
    motors.push_back(motor.name);
    CHECK(motor.armature == 1e-3);
    CHECK(std::isinf(motor.effort_limit));
  }
  CHECK(motors == std::vector<std::string>{"hipz_left", "hipy_left", "hipx_left", "knee_left", "ankley_left",
                                           "anklex_left", "hipz_right", "hipy_right", "hipx_right", "knee_right",
                                           "ankley_right", "anklex_right"});
  CHECK(robot.serial.frozen_joints.size() + robot.serial.model.joints().size() == robot.closed.joints().size());
  CHECK(robot.serial.dropped_closures.size() == 6);
  CHECK(robot.serial.replacements.size() == 4);

  // The four-bar's motor: 10 N m and 20 rad/s at the crank.
  const Model fourbar = loadRobot("fourbar").model;
  const VectorXd q = findClosedConfiguration(fourbar).q;
  const SerialModel serial = makeSerialModel(fourbar, q);
  const double R = std::abs(serial.replacements[0].R(0, 0));
  REQUIRE(serial.model.nu() == 1);
  CHECK(serial.model.motors()[0].name == "rocker_joint");
  CHECK(serial.model.motors()[0].effort_limit == Approx(10 * R));
  CHECK(serial.model.motors()[0].velocity_limit == Approx(20 / R));
  CHECK(serial.dropped_targets.size() == 3);
  SerialModelOptions reflected;
  reflected.armature_kind = SerialModelOptions::Armature::Reflected;
  const SerialModel heavy = makeSerialModel(robot.closed, robot.q, reflected);
  const Motor& knee = heavy.model.motors()[heavy.model.findMotor("knee_left")];
  CHECK(knee.armature == Approx(1e-3 * 1.3589 * 1.3589).epsilon(1e-2));
}

TEST_CASE("serial model: springs between points stay, unless a joint between them is frozen") {
  const Model fourbar = loadRobot("fourbar").model;
  const VectorXd q = findClosedConfiguration(fourbar).q;
  const auto attach = [&](const char* joint) {
    ModelParts parts = takeParts(fourbar);
    PointSpring spring;
    spring.name = "spring", spring.body2 = fourbar.findJoint(joint), spring.point1 = {0, 0, 0.3};
    parts.point_springs.push_back(spring);
    return makeSerialModel(ModelBuilder::restore(parts), q).model;
  };
  CHECK(attach("rocker_joint").pointSprings().size() == 1);
  CHECK_THROWS_WITH(attach("crank_coupler"), Catch::Contains("point spring 'spring': the serial model freezes joint"));
}

TEST_CASE("serial model: refused where there is no serial chain") {
  const Model fivebar = loadRobot("fivebar").model;
  CHECK_THROWS_WITH(makeSerialModel(fivebar, findClosedConfiguration(fivebar).q),
                    Catch::Contains("closures pin: there is no equivalent serial chain") &&
                        Catch::Contains("mobility 2, but its serial joints (none)"));
  // Crank and coupler aligned: the rocker does not tell where the linkage goes.
  const Model fourbar = loadRobot("fourbar").model;
  AssemblyProblem problem;
  problem.q_ref = findClosedConfiguration(fourbar).q;
  problem.q_ref[0] = std::atan2(0.3, 0.4);
  problem.weights = VectorXd::Constant(4, 1e-6);
  problem.weights[0] = 1;
  const AssemblyResult aligned = assemble(fourbar, problem);
  REQUIRE(aligned.status == NumericalStatus::Ok);
  REQUIRE(aligned.q[2] == Approx(M_PI / 2).margin(1e-6));
  CHECK_THROWS_WITH(makeSerialModel(fourbar, aligned.q), Catch::Contains("at a dead point at the reference"));
}

TEST_CASE("a squat of the serial model converges and is lifted: the closed dynamics do the same") {
  const Bipetto robot;
  const Model &closed = robot.closed, &model = robot.serial.model;
  SquatOptions options;
  options.depth = 0.9;
  options.duration = 0.8;
  options.settle = 0.1;
  options.time_step = 0.02;
  Motion motion = makeSquat(model, options, {Formulation::Reduced, StepRule::Euler});
  const FddpSummary summary = test::solveInPlace(*motion.problem, motion.guess);
  REQUIRE(summary.termination == FddpTermination::Converged);
  const SerialTrajectory trajectory = makeTrajectory(motion);
  const LiftResult lifted = lift(closed, robot.serial, trajectory);
  INFO(lifted.nodes.back().message);
  REQUIRE(lifted.lifted());
  REQUIRE(lifted.trajectory.xs.size() == trajectory.q.size());
  Workspace ws(closed);
  ConstrainedWorkspace cws;
  double weight = 0;
  for (size_t k = 0; k < trajectory.a.size(); ++k) {
    const VectorXd& x = lifted.trajectory.xs[k];
    const VectorXd q = x.head(closed.nq()), v = x.tail(closed.nv());
    CHECK((restrictConfiguration(closed, model, q) - trajectory.q[k]).norm() < 1e-9);
    CHECK((restrictVelocity(closed, model, v) - trajectory.v[k]).norm() < 1e-12);
    const auto calcAcceleration = [&](const VectorXd& u) {
      REQUIRE(updateConstrainedDynamics(closed, ws, cws, lifted.constraints[k], q, v, calcMotorForces(closed, u)) ==
              NumericalStatus::Ok);
      return restrictVelocity(closed, model, cws.a);
    };
    CHECK((calcAcceleration(lifted.trajectory.us[k]) - trajectory.a[k]).norm() < 1e-6);
    CHECK(calcLargestGap(ws, lifted.constraints[k]) < 1e-10);
    for (int i = 0; i < 36; ++i) REQUIRE(std::isfinite(cws.lambda[i]));
    // The velocity keeps the loops closed.
    updateVelocities(closed, ws, v);
    for (int c = 0; c < lifted.constraints[k].num_loops; ++c)
      CHECK(calcClosureVelocity(ws, lifted.constraints[k].closures[c]).norm() < 1e-10);
    weight += cws.lambda[36 + 2] + cws.lambda[42 + 2];
    VectorXd wrong = lifted.trajectory.us[k];
    wrong[closed.findMotor("motor_knee_left")] += 1e-2;
    CHECK((calcAcceleration(wrong) - trajectory.a[k]).norm() > 1e-6);
  }
  CHECK(weight / trajectory.a.size() == Approx(closed.mass() * 9.81).epsilon(0.02));

  // The paper's problem, step after step, gives the same but for the discretization.
  LiftOptions nlopt;
  nlopt.method = LiftMethod::Nlopt;
  const LiftResult stepped = lift(closed, robot.serial, trajectory, nlopt);
  INFO(stepped.nodes.back().message);
  REQUIRE(stepped.lifted());
  double difference = 0, largest = 0;
  for (size_t k = 0; k < trajectory.a.size(); ++k) {
    CHECK(stepped.nodes[k].evaluations > 0);
    difference = std::max(difference, (stepped.trajectory.us[k] - lifted.trajectory.us[k]).cwiseAbs().maxCoeff());
    largest = std::max(largest, lifted.trajectory.us[k].cwiseAbs().maxCoeff());
    // The states are those of the closed dynamics.
    CHECK(stepped.nodes[k].position_error < 1e-2);
  }
  CAPTURE(difference, largest);
  CHECK(difference < 0.2 * largest);
}

TEST_CASE("a lift fails where the linkage ends, and says so") {
  const Model fourbar = loadRobot("fourbar").model;
  const SerialModel serial = makeSerialModel(fourbar, assembleReference(fourbar, "crank_at_60_degrees").q);
  const double start = serial.q_reference[2];
  const SerialTrajectory swing = makeRockerSwing(serial, 60, 0.02, 1);
  const LiftResult lifted = lift(fourbar, serial, swing);
  CHECK_FALSE(lifted.lifted());
  const size_t beyond = static_cast<size_t>(std::ceil((kRockerEnd - start) / 0.02));
  CHECK(lifted.nodes.size() == beyond + 1);
  CHECK(lifted.nodes.back().status == NumericalStatus::NotClosed);
  CHECK_THAT(lifted.nodes.back().message, Catch::Contains("joint 'rocker_joint' must reach"));
  CHECK(lifted.nodes.back().joint == "rocker_joint");
  CHECK(lifted.nodes.front().joint.empty());
  CHECK(lifted.trajectory.xs.size() == beyond);
  CHECK(lifted.trajectory.us.size() + 1 == beyond);
  CHECK(lifted.constraints.size() == lifted.trajectory.us.size());
  for (size_t k = 0; k < lifted.trajectory.us.size(); ++k) {
    CHECK(lifted.trajectory.xs[k].allFinite());
    CHECK(lifted.trajectory.us[k].allFinite());
    CHECK(lifted.nodes[k].acceleration_error < 1e-6);
  }
  // The motor turns ever faster.
  CHECK(lifted.trajectory.xs.back()[4] > 5 * lifted.trajectory.xs.front()[4]);

  SerialTrajectory to_the_end = makeRockerSwing(serial, 10, 0.1, (kRockerEnd - 1e-8 - start) / 1.0);
  const LiftResult singular = lift(fourbar, serial, to_the_end);
  CHECK(singular.nodes.back().status == NumericalStatus::NearDeadPoint);
  CHECK(singular.nodes.size() == 11);
  CHECK_THAT(singular.nodes.back().message, Catch::Contains("dead point"));
  CHECK(singular.nodes.back().joint == "rocker_joint");

  to_the_end.a.pop_back();
  CHECK_THROWS_AS(lift(fourbar, serial, to_the_end), InputError);
}
