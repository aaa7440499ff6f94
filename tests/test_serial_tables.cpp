// What a serial model lacks of its linkages, over their postures. Oracles: the constrained dynamics of the closed robot, which know
// neither ratios nor serial models; enumeration of the motors' limits; differences of the motors' positions.
#include <catch2/catch.hpp>
#include <map>
#include <random>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/constrained.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/rnea.h"
#include "bielle/model/builder.h"
#include "math/decompositions.h"
#include "motion/posture_lift.h"
#include "motion/serial_tables.h"
#include "own_robots.h"

namespace bielle {
namespace {

using testing::loadOwn;

// Cranks and rods that weigh a millionth: rods that turn between balls must have some inertia.
constexpr double kFrozenMass = 1e-6;
Model removeFrozenMass(const Model& model) {
  ModelParts parts = takeParts(model);
  const SerialModel serial = makeSerialModel(model, findClosedConfiguration(model).q);
  for (const std::string& joint : serial.frozen_joints) {
    Inertia& inertia = parts.bodies[model.findJoint(joint)].inertia;
    inertia.mass *= kFrozenMass, inertia.I_com *= kFrozenMass;
  }
  return ModelBuilder::restore(parts);
}

Model addCrankForce(const Model& fourbar) {
  ModelParts parts = takeParts(fourbar);
  JointForce force;
  force.joint = fourbar.motors()[0].joint;
  force.idx_q = fourbar.joints()[force.joint].idx_q, force.dof = fourbar.motors()[0].dof;
  force.stiffness = 3, force.rest = 0.4, force.preload = 1, force.damping = 0.2, force.friction = 0.3;
  parts.joint_forces.push_back(force);
  return ModelBuilder::restore(parts);
}

Model limitMotors(const Model& model) {
  ModelParts parts = takeParts(model);
  for (size_t m = 0; m < parts.motors.size(); ++m)
    parts.motors[m].effort_limit = 10 + 3.0 * m, parts.motors[m].velocity_limit = 20 - 1.0 * m;
  return ModelBuilder::restore(parts);
}

// Of M a - J^T lambda = force, J a = 0 with the soles fixed where they are, too.
VectorXd solveStanding(const Model& model, const Workspace& ws, const MatrixXd& M, const VectorXd& force,
                       const MatrixXd& J_loops) {
  const Eigen::Index n = model.nv(), loops = J_loops.rows(),
                     rows = loops + 6 * static_cast<Eigen::Index>(model.contacts().size());
  MatrixXd A = MatrixXd::Zero(n + rows, n + rows), J(rows, n);
  J.topRows(loops) = J_loops;
  for (size_t c = 0; c < model.contacts().size(); ++c)
    J.middleRows(loops + 6 * static_cast<Eigen::Index>(c), 6) =
        calcFrameJacobian(model, ws, model.contacts()[c].body, model.contacts()[c].X_BF);
  A.topLeftCorner(n, n) = M;
  A.bottomLeftCorner(rows, n) = J;
  A.topRightCorner(n, rows) = -J.transpose();
  VectorXd b = VectorXd::Zero(n + rows);
  b.head(n) = force;
  return Eigen::ColPivHouseholderQR<MatrixXd>(A).solve(b).head(n);  // loops may have redundant rows
}

struct Trial {
  explicit Trial(const Model& robot)
      : closed(robot), tables(makeSerialTables(closed, findClosedConfiguration(closed).q)), random(1) {
    const SerialModel& serial = tables.serial;
    for (size_t i = 0; i < serial.replacements.size(); ++i)
      evaluators.push_back(std::make_unique<LinkageEvaluator>(closed, serial, i));
  }
  double draw(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); }

