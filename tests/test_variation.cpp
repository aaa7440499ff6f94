// Derivatives of dynamics, closing and motor torques with respect to the mechanism. Oracle: central differences (fourth
// order) over models rebuilt with moved joints, closures, contacts and inertias. Every test also notices a poisoned
// entry.
#include <Eigen/QR>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/kept_motion.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/rnea.h"
#include "bielle/robots/robot_loader.h"
#include "check_derivative.h"
#include "dynamics/saddle_point.h"
#include "moved_model.h"
#include "selection.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

// Both frames of the loop in all six directions, the first contact, the placements of the joints (each along a
// direction of its own), an inertia, armature, and everything at once.
std::vector<ModelVariation> listVariations(std::mt19937& rng, const Model& model) {
  std::vector<ModelVariation> out;
  for (int k = 0; k < 6; ++k)
    for (auto frames : {&ModelVariation::frames1, &ModelVariation::frames2}) {
      out.emplace_back(model);
      (out.back().*frames)[0] = Vector6d::Unit(k);
    }
  for (size_t c = 0; c < std::min<size_t>(2, model.contacts().size()); ++c) {
    out.emplace_back(model);
    out.back().contacts[c] = randomVector(rng, 6);
  }
  for (int i = 1; i < model.numBodies(); ++i) {
    out.emplace_back(model);
    out.back().joints[i] = randomVector(rng, 6);
  }
  ModelVariation all(model);
  for (auto* twists : {&all.joints, &all.frames1, &all.frames2, &all.contacts})
    for (Vector6d& twist : *twists) twist = randomVector(rng, 6);
  for (size_t c = 0; c < model.closures().size(); ++c) {
    if (model.closures()[c].kind == ClosureKind::Distance) {
      out.emplace_back(model);
      all.lengths[c] = out.back().lengths[c] = 0.4;
    }
    if (model.closures()[c].kind != ClosureKind::Coupler) continue;
    ModelVariation ratios(model);
    MatrixXd& change = ratios.coefficients[c];
    change = randomVector(rng, static_cast<int>(change.size())).reshaped(change.rows(), change.cols());
    ratios.offsets[c] = 0.5;
    out.push_back(ratios);
    all.coefficients[c] = -ratios.coefficients[c];
    all.offsets[c] = 0.3;
  }
  for (int i = 1; i < model.numBodies(); ++i)
    all.inertias[i] = 0.5 * model.bodies()[i].inertia.toMatrix() + 0.05 * randomInertia(rng).toMatrix();
  for (const Motor& motor : model.motors()) all.armature[motor.dof] = 0.3;
  for (size_t s = 0; s < model.pointSprings().size(); ++s) {
    ModelVariation ends(model), numbers(model);
    all.points1[s] = ends.points1[s] = randomVector(rng, 3);
    all.points2[s] = ends.points2[s] = randomVector(rng, 3);
    all.springs[s] = numbers.springs[s] = randomVector(rng, 4);
    out.push_back(ends);
    out.push_back(numbers);
  }
  for (size_t f = 0; f < model.jointForces().size(); ++f) {
    ModelVariation numbers(model);
    all.joint_forces[f] = numbers.joint_forces[f] = randomVector(rng, 5);
    out.push_back(numbers);
  }
  ModelVariation inertias(model);
  inertias.inertias = all.inertias, inertias.armature = all.armature;
  out.push_back(inertias);
  out.push_back(all);
  return out;
}

}  // namespace

