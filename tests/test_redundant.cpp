// Loops with more rows than rank. Oracle: the planar four-bar by Lagrange with the crank angle as its only coordinate,
// from closed-form kinematics; models of the same linkage cut elsewhere; conservation of energy.
#include <filesystem>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/constrained.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/robots/robot_loader.h"
#include "check_derivative.h"
#include "dynamics/saddle_point.h"
#include "math/constants.h"
#include "math/so3.h"
#include "published_robots.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

using Eigen::Vector2d;
constexpr double kGround = 0.4, kCrank = 0.15, kCoupler = 0.35, kRocker = 0.3;
constexpr double kPinArmature = 1e-4;  // of makePlanarFourBar: turns as fast as the rocker

Vector2d makeUnit(double angle) { return {std::cos(angle), std::sin(angle)}; }
Vector2d makeNormal(double angle) { return {-std::sin(angle), std::cos(angle)}; }

// Angles of crank, coupler and rocker from x towards z, by the intersection of two circles, and their derivatives with
// respect to that of the crank.
struct ClosedForm {
  explicit ClosedForm(double alpha) {
    const Vector2d tip = kCrank * makeUnit(alpha), pin(kGround, 0), base = pin - tip;
    const double d = base.norm(), x = (kCoupler * kCoupler - kRocker * kRocker + d * d) / (2 * d);
    const double y = std::sqrt(kCoupler * kCoupler - x * x);
    const Vector2d along = base / d, across(-along.y(), along.x());
    const Vector2d elbow = tip + x * along + y * across, coupler = elbow - tip, rocker = pin - elbow;
    angles = {alpha, std::atan2(coupler.y(), coupler.x()), std::atan2(rocker.y(), rocker.x())};
    Eigen::Matrix2d A;
    A << kCoupler * makeNormal(angles[1]), kRocker * makeNormal(angles[2]);
    const Vector2d rates = A.inverse() * (-kCrank * makeNormal(alpha));
    slopes = {1, rates[0], rates[1]};
  }
  // q and dq/dalpha of makePlanarFourBar, whose joints turn from z towards x.
  VectorXd q() const { return Eigen::Vector4d(-angles[0], angles[0] - angles[1], angles[1] - angles[2], angles[2]); }
  VectorXd dq() const { return Eigen::Vector4d(-slopes[0], slopes[0] - slopes[1], slopes[1] - slopes[2], slopes[2]); }
  Vector3d angles, slopes;
};

// Kinetic energy 1/2 inertia alpha'^2, potential energy. Rods of 1 kg/m.
struct Energy {
  double inertia, potential;
};
Energy calcLinkageEnergy(double alpha) {
  const ClosedForm form(alpha);
  const double lengths[] = {kCrank, kCoupler, kRocker};
  Vector2d start = Vector2d::Zero(), dstart = Vector2d::Zero();
  Energy out{kPinArmature * form.slopes[2] * form.slopes[2], 0};
  for (int i = 0; i < 3; ++i) {
    const double l = lengths[i], slope = form.slopes[i];
    const Vector2d half = 0.5 * l * makeUnit(form.angles[i]), dhalf = 0.5 * l * slope * makeNormal(form.angles[i]);
    out.inertia += l * (dstart + dhalf).squaredNorm() + l * l * l / 12 * slope * slope;
    out.potential += 9.81 * l * (start + half).y();
    start += 2 * half;
    dstart += 2 * dhalf;
  }
  return out;
}

// alpha'' of inertia alpha'' + 1/2 inertia' alpha'^2 + potential' = torque on alpha.
double calcCrankAcceleration(double alpha, double rate, double torque) {
  const MatrixXd slopes = differentiate(VectorXd::Constant(1, alpha), 1e-3, [](const VectorXd& a) {
    const Energy energy = calcLinkageEnergy(a[0]);
    return VectorXd(Vector2d(energy.inertia, energy.potential));
  });
  return (torque - 0.5 * slopes(0, 0) * rate * rate - slopes(1, 0)) / calcLinkageEnergy(alpha).inertia;
}

