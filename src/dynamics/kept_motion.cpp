#include "bielle/dynamics/kept_motion.h"

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/rnea.h"
#include "math/largest.h"

namespace bielle {
namespace {

const double kRankTolerance = AssemblyOptions().rank_tolerance;  // of H, relative, as in assembly
constexpr double kGapTolerance = 1e-6;                           // of Eq. (2), relative to 1 and the motion
constexpr double kBalanceTolerance = 1e-7;  // of Eqs. (4) and (5), relative to their right-hand sides

MatrixXd calcJacobian(const Model& model, const Workspace& ws, const ConstraintSet& set) {
  MatrixXd J = MatrixXd::Zero(set.rows, model.nv());
  for (size_t c = 0; c < set.closures.size(); ++c)
    calcClosureJacobian(ws, set.closures[c], J.middleRows(set.offsets[c], getRows(set.closures[c].kind)));
  return J;
}

}  // namespace

Closing::Closing(const Model& model, const Workspace& ws, const ConstraintSet& closures, std::vector<int> held)
    : closures_(closures), rows_(closures.rows) {
  for (Closure& closure : closures_.closures) closure.kp = closure.kd = 0;  // closed loops need no stabilisation
  H_.setZero(rows_ + static_cast<Eigen::Index>(held.size()), model.nv());
  H_.topRows(rows_) = calcJacobian(model, ws, closures);
  for (size_t i = 0; i < held.size(); ++i) H_(rows_ + static_cast<Eigen::Index>(i), held[i]) = 1;
  decomposition_.setThreshold(kRankTolerance);
  decomposition_.compute(H_);
}

VectorXd Closing::solve(ConstVectorRef rows, ConstVectorRef values) const {
  VectorXd rhs(H_.rows());
  rhs << rows, values;
  return decomposition_.solve(rhs);
}

VectorXd Closing::solveTransposed(ConstVectorRef force) const { return decomposition_.transpose().solve(force); }

MatrixXd Closing::calcTangent() const {
  const Eigen::Index held = H_.rows() - rows_;
  MatrixXd rhs = MatrixXd::Zero(H_.rows(), held);
  rhs.bottomRows(held).setIdentity();
  return decomposition_.solve(rhs);
}

double Closing::calcMotion(const Model& model, const Workspace& ws, const ModelVariation& change,
                           MotionVariation& motion) const {
  const VectorXd still = VectorXd::Zero(H_.rows() - rows_);
  VariationWorkspace variation(model);
  motion = MotionVariation(model);
  double gap = 0;
  const auto close = [&](const VectorXd& rows, VectorXd& out) {
    out = solve(rows, still);
    VectorXd left = H_ * out;
    left.head(rows_) -= rows;
    gap = getLarger(gap, calcLargest(left));
  };
  updateVariation(model, ws, change, motion, variation);
  close(calcResidualVariation(ws, closures_, change, variation), motion.q);
  updateVariation(model, ws, change, motion, variation);
  close(-calcVelocityVariation(ws, closures_, change, variation), motion.v);
  updateVariation(model, ws, change, motion, variation);
  close(-calcAccelerationVariation(ws, closures_, change, variation), motion.a);
  return gap;
}

KeptMotion::KeptMotion(const Model& model, std::vector<int> kept)
    : model_(model), kept_(std::move(kept)), loops_(makeConstraintSet(model)), ws_(model), virtual_ws_(model) {}

VectorXd KeptMotion::selectMotors(const VectorXd& x) const {
  VectorXd out(model_.nu());
  for (int m = 0; m < model_.nu(); ++m) out[m] = x[model_.motors()[m].dof];
  return out;
}

bool KeptMotion::solveBalance(const VectorXd& rhs, VectorXd& solution) const {
  solution = decomposition_.solve(rhs);
  return calcLargest(balance_ * solution - rhs) <= kBalanceTolerance * (1 + calcLargest(rhs));
}

NumericalStatus KeptMotion::update(const ConstraintSet& constraints, ConstVectorRef q, ConstVectorRef v_kept,
                                   ConstVectorRef a_kept, ConstVectorRef forces) {
  constraints_ = constraints;
  for (Closure& closure : constraints_.closures) closure.kp = closure.kd = 0;
  const Eigen::Index nu = model_.nu(), nf = constraints.rows - loops_.rows,
                     nk = static_cast<Eigen::Index>(kept_.size());
  updatePositions(model_, ws_, q);
  closing_.emplace(model_, ws_, loops_, kept_);
  if (!closing_->isDetermined()) return NumericalStatus::NearDeadPoint;
  T_ = closing_->calcTangent();
  v_ = T_ * v_kept;
  updateVelocities(model_, ws_, v_);
  updateDrift(model_, ws_);
  VectorXd gamma(loops_.rows);
  for (size_t c = 0; c < loops_.closures.size(); ++c)
    gamma.segment(loops_.offsets[c], getRows(loops_.closures[c].kind)) =
        calcClosureAcceleration(ws_, loops_.closures[c]);
  const VectorXd a = closing_->solve(-gamma, a_kept);  // Eq. (1)
  updateInverseDynamics(model_, ws_, a);
  const VectorXd force = ws_.b;
  updateAccelerations(model_, ws_, a);

  J_contacts_ = calcJacobian(model_, ws_, constraints).bottomRows(nf);
  balance_.setZero(nu + nf + nk, nu + nf + nk);
  for (Eigen::Index m = 0; m < nu; ++m) balance_.block(nu + nf, m, nk, 1) = T_.row(model_.motors()[m].dof).transpose();
  balance_.block(nu + nf, nu, nk, nf) = (J_contacts_ * T_).transpose();
  balance_.topRightCorner(nu + nf, nk) = balance_.bottomLeftCorner(nk, nu + nf).transpose();
  balance_.block(nu, nu, nf, nf) = -MatrixXd::Identity(nf, nf);
  decomposition_.setThreshold(kRankTolerance);
  decomposition_.compute(balance_);
  VectorXd rhs(nu + nf + nk), solution;
  rhs << VectorXd::Zero(nu), -forces, T_.transpose() * force;
  if (!solveBalance(rhs, solution)) return NumericalStatus::Unbalanced;  // Eq. (4)
  u_ = solution.head(nu);
  lambda_.resize(constraints.rows);
  lambda_ << closing_
                 ->solveTransposed(force - calcMotorForces(model_, u_) -
                                   J_contacts_.transpose() * solution.segment(nu, nf))
                 .head(loops_.rows),
      solution.segment(nu, nf);

  updatePositions(model_, virtual_ws_, q);
  m_ = T_ * solution.tail(nk);
  return NumericalStatus::Ok;
}

// n, and in `rows` e, for a velocity v that is closed: Eq. (5).
VectorXd KeptMotion::calcLift(const ModelVariation& change, const VectorXd& dq, const VectorXd& v, VectorXd& rows) {
  updateVelocities(model_, virtual_ws_, v);
  updateAccelerations(model_, virtual_ws_, VectorXd::Zero(model_.nv()));
  MotionVariation motion(model_);
  motion.q = dq;
  VariationWorkspace variation(model_);
  updateVariation(model_, virtual_ws_, change, motion, variation);
  rows = calcVelocityVariation(virtual_ws_, constraints_, change, variation);
  return -closing_->solve(rows.head(loops_.rows), VectorXd::Zero(T_.cols()));
}

VectorXd KeptMotion::calcTangentVariation(const ModelVariation& change, const MotionVariation& motion,
                                          ConstVectorRef w) {
  VectorXd rows;
  return calcLift(change, motion.q, T_ * w, rows);
}

NumericalStatus KeptMotion::calcVariation(const ModelVariation& change, Variation& out) {
  const Eigen::Index nu = model_.nu(), nf = J_contacts_.rows(), nk = T_.cols(), loops = loops_.rows;
  const double gap = closing_->calcMotion(model_, ws_, change, out.motion);
  const double moved = calcLargest(out.motion.q) + calcLargest(out.motion.v) + calcLargest(out.motion.a);
  if (!(gap <= kGapTolerance * (1 + moved))) return NumericalStatus::Contradictory;
  VariationWorkspace variation(model_);
  updateVariation(model_, ws_, change, out.motion, variation);
  const VectorXd force =
      calcInverseDynamicsVariation(model_, ws_, constraints_, lambda_, change, out.motion, variation);

  VectorXd e;
  const VectorXd n = calcLift(change, out.motion.q, m_, e);
  VectorXd rhs(nu + nf + nk), solution;
  rhs << -selectMotors(n), -(e.tail(nf) + J_contacts_ * n), T_.transpose() * force;
  if (!solveBalance(rhs, solution)) return NumericalStatus::Unbalanced;  // Eq. (5)
  out.u = solution.head(nu);
  out.lambda.resize(constraints_.rows);
  out.lambda << closing_
                    ->solveTransposed(force - calcMotorForces(model_, out.u) -
                                      J_contacts_.transpose() * solution.segment(nu, nf))
                    .head(loops),
      solution.segment(nu, nf);
  return NumericalStatus::Ok;
}

}  // namespace bielle
