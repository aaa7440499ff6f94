// Linear modes. Oracles: oscillators and pendulums in closed form, the energy of a four-bar along its one motion, central
// differences.
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/modes.h"
#include "bielle/dynamics/rnea.h"
#include "bielle/model/builder.h"
#include "bielle/robots/fourbar_chain.h"
#include "math/constants.h"
#include "mechanisms.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

Joint makeModesJoint(const std::string& name, JointKind kind, const Vector3d& axis, const Vector3d& at) {
  Joint joint;
  joint.name = name;
  joint.kind = kind;
  joint.axis = axis;
  joint.X_PJ.p = at;
  return joint;
}

// Point masses of 1 kg at the ends of rods of a metre, below each other.
Model makeHangingRods(int rods) {
  ModelBuilder builder("pendulum");
  std::string parent = "world";
  Inertia bob;
  bob.mass = 1;
  bob.com = {0, 0, -1};
  for (int i = 0; i < rods; ++i) {
    const std::string name = "rod" + std::to_string(i);
    builder.addLink(name, parent,
                    makeModesJoint("hinge" + std::to_string(i), JointKind::Continuous, Vector3d::UnitY(),
                                   i == 0 ? Vector3d(0, 0, 0) : Vector3d(0, 0, -1)),
                    bob);
    parent = name;
  }
  return builder.build();
}

Modes calcFreeModes(const Model& model, const VectorXd& q) {
  return calcModes(model, makeConstraintSet(model), q, VectorXd::Zero(model.nv()));
}

double calcHeldEnergy(const Model& model, const VectorXd& q) {
  Workspace ws(model);
  updatePositions(model, ws, q);
  return calcPotentialEnergy(model, ws);
}

}  // namespace

TEST_CASE("modes of a mass on a spring with a damper") {
  ModelBuilder builder("oscillator");
  builder.addLink("mass", "world", makeModesJoint("slide", JointKind::Prismatic, Vector3d::UnitX(), {0, 0, 0}),
                  {2, Vector3d::Zero(), 0.1 * Matrix3d::Identity()});
  JointForce force;
  force.stiffness = 50, force.rest = 0.1, force.damping = 4;
  builder.addJointForce("slide", force);
  const Model model = builder.build();
  const Modes found = calcFreeModes(model, VectorXd::Constant(1, 0.1));
  REQUIRE(found.modes.size() == 1);
  CHECK(found.acceleration == 0);
  const double omega = 5, zeta = 4 / (2 * std::sqrt(50.0 * 2));
  CHECK(std::abs(found.modes[0].eigenvalue) == Approx(omega).epsilon(1e-13));
  CHECK(found.modes[0].damping == Approx(zeta).epsilon(1e-13));
  CHECK(found.modes[0].frequency == Approx(omega * std::sqrt(1 - zeta * zeta) / (2 * kPi)).epsilon(1e-13));
  CHECK(std::abs(found.modes[0].shape[0] - 1.0) < 1e-15);
  // Away from its rest it does not rest, and that is told.
  CHECK(calcFreeModes(model, VectorXd::Constant(1, 0.3)).acceleration == Approx(5));
  // A thousandth of the stiffness is noticed.
  const std::vector<Mode> other = calcModes(found.N, 1.001 * found.stiffness, found.damping);
  CHECK(std::abs(std::abs(other[0].eigenvalue) - omega) > 1e-3);
}