  // A posture of every linkage `way` of the way from the reference to limits or the ends of tables; the closed configuration, and what
  // the evaluators make of it.
  bool drawPosture(double way) {
    const SerialModel& serial = tables.serial;
    q = serial.q_reference;
    q_s = restrictConfiguration(closed, serial.model, q);
    postures.clear(), joints.clear();
    for (size_t i = 0; i < evaluators.size(); ++i) {
      const LinkageTable& table = tables.linkages[i];
      VectorXd x(static_cast<Eigen::Index>(table.joints.size()));
      for (size_t j = 0; j < table.joints.size(); ++j) {
        double& at = q_s[serial.model.joints()[serial.model.findJoint(table.joints[j])].idx_q];
        const double end = draw(0, 1) < 0.5 ? table.axes[j].front() : table.axes[j].back();
        at += way * draw(0, 1) * (end - at);
        x[static_cast<Eigen::Index>(j)] = at;
      }
      VectorXd from = serial.q_reference;
      const auto posture = evaluators[i]->evaluate(x, from);
      if (!posture) return false;
      postures.push_back(*posture), joints.push_back(x);
    }
    PostureLift lift(closed, serial);
    if (lift.setConfiguration(q_s, 1e-3) != NumericalStatus::Ok) return false;
    q = lift.q();
    return true;
  }

  // Of the serial joints, by the constrained dynamics of the closed robot at rest, under random torques.
  VectorXd calcClosed() {
    u.resize(closed.nu());
    for (double& entry : u) entry = draw(-5, 5);
    Workspace ws(closed);
    ConstrainedWorkspace cws;
    REQUIRE(updateConstrainedDynamics(closed, ws, cws, makeConstraintSet(closed), q, VectorXd::Zero(closed.nv()),
                                      calcMotorForces(closed, u)) == NumericalStatus::Ok);
    if (stands) {
      updateMassMatrix(closed, ws);
      updateBias(closed, ws);
      cws.a = solveStanding(closed, ws, ws.M, calcMotorForces(closed, u) - ws.b, cws.J);
    }
    a_closed = cws.a;
    return restrictVelocity(closed, tables.serial.model, cws.a);
  }

  // By Eq. (1) of serial_tables.h. `largest`: of the inverse of the mass matrix, as a norm.
  VectorXd calcSerial(double* largest = nullptr) const {
    const Model& model = tables.serial.model;
    Workspace ws(model), full(closed);
    updatePositions(model, ws, q_s);
    updatePositions(closed, full, q);
    updateMassMatrix(model, ws);
    updateVelocities(model, ws, VectorXd::Zero(model.nv()));
    updateBias(model, ws);
    MatrixXd M = ws.M;
    VectorXd force = -ws.b;
    for (const Motor& motor : model.motors())
      if (const int same = closed.findMotor(motor.name); same >= 0) force[motor.dof] += u[same];
    for (size_t i = 0; i < postures.size(); ++i) {
      const LinkageTable& table = tables.linkages[i];
      const LinkagePosture& posture = postures[i];
      const Linkage linkage = makeLinkage(closed, tables.serial.q_reference, table.joints);
      const int carrier = linkage.cluster->root;
      Vector3d gravity = full.X_WB[carrier].R.transpose() * closed.gravity();
      if (carrier > 0) gravity -= (calcFrameJacobian(closed, full, carrier, SE3()) * a_closed).head<3>();
      VectorXd u_linkage(static_cast<Eigen::Index>(table.motors.size()));
      for (size_t k = 0; k < table.motors.size(); ++k)
        u_linkage[static_cast<Eigen::Index>(k)] = u[closed.findMotor(table.motors[k])];
      const VectorXd tau = posture.ratio.transpose() * u_linkage - posture.weight * gravity - posture.held;
      for (size_t j = 0; j < table.joints.size(); ++j) {
        const Motor& motor = model.motors()[model.findMotor(table.joints[j])];
        force[motor.dof] += tau[static_cast<Eigen::Index>(j)];
        M(motor.dof, motor.dof) -= motor.armature;
        for (size_t k = 0; k < table.joints.size(); ++k)
          M(motor.dof, model.motors()[model.findMotor(table.joints[k])].dof) +=
              posture.inertia(static_cast<Eigen::Index>(j), static_cast<Eigen::Index>(k));
      }
    }
    if (stands) return solveStanding(model, ws, M, force, MatrixXd(0, model.nv()));
    const MatrixXd inverse = Eigen::FullPivLU<MatrixXd>(M).inverse();
    if (largest) *largest = inverse.cwiseAbs().rowwise().sum().maxCoeff();
    return inverse * force;
  }