// The same linkage without the pin's body: the rocker's end is tied to the ground by a ball or a hinge.
Model makeCutAtThePin(ClosureKind kind) {
  ModelBuilder builder("cut at the pin");
  std::string parent = "world";
  double x = 0;
  const double lengths[] = {kCrank, kCoupler, kRocker};
  for (int i = 0; i < 3; ++i) {
    const double l = lengths[i];
    Joint joint;
    joint.name = "j" + std::to_string(i);
    joint.kind = JointKind::Revolute;
    joint.axis = Vector3d::UnitY();
    joint.X_PJ.p.x() = x;
    Inertia inertia;
    inertia.mass = l;
    inertia.com = {l / 2, 0, 0};
    const double transverse = l * l * l / 12 + (i == 2 ? kPinArmature : 0);
    inertia.I_com = Vector3d(1e-4, transverse, transverse).asDiagonal();
    builder.addLink("rod" + std::to_string(i), parent, joint, inertia);
    parent = "rod" + std::to_string(i);
    x = l;
  }
  builder.addFrame("end", parent, {Matrix3d::Identity(), {kRocker, 0, 0}});
  builder.addFrame("anchor", "world", {Matrix3d::Identity(), {kGround, 0, 0}});
  builder.addClosure("loop", kind, "end", "anchor", Vector3d::UnitY());
  builder.addMotor("j0");
  return builder.build();
}

struct Solution {
  VectorXd a, lambda;
  bool redundant;
};
Solution solveLinkage(const Model& model, const VectorXd& q, const VectorXd& v, double torque) {
  Workspace ws(model);
  ConstrainedWorkspace cws;
  const VectorXd tau = calcMotorForces(model, VectorXd::Constant(1, torque));
  REQUIRE(updateConstrainedDynamics(model, ws, cws, makeConstraintSet(model), q, v, tau) == NumericalStatus::Ok);
  return {cws.a, cws.lambda, cws.saddle_point->isRedundant()};
}

double calcTotalEnergy(const Model& model, const VectorXd& q, const VectorXd& v) {
  Workspace ws(model);
  updatePositions(model, ws, q);
  updateVelocities(model, ws, v);
  return calcKineticEnergy(model, ws) + calcPotentialEnergy(model, ws);
}

}  // namespace

TEST_CASE("four-bar: rank, mobility and accelerations over the whole turn, for every choice of rows") {
  const Model weld = makePlanarFourBar(kGround, kCrank, kCoupler, kRocker, 0.5).model;
  const Model ball = makeCutAtThePin(ClosureKind::Ball3D), hinge = makeCutAtThePin(ClosureKind::Hinge5D);
  for (double alpha = 0; alpha < 2 * kPi; alpha += 0.37) {
    CAPTURE(alpha);
    const ClosedForm form(alpha);
    const double rate = 2.5, torque = 0.8;
    const VectorXd q = form.q(), v = rate * form.dq();
    const Mobility mobility = calcMobility(weld, q);
    CHECK(mobility.rows == 6);
    CHECK(mobility.rank == 3);
    CHECK(mobility.mobility == 1);
    for (const Model* model : {&ball, &hinge}) CHECK(calcMobility(*model, q.head<3>()).mobility == 1);

    // The motor turns q_0 = -alpha.
    const double expected = -calcCrankAcceleration(alpha, rate, -torque);
    const Solution by_weld = solveLinkage(weld, q, v, torque);
    CHECK(by_weld.redundant);
    CHECK(by_weld.a[0] == Approx(expected).epsilon(1e-7));
    CHECK(by_weld.a[0] != Approx(-calcCrankAcceleration(alpha, rate, -1.001 * torque)).epsilon(1e-7));
    for (const Model* model : {&ball, &hinge}) {
      const Solution other = solveLinkage(*model, q.head<3>(), v.head<3>(), torque);
      CHECK(other.redundant);
      CHECK(calcRelativeError(other.a, by_weld.a.head<3>()) < 1e-8);
      // The force of the pin, in frame 1: the rod's end, or the pin's body, which stays parallel to the world.
      const Vector3d at_end = exp3(Vector3d(0, -form.angles[2], 0)) * other.lambda.head<3>();
      CHECK(calcRelativeError(at_end, by_weld.lambda.head<3>()) < 1e-6);
    }
  }
}