TEST_CASE("modes of pendulums, hanging, standing and locked") {
  const double g = 9.81;
  const Modes single = calcFreeModes(makeHangingRods(1), VectorXd::Zero(1));
  REQUIRE(single.modes.size() == 1);
  CHECK(single.modes[0].frequency == Approx(std::sqrt(g) / (2 * kPi)).epsilon(1e-13));
  CHECK(std::abs(single.modes[0].damping) < 1e-13);
  const Modes standing = calcFreeModes(makeHangingRods(1), VectorXd::Constant(1, kPi));
  REQUIRE(standing.modes.size() == 2);
  for (const Mode& mode : standing.modes) {
    CHECK(mode.frequency == 0);
    CHECK(std::abs(mode.eigenvalue.real()) == Approx(std::sqrt(g)).epsilon(1e-12));
  }
  CHECK(standing.modes[0].eigenvalue.real() * standing.modes[1].eigenvalue.real() < 0);
  const Model model = makeHangingRods(2);
  const Modes twice = calcFreeModes(model, VectorXd::Zero(2));
  REQUIRE(twice.modes.size() == 2);
  for (int i = 0; i < 2; ++i) {
    const double sign = i == 0 ? -1 : 1;
    CHECK(twice.modes[i].frequency == Approx(std::sqrt(g * (2 + sign * std::sqrt(2.0))) / (2 * kPi)).epsilon(1e-12));
    // The lower rod turns by -sign sqrt 2 as far as the upper one, its joint by as much less the turn of the upper rod.
    const std::complex<double> ratio = twice.modes[i].shape[1] / twice.modes[i].shape[0];
    CHECK(std::abs(ratio - (-sign * std::sqrt(2.0) - 1)) < 1e-12);
  }
  ConstraintSet locked = makeConstraintSet(model);
  addLock(model, VectorXd::Zero(2), 2, locked);
  const Modes one = calcModes(model, locked, VectorXd::Zero(2), VectorXd::Zero(2));
  REQUIRE(one.modes.size() == 1);
  CHECK(one.modes[0].frequency == Approx(std::sqrt(g * 3 / 5) / (2 * kPi)).epsilon(1e-12));
  CHECK(std::abs(one.modes[0].shape[1]) < 1e-13);
}

TEST_CASE("the mode of a four-bar with a spring, by its energy along its one motion") {
  FourBarChainOptions options;
  const auto make = [&options](double angle) {
    options.crank_angle = angle;
    return makeFourBarChain(options);
  };
  const double angle = 1.1, h = 1e-3;
  const FourBarChain chain = make(angle);
  ModelParts parts = takeParts(chain.model);
  JointForce spring;
  spring.joint = chain.model.findJoint("rocker1");
  spring.idx_q = chain.model.joints()[spring.joint].idx_q;
  spring.dof = chain.model.joints()[spring.joint].idx_v;
  spring.stiffness = 7, spring.rest = 1, spring.damping = 0.02;
  parts.joint_forces.push_back(spring);
  const Model model = ModelBuilder::restore(parts);
  std::vector<VectorXd> q;
  std::vector<double> V;
  for (int i = -2; i <= 2; ++i) {
    q.push_back(make(angle + i * h).q_closed);
    V.push_back(calcHeldEnergy(model, q.back()));
  }
  const double slope = (8 * (V[3] - V[1]) - (V[4] - V[0])) / (12 * h);
  const double curvature = (-V[0] + 16 * V[1] - 30 * V[2] + 16 * V[3] - V[4]) / (12 * h * h);
  const VectorXd tangent = (8 * (q[3] - q[1]) - (q[4] - q[0])) / (12 * h);
  Workspace ws(model);
  updatePositions(model, ws, q[2]);
  updateMassMatrix(model, ws);
  const double inertia = tangent.dot(ws.M * tangent);
  VectorXd tau = VectorXd::Zero(model.nv());
  tau[model.motors()[0].dof] = slope;
  const Modes found = calcModes(model, makeConstraintSet(model), q[2], tau);
  CHECK(found.acceleration < 1e-6);
  REQUIRE(found.modes.size() == 1);
  const double square = curvature / inertia, resistance = 0.02 * std::pow(tangent[spring.dof], 2) / inertia;
  CHECK(std::norm(found.modes[0].eigenvalue) == Approx(square).epsilon(1e-6));
  CHECK(-2 * found.modes[0].eigenvalue.real() == Approx(resistance).epsilon(1e-8));
  // Without the turning of the closure forces the frequency is another one.
  Modes poisoned = found;
  poisoned.stiffness *= 1.001;
  CHECK(std::norm(calcModes(poisoned.N, poisoned.stiffness, poisoned.damping)[0].eigenvalue) !=
        Approx(square).epsilon(1e-5));
}