TEST_CASE("variation: inverse dynamics and closures along a motion are those of their Jacobians") {
  std::mt19937 rng(21);
  for (JointKind kind : kJointKinds) {
    CAPTURE(getName(kind));
    const Mechanism mechanism = makeRandomMechanism(rng, kind, ClosureKind::Hinge5D, MechanismBase::FreeFlyer, 3, 2);
    const Model& model = mechanism.model;
    const ConstraintSet set = makeConstraintSet(model, {{0, randomPlacement(rng), 5, 4}});
    Workspace ws(model);
    const VectorXd q = model.integrate(mechanism.q_closed, randomVector(rng, model.nv(), 0.1));
    calcInverseDynamics(model, ws, q, randomVector(rng, model.nv()), randomVector(rng, model.nv()));
    const VectorXd lambda = VectorXd::Zero(set.rows);
    updateInverseDynamicsDerivatives(model, ws, {});
    updateMassMatrix(model, ws);
    MotionVariation motion(model);
    for (VectorXd* x : {&motion.q, &motion.v, &motion.a}) *x = randomVector(rng, model.nv());
    const ModelVariation none(model);
    VariationWorkspace variation(model);
    updateVariation(model, ws, none, motion, variation);
    checkDerivative(calcInverseDynamicsVariation(model, ws, set, lambda, none, motion, variation),
                    ws.dID_dq * motion.q + ws.dID_dv * motion.v + ws.M * motion.a);
    const VectorXd residual = calcResidualVariation(ws, set, none, variation);
    const VectorXd velocity = calcVelocityVariation(ws, set, none, variation);
    const VectorXd acceleration = calcAccelerationVariation(ws, set, none, variation);
    for (size_t c = 0; c < set.closures.size(); ++c) {
      const int row = set.offsets[c], n = getRows(set.closures[c].kind);
      MatrixXd H = MatrixXd::Zero(n, model.nv()), J = H, nu = H, dq = H, dv = H;
      calcClosureResidualJacobian(ws, set.closures[c], H);
      calcClosureJacobian(ws, set.closures[c], J);
      calcClosureVelocityDerivative(ws, set.closures[c], nu);
      calcClosureDerivatives(ws, set.closures[c], dq, dv);
      addStabilizationDerivatives(ws, set.closures[c], dq, dv);
      checkDerivative(residual.segment(row, n), H * motion.q);
      checkDerivative(velocity.segment(row, n), nu * motion.q + J * motion.v);
      checkDerivative(acceleration.segment(row, n), dq * motion.q + dv * motion.v + J * motion.a);
    }
  }
}

namespace {

// Variations of accelerations and constraint forces against differences, in all directions at once: the frame that a weld is
// read in moves nothing.
void checkForwardDynamics(std::mt19937& rng, const Model& model, const std::vector<ContactTarget>& contacts,
                          const VectorXd& q) {
  const ConstraintSet set = makeConstraintSet(model, contacts);
  const VectorXd v = randomVector(rng, model.nv()), tau = calcMotorForces(model, randomVector(rng, 2, 10));
  Workspace ws(model);
  ConstrainedWorkspace cws;
  REQUIRE(updateConstrainedDynamics(model, ws, cws, set, q, v, tau) == NumericalStatus::Ok);
  const std::vector<ModelVariation> directions = listVariations(rng, model);
  const DynamicsVariation analytic = calcConstrainedVariation(model, ws, cws, set, directions);
  const MatrixXd numeric = differentiateModel(model, directions, kModelStep, [&](const Model& moved) {
    Workspace other(moved);
    ConstrainedWorkspace ocws;
    REQUIRE(updateConstrainedDynamics(moved, other, ocws, makeConstraintSet(moved, contacts), q, v, tau) ==
            NumericalStatus::Ok);
    VectorXd out(moved.nv() + set.rows);
    out << ocws.a, ocws.lambda;
    return out;
  });
  checkDerivative(analytic.a, numeric.topRows(model.nv()));
  checkDerivative(analytic.lambda, numeric.bottomRows(set.rows));
}

}  // namespace

TEST_CASE("variation: forward dynamics, every joint kind times every closure kind, closed and open", "[sweep]") {
  std::mt19937 rng(22);
  Selection selection(5);
  for (JointKind kind : kJointKinds)
    for (ClosureKind closure : kClosureKinds)
      for (bool open : {false, true})
        for (MechanismBase base : {MechanismBase::Fixed, MechanismBase::FreeFlyer}) {
          if (selection.isLeftOut()) continue;
          CAPTURE(getName(kind), getName(closure), open, base == MechanismBase::Fixed);
          const Mechanism mechanism = makeRandomMechanism(rng, kind, closure, base, open ? 3 : 0, open ? 2 : 0);
          std::vector<ContactTarget> contacts;
          if (base == MechanismBase::FreeFlyer) contacts = {{0, randomPlacement(rng), 5, 4}, {1, SE3(), 0, 10}};
          VectorXd q = mechanism.q_closed;
          if (open) q = mechanism.model.integrate(q, randomVector(rng, mechanism.model.nv(), 0.1));
          checkForwardDynamics(rng, mechanism.model, contacts, q);
        }
}