TEST_CASE("four-bar: derivatives along the motion that the closure leaves, against differences of the closed form") {
  const Model model = makePlanarFourBar(kGround, kCrank, kCoupler, kRocker, 0.5).model;
  const double rate = 2.5, torque = 0.8;
  for (double alpha : {0.3, 1.7, 3.1, 4.4, 5.9}) {
    CAPTURE(alpha);
    const auto q = [](double at) { return ClosedForm(at).q(); };
    const auto v = [&](double at) { return VectorXd(rate * ClosedForm(at).dq()); };
    Workspace ws(model);
    ConstrainedWorkspace cws;
    const ConstraintSet set = makeConstraintSet(model);
    const VectorXd tau = calcMotorForces(model, VectorXd::Constant(1, torque));
    REQUIRE(updateConstrainedDynamics(model, ws, cws, set, q(alpha), v(alpha), tau) == NumericalStatus::Ok);
    REQUIRE(updateConstrainedDerivatives(model, ws, cws, set) == NumericalStatus::Ok);
    const auto along = [&](const std::function<VectorXd(double)>& f) {
      return VectorXd(differentiate(VectorXd::Constant(1, alpha), 1e-3, [&](const VectorXd& at) { return f(at[0]); }));
    };
    const VectorXd da = cws.da_dq * ClosedForm(alpha).dq() + cws.da_dv * along(v);
    checkDerivative(da, along([&](double at) { return solveLinkage(model, q(at), v(at), torque).a; }), "alpha");
    CHECK(da[0] ==
          Approx(along([&](double at) { return VectorXd::Constant(1, -calcCrankAcceleration(at, rate, -torque)); })[0])
              .epsilon(1e-4));
    checkDerivative(cws.da_dv * ClosedForm(alpha).dq(),
                    differentiate(VectorXd::Constant(1, rate), 1e-2,
                                  [&](const VectorXd& r) {
                                    const VectorXd at = r[0] * ClosedForm(alpha).dq();
                                    return solveLinkage(model, q(alpha), at, torque).a;
                                  }),
                    "rate");
    checkDerivative(cws.da_du,
                    differentiate(VectorXd::Constant(1, torque), 1,
                                  [&](const VectorXd& u) { return solveLinkage(model, q(alpha), v(alpha), u[0]).a; }),
                    "torque");
  }
}

TEST_CASE("four-bar: energy of a free motion over a second, by RK4 at two steps") {
  const Mechanism mechanism = makePlanarFourBar(kGround, kCrank, kCoupler, kRocker, 0.5);
  const Model& model = mechanism.model;
  const auto simulate = [&](double h) {
    VectorXd q = mechanism.q_closed, v = 4 * ClosedForm(0.5).dq();
    const double start = calcTotalEnergy(model, q, v);
    const int steps = static_cast<int>(std::round(1 / h));
    for (int i = 0; i < steps; ++i) {
      const auto accelerate = [&](const VectorXd& at, const VectorXd& rate) {
        return solveLinkage(model, at, rate, 0).a;
      };
      const VectorXd a1 = accelerate(q, v);
      const VectorXd v2 = v + h / 2 * a1, a2 = accelerate(q + h / 2 * v, v2);
      const VectorXd v3 = v + h / 2 * a2, a3 = accelerate(q + h / 2 * v2, v3);
      const VectorXd v4 = v + h * a3, a4 = accelerate(q + h * v3, v4);
      q += h / 6 * (v + 2 * v2 + 2 * v3 + v4);
      v += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
    }
    Workspace ws(model);
    updatePositions(model, ws, q);
    CHECK(calcLargestGap(ws, makeConstraintSet(model)) < 1e-4);
    return std::abs(calcTotalEnergy(model, q, v) - start);
  };
  const double kinetic = 0.5 * calcLinkageEnergy(0.5).inertia * 16;
  const double coarse = simulate(2e-3), fine = simulate(1e-3);
  CAPTURE(coarse, fine, kinetic);
  CHECK(fine < 1e-6 * kinetic);
  CHECK(coarse / fine > 12);  // 16 and more for the fourth order
}

