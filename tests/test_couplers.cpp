// Couplers. Oracles: gears and a differential in closed form, central differences along closed motions, the same
// mechanism without the redundant row.
#include <Eigen/SVD>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/constrained.h"
#include "bielle/dynamics/kinematics.h"
#include "check_derivative.h"
#include "dynamics/constrained_parts.h"
#include "dynamics/saddle_point.h"
#include "get_error.h"
#include "selection.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

// Rotors side by side about z, of the given moments of inertia, without gravity.
ModelBuilder makeRotors(const std::vector<double>& inertias) {
  ModelBuilder builder("rotors");
  builder.setGravity(Vector3d::Zero());
  for (size_t i = 0; i < inertias.size(); ++i) {
    Joint joint;
    joint.name = "r" + std::to_string(i + 1);
    joint.kind = JointKind::Revolute;
    joint.X_PJ.p.x() = static_cast<double>(i);
    builder.addLink("rotor" + std::to_string(i + 1), "world", joint,
                    {1, Vector3d::Zero(), Vector3d(inertias[i], inertias[i], inertias[i]).asDiagonal()});
  }
  return builder;
}

struct Solved {
  VectorXd a, lambda;
};

Solved solveAtRest(const Model& model, const VectorXd& q, const VectorXd& tau) {
  Workspace ws(model);
  ConstrainedWorkspace cws;
  REQUIRE(updateConstrainedDynamics(model, ws, cws, makeConstraintSet(model), q, VectorXd::Zero(model.nv()), tau) ==
          NumericalStatus::Ok);
  return {cws.a, cws.lambda};
}

MatrixXd calcJacobian(const Model& model, const VectorXd& q) {
  Workspace ws(model);
  ConstrainedWorkspace cws;
  REQUIRE(updateConstrainedSystem(model, ws, cws, makeConstraintSet(model), q));
  return cws.J;
}

// Basis of the velocities that keep the loops closed.
MatrixXd calcClosedMotions(const MatrixXd& J) {
  const Eigen::JacobiSVD<MatrixXd> svd(J, Eigen::ComputeFullV);
  const Eigen::Index rank = (svd.singularValues().array() > 1e-7 * svd.singularValues()[0]).count();
  return svd.matrixV().rightCols(J.cols() - rank);
}

}  // namespace

TEST_CASE("a pair of gears: accelerations and force in closed form") {
  constexpr double I1 = 0.3, I2 = 2, n = 5, torque = 7;
  ModelBuilder builder = makeRotors({I1, I2});
  builder.addCoupler("gears", {{"r1", 1}, {"r2", n}}, 0.4);  // r1 = 0.4 - n r2
  const Model model = builder.build();
  const Solved out = solveAtRest(model, Eigen::Vector2d(0.4, 0), Eigen::Vector2d(torque, 0));
  const double a1 = torque / (I1 + I2 / (n * n));
  CHECK(out.a[0] == Approx(a1).epsilon(1e-12));
  CHECK(out.a[1] == Approx(-a1 / n).epsilon(1e-12));
  CHECK(out.lambda[0] == Approx(I2 * out.a[1] / n).epsilon(1e-12));
  CHECK(out.lambda[0] == Approx(I1 * a1 - torque).epsilon(1e-12));
}

TEST_CASE("a cam: accelerations and force in closed form, and the energy of a swing stays") {
  // y = x^2 - 0.5 x^3 between two rotors of moments I and J without gravity: with s = dy/dx, the energy (I + J s^2) w^2 / 2
  // stays, so that (I + J s^2) w' + J s s' w^2 = 0.
  constexpr double I = 0.3, J = 2;
  ModelBuilder builder = makeRotors({I, J});
  builder.addCoupler("cam", {{"r1", 0}, {"r2", -1}}, 0, 0, 0, {{"r1", {1, -0.5}}});
  const Model model = builder.build();
  const ConstraintSet set = makeConstraintSet(model);
  Workspace ws(model);
  ConstrainedWorkspace cws;
  const auto s = [](double x) { return 2 * x - 1.5 * x * x; };
  const auto solve = [&](double x, double w) {
    REQUIRE(updateConstrainedDynamics(model, ws, cws, set, Eigen::Vector2d(x, x * x - 0.5 * x * x * x),
                                      Eigen::Vector2d(w, s(x) * w), Eigen::Vector2d::Zero()) == NumericalStatus::Ok);
    return cws.a[0];
  };
  for (const double x : {-0.7, 0.0, 0.4, 1.1}) {
    const double w = 1.5 - x, slope = s(x), curvature = 2 - 3 * x;
    const double a = -J * slope * curvature * w * w / (I + J * slope * slope);
    CHECK(solve(x, w) == Approx(a).epsilon(1e-12).margin(1e-14));
    CHECK(cws.a[1] == Approx(slope * a + curvature * w * w).epsilon(1e-12));
    CHECK(cws.lambda[0] == Approx(-J * cws.a[1]).epsilon(1e-12));
  }
  // Runge and Kutta's rule over a swing.
  double x = -0.6, w = 1;
  const double energy = (I + J * s(x) * s(x)) * w * w / 2, h = 1e-3;
  for (int i = 0; i < 1000; ++i) {
    const double k1 = solve(x, w), k2 = solve(x + h / 2 * w, w + h / 2 * k1),
                 k3 = solve(x + h / 2 * (w + h / 2 * k1), w + h / 2 * k2),
                 k4 = solve(x + h * (w + h / 2 * k2), w + h * k3);
    x += h * (w + h / 6 * (k1 + k2 + k3));
    w += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
  }
  CHECK(x > 0.2);
  CHECK((I + J * s(x) * s(x)) * w * w / 2 == Approx(energy).epsilon(1e-9));
}

