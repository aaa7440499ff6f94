// The printed equations of the paper, as they stand and as they must be (docs/signs.md): each side is computed from its
// own formula and compared with differences. Where the print is wrong the test shows that differences refute it.
#include <catch2/catch.hpp>

#include "bielle/dynamics/constrained.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/rnea.h"
#include "mechanisms.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

constexpr double kEqual = 1e-7, kDiffers = 1e-2;

// The matrix of eq. 20.
Matrix6d makeForceCross(const Vector6d& f) {
  Matrix6d out = Matrix6d::Zero();
  out.topRightCorner<3, 3>() = out.bottomLeftCorner<3, 3>() = skew(f.head<3>());
  out.bottomRightCorner<3, 3>() = skew(f.tail<3>());
  return out;
}

Matrix6d makeForceTransform(const SE3& X) { return X.toActionMatrix().inverse().transpose(); }

// A state of a mechanism with one weld, open or closed, and what the paper's section III names there.
struct State {
  State(const Model& model, const VectorXd& q, const VectorXd& v, const VectorXd& a)
      : model(model), closure(model.closures()[0]), ws(model) {
    updatePositions(model, ws, q);
    updateVelocities(model, ws, v);
    updateAccelerations(model, ws, a);
    const SE3 X_W1 = getPlacement(ws, closure.body1, closure.X_B1),
              X_W2 = getPlacement(ws, closure.body2, closure.X_B2);
    X_12 = X_W1.inverseTimes(X_W2);
    nu1 = X_W1.actInvMotion(ws.V[closure.body1]);
    nu2 = X_W2.actInvMotion(ws.V[closure.body2]);
    a1 = X_W1.actInvMotion(ws.A[closure.body1]);
    a2 = X_W2.actInvMotion(ws.A[closure.body2]);
    J1 = calcFrameJacobian(model, ws, closure.body1, closure.X_B1);
    J2 = calcFrameJacobian(model, ws, closure.body2, closure.X_B2);
    Ad = X_12.toActionMatrix();
    nu_c = nu1 - Ad * nu2;
    a_c = a1 - Ad * a2 + makeCrossMotionMatrix(nu1) * Ad * nu2;
    J_c = J1 - Ad * J2;
  }
  const Model& model;
  const Closure& closure;
  Workspace ws;
  SE3 X_12;
  Vector6d nu1, nu2, a1, a2, nu_c, a_c;  // each nu_i, a_i in its own frame
  Matrix6Xd J1, J2, J_c;
  Matrix6d Ad;
};

struct Case {
  explicit Case(unsigned seed) : rng(seed) {
    mechanism = makeRandomMechanism(rng, JointKind::Spherical, ClosureKind::Weld6D, MechanismBase::FreeFlyer);
    q = mechanism.q_closed;
    v = randomVector(rng, model().nv());
    a = randomVector(rng, model().nv());
    q_open = model().integrate(q, randomVector(rng, model().nv(), 0.2));
  }
  const Model& model() const { return mechanism.model; }
  // d/dt of f(q, v) at the open configuration, along (v, a).
  MatrixXd differentiateInTime(const VectorXd& at, const std::function<VectorXd(const VectorXd&, const VectorXd&)>& f) {
    return differentiate(VectorXd::Zero(1), kDynamicsStep,
                         [&](const VectorXd& t) { return f(model().integrate(at, t[0] * v), v + t[0] * a); });
  }
  // By q in the tangent, v and a fixed.
  MatrixXd differentiateByPosition(const std::function<VectorXd(const State&)>& f) {
    return differentiateTangent(model(), q_open, kDynamicsStep,
                                [&](const VectorXd& at) { return f(State(model(), at, v, a)); });
  }
  std::mt19937 rng;
  Mechanism mechanism;
  VectorXd q, q_open, v, a;
};

// A solution of eq. 4, and the derivative of its right-hand sides at a fixed solution.
struct Kkt {
  Kkt(const Model& model, const VectorXd& q, const VectorXd& v, const VectorXd& tau)
      : state(model, q, v, VectorXd::Zero(model.nv())) {
    const int n = model.nv();
    updateMassMatrix(model, state.ws);
    updateBias(model, state.ws);
    a_0 = state.a_c;
    K = MatrixXd::Zero(6 + n, 6 + n);
    K.topRightCorner(6, n) = state.J_c;
    K.bottomLeftCorner(n, 6) = state.J_c.transpose();
    K.bottomRightCorner(n, n) = state.ws.M;
    VectorXd k(6 + n);
    k << -a_0, tau - state.ws.b;
    y = K.fullPivLu().solve(k);
  }
  State state;
  Vector6d a_0;
  MatrixXd K;
  VectorXd y;  // lambda, acceleration
};

}  // namespace