TEST_CASE("a published delta robot: redundant loops close, and accelerations obey them") {
  const std::string directory = findPublished("robot_delta");
  if (directory.empty()) return;
  LoadOptions options;
  options.base = BaseKind::Fixed;
  const Model model = loadRobot(directory, options).model;
  std::mt19937 rng(41);
  const AssemblyResult result = closeConfiguration(model, model.makeNeutral());
  CAPTURE(result.message);
  REQUIRE(result.status == NumericalStatus::Ok);
  Workspace ws(model);
  const ConstraintSet set = makeConstraintSet(model);
  updatePositions(model, ws, result.q);
  CHECK(calcLargestGap(ws, set) < 1e-12);
  const Mobility mobility = calcMobility(model, result.q);
  CAPTURE(mobility.rows, mobility.rank, mobility.mobility, model.nv());
  // All hinges are parallel: three planar loops of rank three each, closed by six rows each.
  for (int k = 1; k < model.nv(); ++k) CHECK(ws.J.col(k).tail<3>().cross(ws.J.col(0).tail<3>()).norm() < 1e-4);
  CHECK(mobility.rows == 18);
  CHECK(mobility.rank == 9);
  CHECK(mobility.mobility == model.nv() - 9);
  const VectorXd v = projectVelocity(model, ws, set, result.q, randomVector(rng, model.nv()));
  ConstrainedWorkspace cws;
  const VectorXd tau = calcMotorForces(model, randomVector(rng, model.nu()));
  REQUIRE(updateConstrainedDynamics(model, ws, cws, set, result.q, v, tau) == NumericalStatus::Ok);
  CHECK(cws.saddle_point->isRedundant());
  CHECK(cws.a.allFinite());
  CHECK(cws.residual < 1e-6 * (1 + cws.gamma.cwiseAbs().maxCoeff()));
  CHECK(calcRelativeError(ws.M * cws.a + ws.b - cws.J.transpose() * cws.lambda, tau) < 1e-9);
}

TEST_CASE("redundant rows that contradict each other are reported, those that agree are not") {
  // The rocker's end is tied to the same place twice; the loop is open by a tenth of a millimetre.
  const Model model = makeCutAtThePin(ClosureKind::Hinge5D);
  VectorXd q = ClosedForm(1.1).q().head(3);
  q[2] += 1e-4 / kRocker;
  const VectorXd v = VectorXd::Zero(3), torque = VectorXd::Unit(3, 0);
  const auto solve = [&](double kp, double other_kp) {
    ConstraintSet set = makeConstraintSet(model, {});
    Closure twin = set.closures[0];
    set.closures[0].kp = kp;
    twin.kp = other_kp;
    set.closures.push_back(twin);
    set.offsets.push_back(set.rows);
    set.rows += getRows(twin.kind);
    set.num_loops = 2;
    Workspace ws(model);
    ConstrainedWorkspace cws;
    const NumericalStatus status = updateConstrainedDynamics(model, ws, cws, set, q, v, torque);
    CHECK(cws.saddle_point->isRedundant());
    CHECK(cws.a.allFinite());
    return status;
  };
  CHECK(solve(0, 0) == NumericalStatus::Ok);
  CHECK(solve(1e8, 1e8) == NumericalStatus::Ok);
  CHECK(solve(0, 1e8) == NumericalStatus::Contradictory);
  CHECK(solve(1e8, 0) == NumericalStatus::Contradictory);
  CHECK_THAT(getMessage(NumericalStatus::Contradictory), Catch::Contains("contradict"));
}