TEST_CASE("a differential: two motors turn pitch by their mean, roll by half their difference") {
  constexpr double Im = 0.1, Ip = 1.5, Ir = 0.7;
  ModelBuilder builder = makeRotors({Im, Im, Ip, Ir});  // r1, r2: motors; r3: pitch; r4: roll
  builder.addCoupler("sum", {{"r1", 0.5}, {"r2", 0.5}, {"r3", -1}});
  builder.addCoupler("difference", {{"r1", 0.5}, {"r2", -0.5}, {"r4", -1}});
  const Model model = builder.build();
  REQUIRE(model.clusters().size() == 1);
  CHECK(model.clusters()[0].rows == 2);
  CHECK(calcMobility(model, VectorXd::Zero(4)).mobility == 2);
  const Eigen::Vector2d torque(3, -1);
  const Solved out = solveAtRest(model, VectorXd::Zero(4), Eigen::Vector4d(torque[0], torque[1], 0, 0));
  // By virtual work: pitch sees the sum of the torques and two rotors, roll their difference and the same rotors.
  const double pitch = torque.sum() / (Ip + 2 * Im), roll = (torque[0] - torque[1]) / (Ir + 2 * Im);
  CHECK(out.a[2] == Approx(pitch).epsilon(1e-12));
  CHECK(out.a[3] == Approx(roll).epsilon(1e-12));
  CHECK(out.a[0] == Approx(pitch + roll).epsilon(1e-12));
  CHECK(out.a[1] == Approx(pitch - roll).epsilon(1e-12));
}

TEST_CASE("the dofs of a coupler are those between its joints and the body that carries them all") {
  ModelBuilder builder("tree");
  const auto add = [&](const std::string& link, const std::string& parent, JointKind kind) {
    Joint joint;
    joint.name = "to_" + link;
    joint.kind = kind;
    builder.addLink(link, parent, joint, {1, Vector3d(0.1, 0, 0), 0.1 * Matrix3d::Identity()});
  };
  add("trunk", "world", JointKind::FreeFlyer);
  add("a", "trunk", JointKind::Revolute);
  add("a_ball", "a", JointKind::Spherical);
  add("a_slide", "a_ball", JointKind::Prismatic);
  add("b", "trunk", JointKind::Continuous);
  add("c", "b", JointKind::Revolute);
  add("d", "c", JointKind::Revolute);
  builder.addCoupler("across", {{"to_a_slide", 2}, {"to_b", -1}});
  builder.addCoupler("along", {{"to_c", 1}, {"to_d", 1}}, 0.2, 3, 4);
  const Model model = builder.build();
  const Closure &across = model.closures()[0], &along = model.closures()[1];
  CHECK(model.bodies()[across.body1].name == "trunk");
  CHECK(across.body2 == across.body1);
  CHECK(across.dofs == std::vector<int>{6, 7, 8, 9, 10, 11});
  REQUIRE(across.terms.size() == 2);
  CHECK(across.terms[0].dof == 10);
  CHECK(across.terms[0].idx_q == 12);
  CHECK(across.terms[0].coefficient == 2);
  CHECK(model.bodies()[along.body1].name == "b");
  CHECK(along.dofs == std::vector<int>{12, 13});
  CHECK(along.offset == 0.2);
  CHECK(along.kp == 3);
  CHECK(along.kd == 4);
  CHECK(model.clusters().size() == 2);
  CHECK(model.numClosureRows() == 2);

  ModelBuilder copy("copy");  // with the joints but not the closures
  for (int i = 1; i < model.numBodies(); ++i)
    copy.addLink(model.bodies()[i].name,
                 model.joints()[i].parent ? model.bodies()[model.joints()[i].parent].name : "world", model.joints()[i],
                 model.bodies()[i].inertia);
  for (const Closure& closure : model.closures()) copy.copyClosure(model, closure);
  const Model copied = copy.build();
  CHECK(copied.closures()[1].dofs == along.dofs);
  CHECK(copied.closures()[1].offset == along.offset);
  CHECK(copied.closures()[1].kd == along.kd);
  CHECK_THAT(getError([&] {
               copy.addCoupler("bad", {{"to_a_ball", 1}, {"to_b", 1}});
             }),
             Catch::Contains("spherical joint of 3 coordinates"));
  CHECK_THAT(getError([&] {
               copy.addCoupler("across", {{"to_a", 1}, {"to_b", 1}});
             }),
             Catch::Contains("two closures have this name"));
  CHECK_THAT(getError([&] { copy.addCoupler("bad", {{"to_a", 1}, {"to_b", NAN}}); }), Catch::Contains("not finite"));
  const auto couple = [&](const std::string& joint, double coefficient, const std::vector<double>& higher) {
    return getError([&] { copy.addCoupler("bad", {{"to_a", 1}, {"to_b", coefficient}}, 0, 0, 0, {{joint, higher}}); });
  };
  CHECK_THAT(couple("to_b", 1, {0.5, NAN}), Catch::Contains("not finite"));
  CHECK_THAT(couple("to_b", 0, {0, 0}), Catch::Contains("is zero"));
  CHECK_THAT(couple("to_c", 1, {0.5}), Catch::Contains("'to_c' has coefficients of powers but is not coupled"));
}

