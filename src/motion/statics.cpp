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

// Torques of these dofs, in their order, that hold the robot still as in motion.h Eq. (1), in the least-squares sense.
struct StaticHold {
  VectorXd tau;
  double residual = 0;
};

StaticHold calcStaticHold(const Model& model, const ConstraintSet& constraints, ConstVectorRef q,
                          const std::vector<int>& dofs) {
  Workspace ws(model);
  updatePositions(model, ws, q);
  updateVelocities(model, ws, VectorXd::Zero(model.nv()));
  updateBias(model, ws);
  // Unknowns (tau, lambda / scale): forces weigh less than torques of the same number, so that the ground carries the
  // robot.
  const double scale = std::max(1.0, model.mass() * model.gravity().norm());
  const int n = static_cast<int>(dofs.size());
  MatrixXd A = MatrixXd::Zero(model.nv(), n + constraints.rows);
  for (int i = 0; i < n; ++i) A(dofs[i], i) = 1;
  MatrixXd J = MatrixXd::Zero(constraints.rows, model.nv());
  for (size_t c = 0; c < constraints.closures.size(); ++c)
    calcClosureJacobian(ws, constraints.closures[c],
                        J.middleRows(constraints.offsets[c], getRows(constraints.closures[c].kind)));
  A.rightCols(constraints.rows) = scale * J.transpose();
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