TEST_CASE("variation: forward dynamics with springs and dampers on joints and between points") {
  std::mt19937 rng(24);
  for (JointKind kind : kJointKinds) {
    CAPTURE(getName(kind));
    const Mechanism mechanism = makeSprungMechanism(rng, kind, ClosureKind::Ball3D, MechanismBase::FreeFlyer);
    checkForwardDynamics(rng, mechanism.model, {}, mechanism.q_closed);
  }
}

TEST_CASE("variation: forward dynamics with polynomials in couplers, closed and open") {
  std::mt19937 rng(26);
  for (JointKind kind : {JointKind::Revolute, JointKind::Prismatic, JointKind::Spherical})
    for (ClosureKind closure : {ClosureKind::Ball3D, ClosureKind::Coupler})
      for (bool open : {false, true}) {
        CAPTURE(getName(kind), getName(closure), open);
        const Mechanism mechanism =
            makeCammedMechanism(rng, kind, closure, MechanismBase::FreeFlyer, open ? 3 : 0, open ? 2 : 0);
        VectorXd q = mechanism.q_closed;
        if (open) q = mechanism.model.integrate(q, randomVector(rng, mechanism.model.nv(), 0.1));
        checkForwardDynamics(rng, mechanism.model, {}, q);
      }
}

TEST_CASE("variation: redundant rows, changes that leave them so") {
  const Mechanism mechanism = makePlanarFourBar(0.4, 0.15, 0.35, 0.3, 1.1);
  const Model& model = mechanism.model;
  const ConstraintSet set = makeConstraintSet(model);
  Workspace ws(model);
  ConstrainedWorkspace cws;
  const VectorXd& q = mechanism.q_closed;
  updatePositions(model, ws, q);
  const Closing closing(model, ws, set, {0});
  REQUIRE(closing.isDetermined());
  const VectorXd v = closing.calcTangent() * VectorXd::Constant(1, 2.0);
  const VectorXd tau = VectorXd::Unit(4, 0) * 3;
  REQUIRE(updateConstrainedDynamics(model, ws, cws, set, q, v, tau) == NumericalStatus::Ok);
  REQUIRE(cws.saddle_point->isRedundant());
  std::vector<ModelVariation> directions;
  for (int body = 2; body <= 4; ++body)  // lengths of crank, coupler and rocker, and their joints out of line
    for (int k : {0, 2}) {
      directions.emplace_back(model);
      directions.back().joints[body] = Vector6d::Unit(k);
    }
  for (int k : {0, 2, 4}) {  // in the plane, and about its normal
    directions.emplace_back(model);
    directions.back().frames1[0] = Vector6d::Unit(k);
    directions.emplace_back(model);
    directions.back().frames2[0] = Vector6d::Unit(k);
  }
  const auto solve = [&](const Model& moved, const VectorXd& x, const VectorXd& y) {
    Workspace other(moved);
    ConstrainedWorkspace ocws;
    REQUIRE(updateConstrainedDynamics(moved, other, ocws, makeConstraintSet(moved), x, y, tau) == NumericalStatus::Ok);
    VectorXd out(8);
    out << ocws.a, ocws.J.transpose() * ocws.lambda;
    return out;
  };

  // Along the closed motions: dq and dv of Eq. (2) come along. J^T lambda = M a + b - tau, whatever lambda is.
  std::vector<MotionVariation> motions;
  for (const ModelVariation& direction : directions) {
    motions.emplace_back(model);
    CHECK(closing.calcMotion(model, ws, direction, motions.back()) < 1e-9);
  }
  const DynamicsVariation analytic = calcConstrainedVariation(model, ws, cws, set, directions, motions);
  const MatrixXd numeric = differentiateModel(model, directions, kModelStep, [&](const Model& moved) {
    const VectorXd x = moved.integrate(q, closeHeld(moved, q, {0}));
    Workspace other(moved);
    updatePositions(moved, other, x);
    return solve(moved, x,
                 Closing(moved, other, makeConstraintSet(moved), {0}).calcTangent() * VectorXd::Constant(1, 2.0));
  });
  MatrixXd forces(4, numeric.cols());
  for (Eigen::Index i = 0; i < numeric.cols(); ++i) {
    MotionVariation motion = motions[i];
    motion.a = analytic.a.col(i);
    VariationWorkspace variation(model);
    updateVariation(model, ws, directions[i], motion, variation);
    forces.col(i) = calcInverseDynamicsVariation(model, ws, {}, VectorXd(), directions[i], motion, variation);
  }
  checkDerivative(analytic.a, numeric.topRows(4));
  checkDerivative(forces, numeric.bottomRows(4));

  // A longer rod when the crank and the rocker are held: no motion makes up for it.
  MotionVariation motion(model);
  CHECK(Closing(model, ws, set, {0, 1, 2, 3}).calcMotion(model, ws, directions[0], motion) > 0.5);
}