TEST_CASE("couplers in the loops of other closures, redundant or not: derivatives along closed motions", "[sweep]") {
  std::mt19937 rng(32);
  Selection selection;
  for (JointKind kind : kJointKinds)
    for (ClosureKind closure : kClosureKinds)
      for (const std::string how : {"belt", "repeated belt", "cam"}) {
        if (selection.isLeftOut()) continue;
        CAPTURE(getName(kind), getName(closure), how);
        const bool repeated = how == "repeated belt";
        const Mechanism mechanism = how == "cam"
                                        ? makeCammedMechanism(rng, kind, closure, MechanismBase::FreeFlyer)
                                        : makeBeltedMechanism(rng, kind, closure, MechanismBase::FreeFlyer, repeated);
        const Model& model = mechanism.model;
        const VectorXd& q = mechanism.q_closed;
        REQUIRE(model.clusters().size() == 1);
        const ConstraintSet set = makeConstraintSet(model);
        Workspace ws(model);
        ConstrainedWorkspace cws;
        const VectorXd v = projectVelocity(model, ws, set, q, randomVector(rng, model.nv()));
        const VectorXd tau = randomVector(rng, model.nv(), 10);
        REQUIRE(updateConstrainedDynamics(model, ws, cws, set, q, v, tau) == NumericalStatus::Ok);
        CHECK(cws.saddle_point->isRedundant() == repeated);
        REQUIRE(updateConstrainedDerivatives(model, ws, cws, set) == NumericalStatus::Ok);
        const MatrixXd N = calcClosedMotions(cws.J);
        CHECK(N.cols() == model.nv() - getRows(closure) - 1);
        Workspace other(model);
        ConstrainedWorkspace ocws;
        // dq and dv of a closed motion along each column of N, by differences, and of the accelerations.
        const int nv = model.nv();
        const auto along = [&](const VectorXd& t) {
          const AssemblyResult closed = closeConfiguration(model, model.integrate(q, N * t));
          REQUIRE(closed.status == NumericalStatus::Ok);
          const VectorXd w = projectVelocity(model, other, set, closed.q, v);
          REQUIRE(updateConstrainedDynamics(model, other, ocws, set, closed.q, w, tau) == NumericalStatus::Ok);
          VectorXd out(3 * nv);
          out << model.difference(q, closed.q), w, ocws.a;
          return out;
        };
        const MatrixXd numeric = differentiate(VectorXd::Zero(N.cols()), 1e-3, along);
        checkDerivative(cws.da_dq * numeric.topRows(nv) + cws.da_dv * numeric.middleRows(nv, nv),
                        numeric.bottomRows(nv));
      }
}

TEST_CASE("a coupler said twice leaves the accelerations as they are") {
  std::mt19937 rng(32), same(32);
  const Mechanism once =
      makeBeltedMechanism(rng, JointKind::Revolute, ClosureKind::Ball3D, MechanismBase::Fixed, false);
  const Mechanism twice =
      makeBeltedMechanism(same, JointKind::Revolute, ClosureKind::Ball3D, MechanismBase::Fixed, true);
  REQUIRE(once.q_closed == twice.q_closed);
  const VectorXd tau = randomVector(rng, once.model.nv(), 10);
  const Solved a = solveAtRest(once.model, once.q_closed, tau), b = solveAtRest(twice.model, once.q_closed, tau);
  CHECK(calcRelativeError(b.a, a.a) < 1e-9);
  CHECK(calcRelativeError(calcJacobian(twice.model, once.q_closed).transpose() * b.lambda,
                          calcJacobian(once.model, once.q_closed).transpose() * a.lambda) < 1e-8);
}