  const Model closed;
  const SerialTables tables;
  std::mt19937 random;
  std::vector<std::unique_ptr<LinkageEvaluator>> evaluators;
  VectorXd q, q_s, u, a_closed;
  std::vector<LinkagePosture> postures;
  std::vector<VectorXd> joints;
  bool stands = false;  // with its soles fixed
};

double calcDifference(const VectorXd& a, const VectorXd& b) {
  return (a - b).cwiseAbs().maxCoeff() / (1 + b.cwiseAbs().maxCoeff());
}

// Linear between the neighbours of a table of one joint.
struct Interpolated {
  std::optional<size_t> left;
  double share = 0;
};
Interpolated findCell(const LinkageTable& table, double x) {
  for (size_t k = 0; k + 1 < table.axes[0].size(); ++k)
    if (table.axes[0][k] <= x && x <= table.axes[0][k + 1] && table.postures[k] && table.postures[k + 1])
      return {k, (x - table.axes[0][k]) / (table.axes[0][k + 1] - table.axes[0][k])};
  return {};
}

}  // namespace

TEST_CASE("serial tables: with them the chain accelerates as the closed robot does") {
  // Fixed to the world, with rods that weigh and springs on joints that are frozen; free, with rods that weigh nothing.
  for (const Model& robot :
       {loadOwn("fourbar").model, addCrankForce(loadOwn("fourbar").model), removeFrozenMass(loadOwn("bipetto").model),
        removeFrozenMass(loadOwn("rsu_biped").model)}) {
    Trial trial(robot);
    const bool is_exact = robot.name().find("fourbar") != std::string::npos;
    CAPTURE(robot.name());
    int count = 0;
    for (int i = 0; i < 15; ++i) {
      if (!trial.drawPosture(is_exact ? 0.7 : 0.4)) continue;
      ++count;
      const VectorXd closed = trial.calcClosed();
      CHECK(calcDifference(trial.calcSerial(), closed) < (is_exact ? 1e-8 : 10 * kFrozenMass));
      // What is off is noticed, and so are terms beside the diagonal that are left out.
      const std::vector<LinkagePosture> right = trial.postures;
      trial.postures[0].inertia *= is_exact ? 1.001 : 1.1;
      CHECK(calcDifference(trial.calcSerial(), closed) > (is_exact ? 1e-6 : 100 * kFrozenMass));
      trial.postures = right;
      if (is_exact) continue;
      for (LinkagePosture& posture : trial.postures)
        posture.inertia = MatrixXd(posture.inertia.diagonal().asDiagonal());
      CHECK(calcDifference(trial.calcSerial(), closed) > 100 * kFrozenMass);
    }
    CHECK(count >= 5);
  }
}

