#include "motion/statics.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/modes.h"
#include "bielle/dynamics/rnea.h"
#include "math/decompositions.h"
#include "math/largest.h"

namespace bielle {
namespace {

// Of pivots over the largest: where springs balance the weight but for rounding, a smaller one is that balance.
constexpr double kRankTolerance = 1e-8;

double calcForceScale(const Model& model) { return std::max(1.0, model.mass() * model.gravity().norm()); }

// motion.h Eq. (1) at ws, whose unknowns are (tau, lambda / scale): forces weigh less than torques of the same number, so that
// the ground carries the robot. \param dofs  of tau, in their order
MatrixXd makeHoldMatrix(const Model& model, const Workspace& ws, const ConstraintSet& constraints,
                        const std::vector<int>& dofs) {
  const int n = static_cast<int>(dofs.size());
  MatrixXd A = MatrixXd::Zero(model.nv(), n + constraints.rows);
  for (int i = 0; i < n; ++i) A(dofs[i], i) = 1;
  MatrixXd J = MatrixXd::Zero(constraints.rows, model.nv());
  for (size_t c = 0; c < constraints.closures.size(); ++c)
    calcClosureJacobian(ws, constraints.closures[c],
                        J.middleRows(constraints.offsets[c], getRows(constraints.closures[c].kind)));
  A.rightCols(constraints.rows) = calcForceScale(model) * J.transpose();
  return A;
}

void updateStatics(const Model& model, ConstVectorRef q, Workspace& ws) {
  updatePositions(model, ws, q);
  updateVelocities(model, ws, VectorXd::Zero(model.nv()));
  updateBias(model, ws);
}

// Torques of dofs that hold the robot, in the least-squares sense.
struct StaticHold {
  VectorXd tau;
  double residual = 0;
};

StaticHold calcStaticHold(const Model& model, const ConstraintSet& constraints, ConstVectorRef q,
                          const std::vector<int>& dofs) {
  Workspace ws(model);
  updateStatics(model, q, ws);
  const int n = static_cast<int>(dofs.size());
  const MatrixXd A = makeHoldMatrix(model, ws, constraints, dofs);
  Eigen::CompleteOrthogonalDecomposition<MatrixXd> decomposition;
  decomposition.setThreshold(kRankTolerance);
  decomposition.compute(A);
  const VectorXd solution = decomposition.solve(ws.b);
  return {solution.head(n), calcLargest(A * solution - ws.b)};
}

std::vector<int> listMotorDofs(const Model& model) {
  std::vector<int> dofs;
  for (const Motor& motor : model.motors()) dofs.push_back(motor.dof);
  return dofs;
}

// Those on other joints than the motors' own. (Through a linkage a motor may move them all the same.)
std::vector<const JointForce*> listFreeSprings(const Model& model) {
  std::vector<const JointForce*> springs;
  const std::vector<int> motors = listMotorDofs(model);
  for (const JointForce& force : model.jointForces())
    if (force.stiffness > 0 && std::find(motors.begin(), motors.end(), force.dof) == motors.end())
      springs.push_back(&force);
  return springs;
}

// The solution of an assembly problem, with its springs bent by the weight that motors cannot take from them. What a spring
// lacks of the torque that would hold it bends it by that over its stiffness; as stiff springs move little, a few rounds
// settle it. Where they do not (the robot would fall over), springs stay as they are.
VectorXd settleSprings(const Model& model, const std::vector<const JointForce*>& springs,
                       const ConstraintSet& constraints, AssemblyProblem problem, const VectorXd& unloaded) {
  constexpr double kModerate = 10;
  std::vector<int> dofs = listMotorDofs(model);
  const double tolerance = 1e-9 * std::max(1.0, model.mass() * model.gravity().norm());  // N m or N
  const StaticHold alone = calcStaticHold(model, constraints, unloaded, dofs);
  for (const JointForce* spring : springs) dofs.push_back(spring->dof);
  // Pushing the feet against each other, motors can hold springs by torques out of all proportion.
  if (alone.residual < tolerance &&
      alone.tau.norm() < kModerate * calcStaticHold(model, constraints, unloaded, dofs).tau.norm())
    return unloaded;
  constexpr int kRounds = 50;
  constexpr double kFirm = 1e3;  // weight of a spring's angle among those of the reference
  VectorXd angles(springs.size());
  for (size_t i = 0; i < springs.size(); ++i) angles[i] = unloaded[springs[i]->idx_q];
  VectorXd q = unloaded;
  for (int round = 0; round < kRounds; ++round) {
    const StaticHold hold = calcStaticHold(model, constraints, q, dofs);
    const VectorXd lack = hold.tau.tail(springs.size());
    if (hold.residual > tolerance) break;
    if (calcLargest(lack) < tolerance) return q;
    for (size_t i = 0; i < springs.size(); ++i) {
      angles[i] -= lack[i] / springs[i]->stiffness;
      problem.q_ref[springs[i]->idx_q] = angles[i];
      problem.weights[springs[i]->dof] = kFirm;
    }
    const AssemblyResult next = assemble(model, problem);
    if (next.status != NumericalStatus::Ok) break;
    q = next.q;
  }
  return unloaded;
}

}  // namespace

StaticTorques calcStaticTorques(const Model& model, const ConstraintSet& constraints, ConstVectorRef q) {
  const StaticHold hold = calcStaticHold(model, constraints, q, listMotorDofs(model));
  return {hold.tau, hold.residual};
}

namespace {

// Rows r = r0 + Z y, of free y, of which the largest is to be as small as possible.
struct MinimaxProblem {
  VectorXd r0;
  MatrixXd Z;
};

// A lower bound of the least max |r|. C. L. Lawson, "Contributions to the theory of linear least maximum approximation", 1961: with
// weights that sum up to 1 the least squares sum_i w_i r_i^2 are at most its square, and equal to it for the weights
// that w_i <- w_i |r_i| converges to.
double boundLargest(const MinimaxProblem& problem) {
  constexpr int kRounds = 50;
  const Eigen::Index size = problem.r0.size();
  if (size == 0) return 0;
  VectorXd w = VectorXd::Constant(size, 1.0 / static_cast<double>(size));
  double least = 0;
  for (int round = 0; round < kRounds; ++round) {
    const VectorXd root = w.cwiseSqrt();
    VectorXd r = problem.r0;
    if (problem.Z.cols() > 0) {
      Eigen::ColPivHouseholderQR<MatrixXd> decomposition;
      decomposition.setThreshold(kRankTolerance);  // mirrored legs have rows that are the same but for rounding
      decomposition.compute(root.asDiagonal() * problem.Z);
      r -= problem.Z * decomposition.solve(VectorXd(root.cwiseProduct(problem.r0)));
    }
    least = std::max(least, std::sqrt(w.dot(r.cwiseAbs2())));
    w = w.cwiseProduct(r.cwiseAbs());
    if (!(w.sum() > 0)) break;
    w /= w.sum();
  }
  return least;
}

// What the rows of a contact can be at most while it bears all of the load, N: bounds of its wrench cone (ocp/cost.h).
VectorUpTo6<double> calcMostForce(const ContactFrame& contact, double load, double friction) {
  constexpr double kLeast = 1e-3;  // m, of soles without size
  const double X = std::max(kLeast, contact.half_length), Y = std::max(kLeast, contact.half_width);
  VectorUpTo6<double> most(contact.kind == ContactKind::Surface6D ? 6 : contact.kind == ContactKind::Edge5D ? 5 : 3);
  most.head<3>() << friction, friction, 1;
  if (contact.kind == ContactKind::Surface6D) most.tail<3>() << Y, X, friction * (X + Y);
  if (contact.kind == ContactKind::Edge5D) most.tail<2>().setConstant(std::max(1.0, friction) * X);
  return load * most;
}

}  // namespace

HoldingShare calcHoldingShare(const Model& model, const ConstraintSet& constraints, ConstVectorRef q, const Vector3d& a,
                              const VectorXd& limits, double friction) {
  constexpr double kBalanced = 1e-6;  // of the weight
  Workspace ws(model);
  updateStatics(model, q, ws);
  VectorXd b = ws.b;
  if (model.hasFreeFlyer() && !a.isZero(0)) {
    updateMassMatrix(model, ws);
    const Matrix3d R = Eigen::Quaterniond(Eigen::Vector4d(q.segment<4>(3))).toRotationMatrix();
    b += ws.M.leftCols(3) * (R.transpose() * a);
  }
  // Springs that no motor moves bend until they hold, by less than matters here.
  std::vector<int> dofs = listMotorDofs(model);
  for (const JointForce* spring : listFreeSprings(model)) dofs.push_back(spring->dof);
  const MatrixXd A = makeHoldMatrix(model, ws, constraints, dofs);
  // Of A^T = Q R P^T: the last columns of Q are what A does not see, the first ones have the solution of least squares.
  Eigen::ColPivHouseholderQR<MatrixXd> decomposition;
  decomposition.setThreshold(kRankTolerance);
  decomposition.compute(A.transpose());
  const Eigen::Index rank = decomposition.rank();
  const MatrixXd Q = MatrixXd(decomposition.householderQ()), seen = A * Q.leftCols(rank);
  const VectorXd solution = Q.leftCols(rank) * seen.colPivHouseholderQr().solve(b);
  HoldingShare share;
  share.u = solution.head(model.nu());
  share.balances = calcLargest(A * solution - b) < kBalanced * calcForceScale(model);
  if (share.balances && (share.u.array().abs() <= limits.array()).all()) return share;
  MinimaxProblem all{VectorXd(0), MatrixXd(0, A.cols() - rank)};
  const auto addRow = [&](Eigen::Index row, double most) {
    const Eigen::Index last = all.r0.size();
    all.r0.conservativeResize(last + 1);
    all.Z.conservativeResize(last + 1, Eigen::NoChange);
    all.r0[last] = solution[row] / most;
    all.Z.row(last) = Q.row(row).tail(A.cols() - rank) / most;
  };
  const double load = model.mass() * (model.gravity().norm() + a.z()), scale = calcForceScale(model);
  for (int c = constraints.num_loops; c < static_cast<int>(constraints.closures.size()); ++c) {
    const VectorUpTo6<double> most = calcMostForce(model.contacts()[constraints.getContact(c)], load / scale, friction);
    for (Eigen::Index i = 0; i < most.size(); ++i)
      addRow(static_cast<Eigen::Index>(dofs.size()) + constraints.offsets[c] + i, most[i]);
  }
  share.balances = share.balances && boundLargest(all) <= 1;
  for (int m = 0; m < model.nu(); ++m)
    if (std::isfinite(limits[m])) addRow(m, limits[m]);
  share.least = boundLargest(all);
  return share;
}

VectorXd settleReference(const Model& model, const Reference& reference, const VectorXd& q) {
  std::vector<const JointForce*> springs;
  for (const JointForce* spring : listFreeSprings(model))
    if (reference.joints.count(model.joints()[spring->joint].name) == 0) springs.push_back(spring);
  if (springs.empty()) return q;
  const ConstraintSet constraints = makeConstraintSet(model, makeContactTargets(makeStandingRobot(model, q), 0, 0));
  return settleSprings(model, springs, constraints, makeReferenceProblem(model, reference), q);
}

VectorXd settlePosture(const Model& model, const std::vector<ContactTarget>& contacts, ConstVectorRef q) {
  const std::vector<const JointForce*> springs = listFreeSprings(model);
  if (springs.empty()) return q;
  AssemblyProblem problem;
  problem.q_ref = q;
  problem.weights = VectorXd::Ones(model.nv());
  for (const ContactTarget& target : contacts)
    problem.frames.push_back(makeFrameTarget(model.contacts()[target.contact], target.X_WT));
  return settleSprings(model, springs, makeConstraintSet(model, contacts), std::move(problem), q);
}

double calcSpringStage(const Model& model, ConstVectorRef q, const std::vector<ContactTarget>& contacts) {
  constexpr double kShare = 0.2, kUnit = 1e-3, kShortest = 2e-3;
  double fastest = 0;  // Hz
  if (!listFreeSprings(model).empty()) {
    const ConstraintSet constraints = makeConstraintSet(model, contacts);
    const VectorXd tau = calcMotorForces(model, calcStaticTorques(model, constraints, q).u);
    for (const Mode& mode : calcModes(model, constraints, q, tau).modes) fastest = std::max(fastest, mode.frequency);
  }
  if (fastest == 0) return std::numeric_limits<double>::infinity();
  return std::max(kShortest, kUnit * std::floor(kShare / fastest / kUnit));
}

double calcSpringStage(const Model& model, const Stance& stance) {
  return calcSpringStage(model, stance.q, {{stance.contacts[0], stance.feet[0]}, {stance.contacts[1], stance.feet[1]}});
}

}  // namespace bielle
