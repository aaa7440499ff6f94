#include "motion/statics.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/modes.h"
#include "bielle/dynamics/rnea.h"
#include "math/decompositions.h"
#include "math/largest.h"
#include "math/linear_program.h"
#include "model/joint.h"

namespace bielle {
namespace {

// Of pivots over the largest: where springs balance the weight but for rounding, a smaller one is that balance.
constexpr double kHeldRank = 1e-8;

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
  decomposition.setThreshold(kHeldRank);
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

// Wrenches that a contact of the ground can have are sums of these columns, in the rows of its closure: forces along the edges of
// the pyramid around the friction cone, at the corners.
MatrixXd makeConeEdges(const ContactFrame& contact, double friction) {
  const bool is_sole = contact.kind == ContactKind::Surface6D, is_point = contact.kind == ContactKind::Point3D;
  const Eigen::Matrix<double, 2, 3> across_edge = makePlaneBasis(Vector3d::UnitX()).leftCols<2>().transpose();
  MatrixXd edges(is_sole ? 6 : is_point ? 3 : 5, 4 * (is_point ? 1 : 2) * (is_sole ? 2 : 1));
  Eigen::Index column = 0;
  for (const double x : is_point ? std::vector<double>{0} : std::vector<double>{-1, 1})
    for (const double y : is_sole ? std::vector<double>{-1, 1} : std::vector<double>{0})
      for (const double fx : {-friction, friction})
        for (const double fy : {-friction, friction}) {
          const Vector3d f(fx, fy, 1), moment = Vector3d(x * contact.half_length, y * contact.half_width, 0).cross(f);
          edges.col(column).head<3>() = f;
          if (is_sole) edges.col(column).tail<3>() = moment;
          if (!is_sole && !is_point) edges.col(column).tail<2>() = across_edge * moment;
          ++column;
        }
  return edges;
}

// The least s with which torques within s times the limits, and forces of contacts within their cones, hold the robot: the linear
// program in torques, over their limits, and shares of the edges of cones. Loops only leave some motions Z of the tree.
// \param A  makeHoldMatrix(), of whose columns the first are motors, then springs that hold whatever it takes
double calcLeastShare(const Model& model, const ConstraintSet& constraints, const MatrixXd& A, const VectorXd& b,
                      const VectorXd& limits, double friction) {
  const Eigen::Index num_dofs = A.cols() - constraints.rows, nu = limits.size();
  const double scale = calcForceScale(model);  // of forces and torques
  const auto getColumns = [&](int c) {
    return A.middleCols(num_dofs + constraints.offsets[c], getRows(constraints.closures[c].kind)) / scale;
  };
  MatrixXd loops(A.rows(), 0);
  std::vector<MatrixXd> columns;  // of unknowns that are not negative
  for (int c = 0; c < static_cast<int>(constraints.closures.size()); ++c) {
    const MatrixXd J = getColumns(c);
    if (c >= constraints.num_loops) {
      columns.push_back(J * makeConeEdges(model.contacts()[constraints.getContact(c)], friction));
      continue;
    }
    loops.conservativeResize(Eigen::NoChange, loops.cols() + J.cols());
    loops.rightCols(J.cols()) = J;
  }
  for (const double sign : {1.0, -1.0})
    for (Eigen::Index i = 0; i < num_dofs; ++i)
      columns.push_back(sign * (i < nu && std::isfinite(limits[i]) ? limits[i] / scale : 1) * A.col(i));
  Eigen::Index size = 0, first = 0;  // of the columns, and of those of motors and springs
  for (const MatrixXd& each : columns) size += each.cols();
  first = size - 2 * num_dofs;
  MatrixXd Z = MatrixXd::Identity(A.rows(), A.rows());
  if (loops.cols() > 0) {
    Eigen::ColPivHouseholderQR<MatrixXd> decomposition;
    decomposition.setThreshold(kHeldRank);
    decomposition.compute(loops);
    Z = MatrixXd(decomposition.householderQ()).rightCols(A.rows() - decomposition.rank()).eval();
  }
  // Then t+ + t- + slack = s for every motor with a limit; s is the last unknown.
  MatrixXd rows = MatrixXd::Zero(Z.cols() + nu, size + nu + 1);
  Eigen::Index column = 0;
  for (const MatrixXd& each : columns) {
    rows.block(0, column, Z.cols(), each.cols()) = Z.transpose() * each;
    column += each.cols();
  }
  for (Eigen::Index m = 0; m < nu; ++m) {
    if (!std::isfinite(limits[m])) continue;
    const Eigen::Index row = Z.cols() + m;
    rows(row, first + m) = rows(row, first + num_dofs + m) = rows(row, size + m) = 1;
    rows(row, size + nu) = -1;
  }
  VectorXd right = VectorXd::Zero(rows.rows()), costs = VectorXd::Zero(rows.cols());
  right.head(Z.cols()) = Z.transpose() * b / scale;
  costs[size + nu] = 1;
  const std::optional<VectorXd> x = solveLinearProgram(rows, right, costs);
  return x ? (*x)[size + nu] : std::numeric_limits<double>::infinity();
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
  Eigen::CompleteOrthogonalDecomposition<MatrixXd> decomposition;
  decomposition.setThreshold(kHeldRank);
  decomposition.compute(A);
  const VectorXd solution = decomposition.solve(b);
  const double scale = calcForceScale(model);
  HoldingShare share;
  share.u = solution.head(model.nu());
  const bool balances = calcLargest(A * solution - b) < kBalanced * scale;
  if (balances && (share.u.array().abs() <= limits.array()).all()) return share;
  share.least =
      balances ? calcLeastShare(model, constraints, A, b, limits, friction) : std::numeric_limits<double>::infinity();
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