// With A a = r the exact Eq. (1) and A', r' interpolated: a' - a = A'^-1 ((A - A') a + r' - r).
TEST_CASE("serial tables: between postures they err as they say") {
  Trial trial(addCrankForce(loadOwn("fourbar").model));
  const LinkageTable& table = trial.tables.linkages[0];
  CHECK(table.ratio_error > 0);
  CHECK(table.inertia_error > 0);
  int count = 0;
  for (int i = 0; i < 200 && count < 20; ++i) {
    if (!trial.drawPosture(0.9)) continue;
    const Interpolated cell = findCell(table, trial.joints[0][0]);
    if (!cell.left) continue;
    ++count;
    const VectorXd exact = trial.calcClosed();
    const LinkagePosture right = trial.postures[0];
    LinkagePosture& found = trial.postures[0];
    const LinkagePosture &a = *table.postures[*cell.left], &b = *table.postures[*cell.left + 1];
    found.inertia = (1 - cell.share) * a.inertia + cell.share * b.inertia;
    found.ratio = (1 - cell.share) * a.ratio + cell.share * b.ratio;
    // Halfway is where linear interpolation errs most, of a parabola; another cubic term may double it.
    CHECK(std::abs(found.inertia(0, 0) - right.inertia(0, 0)) <= 2 * table.inertia_error);
    CHECK(std::abs(found.ratio(0, 0) - right.ratio(0, 0)) <= 2 * table.ratio_error);
    double largest = 0;
    const VectorXd interpolated = trial.calcSerial(&largest);
    const double bound =
        2 * largest *
        (table.inertia_error * exact.cwiseAbs().maxCoeff() + table.ratio_error * trial.u.cwiseAbs().maxCoeff());
    CHECK((interpolated - exact).cwiseAbs().maxCoeff() <= bound + 1e-8);
  }
  CHECK(count == 20);
}

TEST_CASE("serial tables: limits are those of the motors, tried one by one") {
  for (const char* name : {"fourbar", "rsu_biped"}) {
    Trial trial(limitMotors(loadOwn(name).model));
    int count = 0;
    for (int i = 0; i < 5; ++i) {
      if (!trial.drawPosture(0.7)) continue;
      ++count;
      for (size_t l = 0; l < trial.postures.size(); ++l) {
        const LinkagePosture& posture = trial.postures[l];
        const LinkageTable& table = trial.tables.linkages[l];
        const int m = static_cast<int>(table.joints.size());
        VectorXd effort(m), speed(m);
        for (int k = 0; k < m; ++k) {
          const Motor& motor = trial.closed.motors()[trial.closed.findMotor(table.motors[static_cast<size_t>(k)])];
          effort[k] = motor.effort_limit, speed[k] = motor.velocity_limit;
        }
        VectorXd torque_most = VectorXd::Zero(m), speed_most = VectorXd::Zero(m);
        const MatrixXd S = Eigen::FullPivLU<MatrixXd>(posture.ratio).inverse();
        for (unsigned corner = 0; corner < 1u << m; ++corner) {
          VectorXd sign(m);
          for (int k = 0; k < m; ++k) sign[k] = corner >> k & 1u ? 1 : -1;
          torque_most = torque_most.cwiseMax(posture.ratio.transpose() * sign.cwiseProduct(effort));
          speed_most = speed_most.cwiseMax(S * sign.cwiseProduct(speed));
        }
        CHECK((torque_most - posture.torque_most).cwiseAbs().maxCoeff() < 1e-10 * torque_most.maxCoeff());
        CHECK((speed_most - posture.speed_most).cwiseAbs().maxCoeff() < 1e-10 * speed_most.maxCoeff());
        for (int j = 0; j < m; ++j)
          for (const double s : {0.999, 1.001}) {
            const VectorXd unit = VectorXd::Unit(m, j);
            const VectorXd u = S.transpose() * unit * (s * posture.torque_alone[j]),
                           w = posture.ratio * unit * (s * posture.speed_alone[j]);
            CHECK((u.cwiseAbs().array() <= effort.array()).all() == (s < 1));
            CHECK((w.cwiseAbs().array() <= speed.array()).all() == (s < 1));
          }
      }
    }
    CHECK(count >= 2);
  }
}