TEST_CASE("variation: motor torques, forces and closing of a kept motion", "[sweep]") {
  std::mt19937 rng(23);
  Selection selection;
  for (JointKind kind : kJointKinds)
    for (ClosureKind closure : kClosureKinds) {
      if (selection.isLeftOut()) continue;
      CAPTURE(getName(kind), getName(closure));
      const Mechanism mechanism = makeRandomMechanism(rng, kind, closure, MechanismBase::FreeFlyer);
      const Model model = addContactsEverywhere(mechanism.model);
      const VectorXd& q = mechanism.q_closed;
      const std::vector<int> kept = chooseKept(model, q);
      REQUIRE(static_cast<int>(kept.size()) == model.nv() - getRows(closure));
      std::vector<ContactTarget> contacts;
      for (size_t c = 0; c < model.contacts().size(); ++c) contacts.push_back({static_cast<int>(c), SE3(), 7, 3});
      const ConstraintSet set = makeConstraintSet(model, contacts);
      const int rows = set.rows, loops = getRows(closure), nk = static_cast<int>(kept.size());
      const VectorXd v = randomVector(rng, nk), a = randomVector(rng, nk), forces = randomVector(rng, rows - loops, 5);
      KeptMotion motion(model, kept);
      REQUIRE(motion.update(set, q, v, a, forces) == NumericalStatus::Ok);

      // The motion is closed and balanced, and no forces that do the same are nearer.
      Workspace ws(model);
      const VectorXd force = calcInverseDynamics(model, ws, q, motion.v(), motion.a());
      MatrixXd J = MatrixXd::Zero(rows, model.nv());
      for (size_t c = 0; c < set.closures.size(); ++c)
        calcClosureJacobian(ws, set.closures[c], J.middleRows(set.offsets[c], getRows(set.closures[c].kind)));
      CHECK(calcClosureVelocity(ws, set.closures[0]).norm() < 1e-10);
      CHECK(calcClosureAcceleration(ws, set.closures[0]).norm() < 1e-9);
      CHECK(calcRelativeError(calcMotorForces(model, motion.u()) + J.transpose() * motion.lambda(), force) < 1e-9);
      MatrixXd G(model.nv(), model.nu() + rows);
      G << MatrixXd::Zero(model.nv(), model.nu()), J.transpose();
      for (int m = 0; m < model.nu(); ++m) G(model.motors()[m].dof, m) = 1;
      const MatrixXd others = Eigen::FullPivLU<MatrixXd>(G).kernel();
      const VectorXd farther = motion.lambda().tail(rows - loops) - forces;
      CHECK(farther.norm() > 1e-3);
      CHECK((others.bottomRows(rows - loops).transpose() * farther).norm() < 1e-8 * farther.norm() * others.norm());

      const std::vector<ModelVariation> directions = listVariations(rng, model);
      const int nv = model.nv(), nu = model.nu();
      const MatrixXd numeric = differentiateModel(model, directions, kModelStep, [&](const Model& moved) {
        const VectorXd d = closeHeld(moved, q, kept);
        KeptMotion other(moved, kept);
        REQUIRE(other.update(makeConstraintSet(moved, contacts), moved.integrate(q, d), v, a, forces) ==
                NumericalStatus::Ok);
        VectorXd out(4 * nv + nu + rows);
        out << d, other.v(), other.a(), other.tangent() * a, other.u(), other.lambda();
        return out;
      });
      MatrixXd analytic(numeric.rows(), numeric.cols());
      for (Eigen::Index i = 0; i < numeric.cols(); ++i) {
        KeptMotion::Variation variation(model);
        REQUIRE(motion.calcVariation(directions[i], variation) == NumericalStatus::Ok);
        analytic.col(i) << variation.motion.q, variation.motion.v, variation.motion.a,
            motion.calcTangentVariation(directions[i], variation.motion, a), variation.u, variation.lambda;
      }
      checkDerivative(analytic.topRows(nv), numeric.topRows(nv), "q");
      checkDerivative(analytic.middleRows(nv, nv), numeric.middleRows(nv, nv), "v");
      checkDerivative(analytic.middleRows(2 * nv, nv), numeric.middleRows(2 * nv, nv), "a");
      checkDerivative(analytic.middleRows(3 * nv, nv), numeric.middleRows(3 * nv, nv), "T a");
      checkDerivative(analytic.middleRows(4 * nv, nu), numeric.middleRows(4 * nv, nu), "u");
      checkDerivative(analytic.bottomRows(rows), numeric.bottomRows(rows), "lambda");
    }
}