TEST_CASE("Eqs. 2, 4 and 6: lambda of the KKT system is the opposite of that of the equation of motion") {
  for (unsigned seed = 1; seed <= 3; ++seed) {
    Case c(seed);
    const Model& model = c.model();
    const VectorXd tau = randomVector(c.rng, model.nv());
    const Kkt paper(model, c.q, c.v, tau);
    Workspace ws(model);
    ConstrainedWorkspace cws;
    REQUIRE(updateConstrainedDynamics(model, ws, cws, makeConstraintSet(model), c.q, c.v, tau) == NumericalStatus::Ok);
    CHECK(calcRelativeError(cws.a, paper.y.tail(model.nv())) < kEqual);
    CHECK(calcRelativeError(cws.lambda, -paper.y.head(6)) < kEqual);
    // Eq. 2 as printed holds with ours, not with that of eq. 4.
    const VectorXd left = paper.state.ws.M * cws.a + paper.state.ws.b - tau;
    CHECK(calcRelativeError(paper.state.J_c.transpose() * cws.lambda, left) < kEqual);
    CHECK(calcRelativeError(paper.state.J_c.transpose() * paper.y.head(6), left) > kDiffers);
  }
}

TEST_CASE("Eq. 5: a minus, and the whole acceleration of the closure") {
  for (unsigned seed = 1; seed <= 3; ++seed) {
    Case c(seed);
    const Model& model = c.model();
    const int n = model.nv();
    const VectorXd tau = randomVector(c.rng, n);
    const Kkt at(model, c.q, c.v, tau);
    const VectorXd lambda = at.y.head(6), a = at.y.tail(n);
    const auto by_q = [&](const std::function<VectorXd(const VectorXd&)>& f) {
      return differentiateTangent(model, c.q, kDynamicsStep, f);
    };
    const MatrixXd dy = by_q([&](const VectorXd& q) { return Kkt(model, q, c.v, tau).y; });
    const MatrixXd da_c = by_q([&](const VectorXd& q) { return State(model, q, c.v, a).a_c; });
    const MatrixXd da_0 = by_q([&](const VectorXd& q) { return Kkt(model, q, c.v, tau).a_0; });
    const MatrixXd dID = by_q([&](const VectorXd& q) -> VectorXd {  // eq. 6
      const Kkt k(model, q, c.v, tau);
      return k.state.ws.M * a + k.state.J_c.transpose() * lambda + k.state.ws.b;
    });
    MatrixXd rhs(6 + n, n), printed(6 + n, n);
    rhs << da_c, dID;
    printed << da_0, dID;
    const Eigen::FullPivLU<MatrixXd> K(at.K);
    CHECK(calcRelativeError(-K.solve(rhs), dy) < 1e-6);
    CHECK(calcRelativeError(K.solve(printed), dy) > kDiffers);
    CHECK(calcRelativeError(-K.solve(printed), dy) > kDiffers);
    CHECK(calcRelativeError(K.solve(rhs), dy) > kDiffers);
  }
}

TEST_CASE("Eqs. 7 and 8: the rate of the residual is the opposite of nu_c") {
  Case c(4);
  const MatrixXd rate = c.differentiateInTime(
      c.q, [&](const VectorXd& q, const VectorXd& v) -> VectorXd { return log6(State(c.model(), q, v, c.a).X_12); });
  const Vector6d nu_c = State(c.model(), c.q, c.v, c.a).nu_c;
  CHECK(calcRelativeError(-nu_c, rate) < kEqual);
  CHECK(calcRelativeError(nu_c, rate) > kDiffers);
}

TEST_CASE("Eq. 9: gamma_1 is the acceleration of frame 1") {
  Case c(5);
  const MatrixXd rate = c.differentiateInTime(
      c.q_open, [&](const VectorXd& q, const VectorXd& v) -> VectorXd { return State(c.model(), q, v, c.a).nu_c; });
  const State s(c.model(), c.q_open, c.v, c.a);
  const Vector6d nu2_in_1 = s.Ad * s.nu2, a2_in_1 = s.Ad * s.a2;
  const Vector6d first_line = s.a1 - a2_in_1 - makeCrossMotionMatrix(nu2_in_1 - s.nu1) * nu2_in_1;
  const Vector6d second_line = a2_in_1 - a2_in_1 + makeCrossMotionMatrix(s.nu1) * nu2_in_1;
  CHECK(calcRelativeError(first_line, rate) < kEqual);
  CHECK(calcRelativeError(calcClosureAcceleration(s.ws, s.closure), rate) < kEqual);
  CHECK(calcRelativeError(calcClosureVelocity(s.ws, s.closure), s.nu_c) < 1e-12);
  CHECK(calcRelativeError(second_line, rate) > kDiffers);
}