// For docs/linkages.md: errors of accelerations at rest on fixed soles, over the closed robot's.
TEST_CASE("serial tables: what each omission costs", "[.table]") {
  for (const char* name : {"bipetto", "rsu_biped", "leg_biped", "kangaroo_leg"}) {
    for (const bool stands : {false, true}) {
      Trial trial(loadOwn(name).model);
      trial.stands = stands;
      std::map<std::string, std::vector<double>> errors;
      for (int i = 0; i < 60; ++i) {
        if (!trial.drawPosture(0.3)) continue;
        const VectorXd exact = trial.calcClosed();
        const std::vector<LinkagePosture> all = trial.postures;
        const auto tryWith = [&](const std::string& what, const auto& change) {
          for (size_t l = 0; l < all.size(); ++l) change(trial.tables.linkages[l], trial.postures[l] = all[l]);
          errors[what].push_back((trial.calcSerial() - exact).norm() / exact.norm());
        };
        tryWith("1 nothing", [](const LinkageTable&, LinkagePosture& p) { p.inertia.setZero(), p.weight.setZero(); });
        tryWith("2 armature of the file", [&](const LinkageTable& table, LinkagePosture& p) {
          p.inertia.setZero(), p.weight.setZero();
          for (size_t j = 0; j < table.joints.size(); ++j) {
            const Model& serial = trial.tables.serial.model;
            p.inertia(j, j) = serial.motors()[serial.findMotor(table.joints[j])].armature;
          }
        });
        tryWith("3 diagonal of inertia", [](const LinkageTable&, LinkagePosture& p) {
          p.inertia = MatrixXd(p.inertia.diagonal().asDiagonal()), p.weight.setZero();
        });
        tryWith("4 inertia", [](const LinkageTable&, LinkagePosture& p) { p.weight.setZero(); });
        tryWith("5 inertia, weight", [](const LinkageTable&, LinkagePosture&) {});
      }
      for (auto& [what, list] : errors) {
        std::sort(list.begin(), list.end());
        WARN(name << (stands ? " stands, " : " flies, ") << what << ": median " << list[list.size() / 2] << ", largest "
                  << list.back() << " of " << list.size());
      }
    }
  }
}

TEST_CASE("serial tables: ratios are slopes of the motors' positions, and end at dead points") {
  constexpr double kLow = 1.5707963267948966, kHigh = 2.636232143305636;  // of the rocker: pi / 2, pi - acos(7 / 8)
  Trial trial(addCrankForce(loadOwn("fourbar").model));
  const LinkageTable& table = trial.tables.linkages[0];
  REQUIRE(table.axes.size() == 1);
  REQUIRE(table.postures.size() == table.axes[0].size());
  CHECK(table.joints == std::vector<std::string>{"rocker_joint"});
  int reached = 0;
  for (size_t k = 0; k < table.postures.size(); ++k) {
    const double x = table.axes[0][k];
    if (std::min(std::abs(x - kLow), std::abs(x - kHigh)) > 0.02)
      CHECK(table.postures[k].has_value() == (x > kLow && x < kHigh));
    if (!table.postures[k]) continue;
    ++reached;
    const LinkagePosture& at = *table.postures[k];
    if (std::min(x - kLow, kHigh - x) < 0.03) continue;  // where differences are none of the slope
    constexpr double h = 1e-5;
    VectorXd q = trial.tables.serial.q_reference, before = q;
    const auto next = trial.evaluators[0]->evaluate(VectorXd::Constant(1, x + h), q);
    const auto last = trial.evaluators[0]->evaluate(VectorXd::Constant(1, x - h), before);
    REQUIRE((next && last));
    CHECK(at.ratio(0, 0) == Approx((next->motors[0] - last->motors[0]) / (2 * h)).epsilon(1e-5));
    // Of the crank's spring, damper and friction.
    CHECK(at.held[0] == Approx(-at.ratio(0, 0) * (1 - 3 * (at.motors[0] - 0.4))));
    CHECK(at.damping(0, 0) == Approx(0.2 * at.ratio(0, 0) * at.ratio(0, 0)));
    CHECK(at.friction[0] == Approx(0.3 * std::abs(at.ratio(0, 0))));
  }
  CHECK(reached >= 25);
}

}  // namespace bielle
