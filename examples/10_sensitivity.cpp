/// \file The derivative of a motor torque of a closed chain with respect to the lengths of its rods.
///
/// A motor turns the crank (length a, angle theta2) of a four-bar, whose rocker (c, theta4) swings in a given way; the
/// coupler (b, theta3) connects them, the ground is d:
///     a cos theta2 + b cos theta3 = d + c cos theta4,    a sin theta2 + b sin theta3 = c sin theta4.           (1)
/// A longer coupler turns the rocker while the crank stands still. The component of d(1)/db along the coupler gives
///     d theta4 / db = 1 / (c sin(theta3 - theta4)).                                                           (2)
/// With the rocker's motion kept, the crank's follows, and its torque u from the inverse problem
///     M(q) qdd + b(q, v) = B u + J(q)^T lambda.                                                                (3)
/// We look for the lengths a and b that minimize the root mean square torque,
///     min_{a, b} f(a, b) = (1/N sum_k u_k^2)^1/2,    df = sum_k u_k du_k / (N f),                              (4)
/// where du_k comes from derivatives of (1) and (3) with respect to the attachments of the rods and to their inertias,
/// which grow with them. We check (2), compare df with differences, and search with and without gradients.
#include <cmath>
#include <cstdio>

#include "bielle/design/parametrization.h"
#include "bielle/design/search.h"
#include "bielle/dynamics/kept_motion.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/robots/fourbar_chain.h"

using namespace bielle;

namespace {

constexpr int kNodes = 60;
constexpr double kMiddle = 2.0, kSwing = 0.2, kFrequency = 2 * M_PI;  // of the rocker, rad, rad/s
const std::vector<int> kRocker = {0};                                 // joints: rocker, crank, coupler

bool check(const char* what, double error, double tolerance) {
  std::printf("%-66s %.1e  %s\n", what, error, error < tolerance ? "ok" : "FAILED");
  return error < tolerance;
}

DesignVariable makeLength(const std::string& name, const std::string& from, const std::string& to, double lower,
                          double upper) {
  DesignVariable variable;
  variable.name = name, variable.lower = lower, variable.upper = upper;
  variable.lengths = {{from, to, Vector3d::Zero(), from}};  // the link `from` grows with it
  return variable;
}

// Closes the loop with the rocker at an angle, by Newton steps from q. False if that is impossible.
bool close(const Model& model, double rocker, VectorXd& q) {
  const ConstraintSet loop = makeConstraintSet(model);
  Workspace ws(model);
  for (int i = 0; i < 20; ++i) {
    updatePositions(model, ws, q);
    const VectorXd miss = VectorXd::Constant(1, rocker - q[0]);
    if (calcClosureResidual(ws, loop.closures[0]).norm() + miss.norm() < 1e-12) return true;
    q = model.integrate(q, Closing(model, ws, loop, kRocker).solve(calcClosureResidual(ws, loop.closures[0]), miss));
  }
  return false;
}

// f and df of Eq. (4); only f without variations.
SlopedValue calcEffort(const Model& model, VectorXd q, const std::vector<ModelVariation>& variations) {
  KeptMotion motion(model, kRocker);
  KeptMotion::Variation variation(model);
  double squares = 0;
  Eigen::RowVectorXd slope = Eigen::RowVectorXd::Zero(static_cast<Eigen::Index>(variations.size()));
  for (int k = 0; k < kNodes; ++k) {
    const double w = kFrequency, phase = 2 * M_PI * k / kNodes;
    const VectorXd v = VectorXd::Constant(1, kSwing * w * std::cos(phase)),
                   a = VectorXd::Constant(1, -kSwing * w * w * std::sin(phase));
    if (!close(model, kMiddle + kSwing * std::sin(phase), q) ||
        motion.update(makeConstraintSet(model), q, v, a, VectorXd()) != NumericalStatus::Ok)
      return {1e3, {}, {}};  // out of reach
    squares += motion.u().squaredNorm() / kNodes;
    for (size_t i = 0; i < variations.size(); ++i)
      if (motion.calcVariation(variations[i], variation) == NumericalStatus::Ok)
        slope[static_cast<Eigen::Index>(i)] += motion.u().dot(variation.u) / kNodes;
  }
  const double f = std::sqrt(squares);
  return {f, {{VectorXd::Constant(1, f), slope / f}}, {}};
}

}  // namespace

int main() {
  const FourBarChainOptions lengths;
  const FourBarChain fourbar = makeFourBarChain(lengths);
  const Parametrization robot(fourbar.model, {makeLength("crank", "crank1", "coupler1", 0.12, 0.18),
                                              makeLength("coupler", "coupler1", "end of coupler1", 0.32, 0.42)});
  const VectorXd &q = fourbar.q_closed, &x = robot.start();

  // Eq. (2): the crank is held, the frame of the loop at the coupler's end moves along the coupler.
  Workspace ws(fourbar.model);
  updatePositions(fourbar.model, ws, q);
  updateVelocities(fourbar.model, ws, VectorXd::Zero(3));
  updateAccelerations(fourbar.model, ws, VectorXd::Zero(3));
  ModelVariation longer(fourbar.model);
  longer.frames1[0] = Vector6d::Unit(0);
  MotionVariation moved(fourbar.model);
  Closing(fourbar.model, ws, makeConstraintSet(fourbar.model), {1}).calcMotion(fourbar.model, ws, longer, moved);
  const double expected = 1 / (lengths.rocker * std::sin(q[1] + q[2] - q[0]));
  std::printf("a coupler longer by 1 mm turns the rocker by %.4f mrad, crank held\n\n", moved.q[0]);
  bool ok = check("d theta4 / db against Eq. (2), relative", std::abs(moved.q[0] / expected - 1), 1e-12);

  const SlopedValue here = calcEffort(fourbar.model, q, calcDesignVariations(robot, x));
  const VectorXd df = here.terms[0].gradients.row(0);
  VectorXd difference(2);
  for (int i = 0; i < 2; ++i) {
    const VectorXd step = 1e-5 * VectorXd::Unit(2, i);
    difference[i] =
        (calcEffort(robot.make(x + step), q, {}).value - calcEffort(robot.make(x - step), q, {}).value) / 2e-5;
  }
  std::printf("f = %.4f N m; df/da = %.4f, df/db = %.4f N m/m\n", here.value, df[0], df[1]);
  ok &= check("df against central differences, relative", (df - difference).norm() / difference.norm(), 1e-6);

  // Eq. (4) by sequential quadratic programs, and by a simplex method that uses only f.
  SearchProblem problem{robot.lower(), robot.upper(), x, {}, {}};
  problem.objective = [&](const VectorXd& at, const SearchStage&) { return calcEffort(robot.make(at), q, {}).value; };
  problem.sloped = [&](const VectorXd& at, const SearchStage&) {
    return calcEffort(robot.make(at), q, calcDesignVariations(robot, at));
  };
  double found[2];
  int i = 0;
  std::printf("\nsearch  evaluations  crank [m]  coupler [m]  f [N m]\n");
  for (const SearchAlgorithm algorithm : {SearchAlgorithm::Slsqp, SearchAlgorithm::Sbplx}) {
    const SearchResult best = minimizeByStages(problem, {{algorithm, 300, 1e-4}}, 1);
    std::printf("%-6s  %11d  %9.4f  %11.4f  %7.4f\n", getName(algorithm), best.evaluations, best.x[0], best.x[1],
                found[i++] = best.value);
  }
  ok &= check("\nboth find the same torque, relative", std::abs(found[0] / found[1] - 1), 1e-4);
  return ok ? 0 : 1;
}
