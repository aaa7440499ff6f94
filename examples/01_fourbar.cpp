/// \file The four-bar linkage: close it, move it, differentiate it.
///
/// A crank of length a turns at the origin, a rocker of length c swings at (d, 0), and a coupler of length b ties their
/// ends. With theta2, theta3, theta4 the angles of crank, coupler and rocker, the loop closes when
///     a cos theta2 + b cos theta3 = d + c cos theta4
///     a sin theta2 + b sin theta3 =     c sin theta4.                                                        (1)
/// The end of the crank is at P = (a cos theta2, a sin theta2), that of the rocker at Q with |Q - (d, 0)| = c and
/// |Q - P| = b: two circles. With w = (d, 0) - P, l = |w|, h = (l^2 + b^2 - c^2) / (2 l) and s = sqrt(b^2 - h^2),
///     Q = P + h w / l + s (-w_y, w_x) / l,    theta3 = atan2(Q - P).                                          (2)
/// One motor turns the crank with the torque u. The model is a tree of four joints q, closed by one weld in the middle
/// of the coupler, which exerts the wrench lambda:
///     M(q) a + b(q, v) = B u + J(q)^T lambda,    d/dt (J(q) v) = 0.                                           (3)
/// These are six rows for a planar loop that needs three: lambda is not unique, but a and J^T lambda are.
/// We solve (3), check its energy balance (4), and compare da/du with finite differences (the program fails if a check
/// does):
///     d(kinetic + potential energy)/dt = u v_crank: closures do no work.                                      (4)
#include <cmath>
#include <cstdio>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/constrained.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/robots/robot_loader.h"

using namespace bielle;

namespace {

constexpr double kA = 0.15, kB = 0.35, kC = 0.30, kD = 0.40;  // m, see robots/fourbar

double calcCouplerAngle(double theta2) {  // Eq. (2)
  const double px = kA * std::cos(theta2), py = kA * std::sin(theta2);
  const double wx = kD - px, wy = -py, l = std::hypot(wx, wy);
  const double h = (l * l + kB * kB - kC * kC) / (2 * l), s = std::sqrt(kB * kB - h * h);
  return std::atan2(h * wy / l + s * wx / l, h * wx / l - s * wy / l);
}

// The configuration with the crank at theta2: the crank is drawn there, and the loop is closed exactly.
VectorXd close(const Model& model, VectorXd q, double theta2) {
  AssemblyProblem problem;
  problem.q_ref = q;
  const int crank = model.joints()[model.findJoint("crank_joint")].idx_v;
  problem.q_ref[crank] = theta2;
  problem.weights = VectorXd::Constant(model.nv(), 1e-6);
  problem.weights[crank] = 1;
  return assemble(model, problem).q;
}

struct Dynamics {
  explicit Dynamics(const Model& model) : model(model), constraints(makeConstraintSet(model)), ws(model) {}
  VectorXd solve(const VectorXd& q, const VectorXd& v, double u) {
    updateConstrainedDynamics(model, ws, cws, constraints, q, v, calcMotorForces(model, VectorXd::Constant(1, u)));
    return cws.a;
  }
  double calcEnergy() const { return calcKineticEnergy(model, ws) + calcPotentialEnergy(model, ws); }
  const Model& model;
  ConstraintSet constraints;
  Workspace ws;
  ConstrainedWorkspace cws;
};

bool check(const char* what, double error, double tolerance) {
  std::printf("%-58s %.1e  %s\n", what, error, error < tolerance ? "ok" : "FAILED");
  return error < tolerance;
}

}  // namespace

int main() {
  const Model model = loadRobot("fourbar").model;
  VectorXd q = assembleReference(model, "crank_at_60_degrees").q;
  const Mobility mobility = calcMobility(model, q);
  std::printf("four-bar: %d joints, %d closure rows of rank %d, mobility %d\n\n", model.nv(), mobility.rows,
              mobility.rank, mobility.mobility);

  // Once around: joint 2 is the coupler's angle relative to the crank.
  std::printf("crank [deg]  coupler [deg]  by Eq. (2)\n");
  double angle_error = 0;
  for (int degrees = 60; degrees < 420; degrees += 15) {
    const double theta2 = degrees * M_PI / 180;
    q = close(model, q, theta2);
    const double theta3 = q[0] + q[1], expected = calcCouplerAngle(theta2);
    angle_error = std::max(angle_error, std::abs(std::remainder(theta3 - expected, 2 * M_PI)));
    if (degrees % 60 == 0)
      std::printf("%11d  %13.6f  %10.6f\n", degrees % 360, std::remainder(theta3 * 180 / M_PI, 360),
                  expected * 180 / M_PI);
  }

  // One state in motion: the velocity nearest to a turning crank that keeps the loop closed.
  const double u = 0.8;  // N m
  Dynamics at(model);
  const VectorXd v = projectVelocity(model, at.ws, at.constraints, q, VectorXd::Unit(model.nv(), 0) * 6);
  const VectorXd a = at.solve(q, v, u);
  std::printf("\ncrank at %.2f rad/s with %.1f N m: accelerations %.3f %.3f %.3f %.3f rad/s^2\n", v[0], u, a[0], a[1],
              a[2], a[3]);
  const Vector6d wrench = expandRows(at.constraints.closures[0], at.cws.lambda);
  std::printf("the rod pulls with %.3f N along itself, %.3f N across, %.4f N m\n\n", wrench[0], wrench[2], wrench[4]);

  // Eq. (4), by central differences along the motion.
  const double h = 1e-5;
  const auto calcEnergyAt = [&](double t) {
    const VectorXd qt = model.integrate(q, t * v + t * t / 2 * a);
    at.solve(qt, v + t * a, u);
    return at.calcEnergy();
  };
  const double power = (calcEnergyAt(h) - calcEnergyAt(-h)) / (2 * h);

  // da/du, analytic and by differences.
  at.solve(q, v, u);
  updateConstrainedDerivatives(model, at.ws, at.cws, at.constraints);
  const VectorXd da_du = at.cws.da_du.col(0);
  const VectorXd difference = (at.solve(q, v, u + h) - at.solve(q, v, u - h)) / (2 * h);

  bool ok = check("coupler angle against Eq. (2), once around [rad]", angle_error, 1e-9);
  ok &= check("power of Eq. (4) against u v [W]", std::abs(power - u * v[0]), 1e-5);
  ok &= check("da/du against central differences, relative", (da_du - difference).norm() / da_du.norm(), 1e-7);
  return ok ? 0 : 1;
}