TEST_CASE("stiffness in reduced coordinates against central differences, under large closure forces") {
  std::mt19937 rng(5);
  for (const JointKind kind : {JointKind::Revolute, JointKind::Spherical, JointKind::Universal, JointKind::Planar}) {
    CAPTURE(getName(kind));
    const Mechanism mechanism = makeRandomMechanism(rng, kind, ClosureKind::Ball3D, MechanismBase::FreeFlyer);
    const Model& model = mechanism.model;
    const VectorXd q = closeConfiguration(model, mechanism.q_closed).q;
    const ConstraintSet set = makeConstraintSet(model);
    Workspace ws(model);
    ConstrainedWorkspace cws;
    const VectorXd rest = VectorXd::Zero(model.nv());
    REQUIRE(updateConstrainedDynamics(model, ws, cws, set, q, rest, rest) == NumericalStatus::Ok);
    const VectorXd tau = ws.b - cws.J.transpose() * randomVector(rng, set.rows, 50);
    const Modes found = calcModes(model, set, q, tau);
    REQUIRE(found.status == NumericalStatus::Ok);
    CHECK(found.acceleration < 1e-8);
    const MatrixXd M = ws.M, weights = found.N.transpose() * M;
    CHECK((weights * found.N - MatrixXd::Identity(found.N.cols(), found.N.cols())).norm() < 1e-10);
    const auto calc = [&](const VectorXd& y) -> VectorXd {
      AssemblyOptions exact;
      exact.step = AssemblyStep::Shortest;
      exact.tolerance = 1e-14;
      const VectorXd near = closeConfiguration(model, model.integrate(q, found.N * y), exact).q;
      updateConstrainedDynamics(model, ws, cws, set, near, rest, tau);
      return -weights * cws.a;
    };
    const double h = 1e-5;
    MatrixXd K(found.N.cols(), found.N.cols());
    for (int i = 0; i < K.cols(); ++i) {
      const VectorXd y = h * VectorXd::Unit(K.cols(), i);
      K.col(i) = (calc(y) - calc(-y)) / (2 * h);
    }
    const double scale = K.cwiseAbs().maxCoeff(), error = (K - found.stiffness).cwiseAbs().maxCoeff();
    CAPTURE(scale, error);
    CHECK(error < 1e-5 * scale);
    Eigen::Index row, column;
    K.cwiseAbs().maxCoeff(&row, &column);
    MatrixXd wrong = found.stiffness;
    wrong(row, column) *= 1.001;
    CHECK((K - wrong).cwiseAbs().maxCoeff() > 5e-4 * scale);
  }
}

TEST_CASE("a box on a sole of stiff corners bounces, slides and tilts as a rigid body on springs") {
  const double mass = 3, k = 5e4, x = 0.1, y = 0.06, height = 0.25, radius = 0.05;
  ModelBuilder builder("box");
  builder.addLink("box", "world", makeModesJoint("base", JointKind::FreeFlyer, Vector3d::UnitZ(), {0, 0, 0}),
                  {mass, {0, 0, height}, radius * Matrix3d::Identity()});
  builder.addContact("sole", "box", ContactKind::Surface6D, x, y);
  const Model model = builder.build();
  const VectorXd q = model.makeNeutral(), tau = VectorXd::Zero(6);
  const ConstraintSet stands = makeConstraintSet(model, {{0, SE3(), 0, 0}});
  const Modes rigid = calcModes(model, stands, q, tau);
  CHECK(rigid.acceleration < 1e-12);
  CHECK(rigid.modes.empty());
  const Model compliant = makeCompliantContacts(model, stands, q, rigid.lambda, k);
  const Modes found = calcModes(compliant, makeConstraintSet(compliant), q, tau);
  CHECK(found.acceleration < 1e-9);
  REQUIRE(found.modes.size() == 6);
  // Up and down; about the vertical; sideways and tilting together, in either plane: with the weight over the tilt.
  std::vector<double> squares = {k / mass, k * (x * x + y * y) / radius};
  for (const double lever : {x, y}) {
    Eigen::Matrix2d M, K;
    M << mass, mass * height, mass * height, radius + mass * height * height;
    K << k, 0, 0, k * lever * lever - mass * 9.81 * height;
    const Eigen::Vector2d pair = Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::Matrix2d>(K, M).eigenvalues();
    squares.insert(squares.end(), {pair[0], pair[1]});
  }
  std::sort(squares.begin(), squares.end());
  for (int i = 0; i < 6; ++i) CHECK(std::norm(found.modes[i].eigenvalue) == Approx(squares[i]).epsilon(1e-5));
}