TEST_CASE("Eqs. 13 and 15 are right as printed") {
  Case c(6);
  const State s(c.model(), c.q_open, c.v, c.a);
  const Vector6d nu2_in_1 = s.Ad * s.nu2, a2_in_1 = s.Ad * s.a2;
  const Matrix6Xd J2_in_1 = s.Ad * s.J2;
  const MatrixXd da2 = c.differentiateByPosition([](const State& x) -> VectorXd { return x.a2; });
  const MatrixXd dnu1 = c.differentiateByPosition([](const State& x) -> VectorXd { return x.nu1; });
  const MatrixXd dnu2 = c.differentiateByPosition([](const State& x) -> VectorXd { return x.nu2; });
  const MatrixXd dgamma2 = c.differentiateByPosition([](const State& x) -> VectorXd { return x.Ad * x.a2; });
  const MatrixXd dgamma3 =
      c.differentiateByPosition([](const State& x) -> VectorXd { return makeCrossMotionMatrix(x.nu1) * x.Ad * x.nu2; });
  const MatrixXd eq13 = -makeCrossMotionMatrix(a2_in_1) * (J2_in_1 - s.J1) + s.Ad * da2;
  const Matrix6d cross1 = makeCrossMotionMatrix(s.nu1);
  const MatrixXd eq15 = -makeCrossMotionMatrix(nu2_in_1) * dnu1 -
                        cross1 * (makeCrossMotionMatrix(nu2_in_1) * (J2_in_1 - s.J1)) + cross1 * s.Ad * dnu2;
  CHECK(calcRelativeError(eq13, dgamma2) < kEqual);
  CHECK(calcRelativeError(eq15, dgamma3) < kEqual);
}

TEST_CASE("Eq. 19: a minus, and Jacobians in the frames of the joints") {
  Case c(7);
  const Vector6d f = randomVector(c.rng, 6);                                                    // in frame 1
  const auto carry = [&](const State& x) -> SE3 { return x.closure.X_B2 * x.X_12.inverse(); };  // frame 1 in joint 2
  const MatrixXd dphi2 =
      c.differentiateByPosition([&](const State& x) -> VectorXd { return -makeForceTransform(carry(x)) * f; });
  const State s(c.model(), c.q_open, c.v, c.a);
  const Matrix6d cross = makeForceCross(makeForceTransform(carry(s)) * f);
  const SE3 X_j2j1 = carry(s) * s.closure.X_B1.inverse();
  const Matrix6Xd J1 = calcFrameJacobian(c.model(), s.ws, s.closure.body1, SE3::Identity());
  const Matrix6Xd J2 = calcFrameJacobian(c.model(), s.ws, s.closure.body2, SE3::Identity());
  const MatrixXd motion = J2 - X_j2j1.toActionMatrix() * J1;
  CHECK(calcRelativeError(-cross * motion, dphi2) < kEqual);
  CHECK(calcRelativeError(cross * motion, dphi2) > kDiffers);
  // As the text below has it, J_1 in frame 1 and J_2 in frame 2: another thing unless frames and joints coincide.
  CHECK(calcRelativeError(-cross * (s.J2 - X_j2j1.toActionMatrix() * s.J1), dphi2) > kDiffers);
}

TEST_CASE("Eq. 21: the velocity to be met is that at the end of the step") {
  Case c(8);
  const Model& model = c.model();
  constexpr double h = 0.01;
  const VectorXd v = c.v, u = randomVector(c.rng, model.nu());
  const auto step = [&](const VectorXd& torques) -> VectorXd {
    Workspace ws(model);
    ConstrainedWorkspace cws;
    updateConstrainedDynamics(model, ws, cws, makeConstraintSet(model), c.q, v, calcMotorForces(model, torques));
    return v + h * cws.a;
  };
  const VectorXd end = step(u);  // a step that the robot can make, requested with both indices
  const auto calcSlope = [&](const VectorXd& target) {
    return differentiate(u, 1e-2, [&](const VectorXd& torques) {
      return VectorXd::Constant(1, 0.5 * (step(torques) - target).squaredNorm());
    });
  };
  CHECK(calcSlope(end).norm() < 1e-12);  // k + 1: the torques that make it are a minimum
  CHECK(calcSlope(v).norm() > 1e-6);     // k, as printed: they are not
}