TEST_CASE("variation: Bipetto on one foot with its motors held, when its rods change") {
  const Model bipetto = loadRobot(std::string(BIELLE_SOURCE_DIR) + "/robots/bipetto").model;
  const VectorXd q = assembleReference(bipetto, bipetto.references().front().name).q;
  Workspace ws(bipetto);
  updatePositions(bipetto, ws, q);
  const int foot = 0;
  const ContactFrame& frame = bipetto.contacts()[foot];
  const std::vector<ContactTarget> stance = {{foot, getPlacement(ws, frame.body, frame.X_BF), 0, 0}};
  std::vector<int> motors;
  for (const Motor& motor : bipetto.motors()) motors.push_back(motor.dof);
  updateVelocities(bipetto, ws, VectorXd::Zero(bipetto.nv()));
  updateAccelerations(bipetto, ws, VectorXd::Zero(bipetto.nv()));
  const Closing closing(bipetto, ws, makeConstraintSet(bipetto, stance), motors);
  REQUIRE(closing.isDetermined());
  std::vector<ModelVariation> directions;
  for (size_t c = 0; c < bipetto.closures().size(); ++c)
    for (int k = 0; k < 6; ++k) {
      directions.emplace_back(bipetto);
      directions.back().frames1[c] = Vector6d::Unit(k);
    }
  MatrixXd analytic(bipetto.nv(), directions.size());
  for (size_t i = 0; i < directions.size(); ++i) {
    MotionVariation motion(bipetto);
    CHECK(closing.calcMotion(bipetto, ws, directions[i], motion) < 1e-9);
    analytic.col(static_cast<Eigen::Index>(i)) = motion.q;
  }
  CHECK(analytic.topRows(6).cwiseAbs().maxCoeff() > 10);  // a longer rod of the stance leg moves the trunk
  for (int dof : motors) CHECK(analytic.row(dof).cwiseAbs().maxCoeff() < 1e-9);
  checkDerivative(analytic, differentiateModel(bipetto, directions, kModelStep, [&](const Model& moved) {
                    return closeHeld(moved, q, motors, stance);
                  }));
}

TEST_CASE("variation: impossible changes are reported") {
  const Mechanism mechanism = makePlanarFourBar(0.4, 0.15, 0.35, 0.3, 1.1);
  const ConstraintSet set = makeConstraintSet(mechanism.model);
  const VectorXd none, one = VectorXd::Ones(1);
  KeptMotion free(mechanism.model, {});
  CHECK(free.update(set, mechanism.q_closed, none, none, none) == NumericalStatus::NearDeadPoint);
  KeptMotion crank(mechanism.model, {0});
  CHECK(crank.update(set, mechanism.q_closed, one, one, none) == NumericalStatus::Ok);
  KeptMotion::Variation variation(mechanism.model);
  ModelVariation change(mechanism.model);
  change.frames1[0] = Vector6d::Unit(0);  // in the plane, then out of it
  CHECK(crank.calcVariation(change, variation) == NumericalStatus::Ok);
  change.frames1[0] = Vector6d::Unit(1);
  CHECK(crank.calcVariation(change, variation) == NumericalStatus::Contradictory);
  // Without its motor the crank cannot be given an acceleration.
  ModelBuilder builder("pendulum");
  Joint joint;
  joint.name = "hinge", joint.kind = JointKind::Revolute, joint.axis = Vector3d::UnitY();
  Inertia bob;
  bob.mass = 1, bob.com = Vector3d::UnitX();
  builder.addLink("bob", "world", joint, bob);
  const Model pendulum = builder.build();
  KeptMotion swing(pendulum, {0});
  CHECK(swing.update(makeConstraintSet(pendulum), VectorXd::Zero(1), one, one, none) == NumericalStatus::Unbalanced);
  CHECK(swing.update(makeConstraintSet(pendulum), VectorXd::Zero(1), one, 9.81 * one, none) == NumericalStatus::Ok);
}
