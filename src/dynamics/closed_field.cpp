#include "dynamics/closed_field.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/rnea.h"
#include "model/joint.h"
#include "model/number_text.h"

namespace bielle {
namespace {

constexpr double kClosed = 2e-16;    // m, rad: nothing can be gained below
constexpr double kAccepted = 1e-11;  // where rounding keeps Newton's steps from gaining
constexpr double kSlow = 0.05;       // gain of a step above which its matrix is renewed
constexpr int kMostSteps = 20;
constexpr double kMostRotation = 2;  // rad, of a joint whose tangent space is curved, in one chart

}  // namespace

void ClosedField::begin(ConstVectorRef q) {
  q_start_ = q;
  updatePositions(model_, ws_, q_start_);
  updateRows();
  for (Loop& loop : loops_) loop.J_start = loop.J;
}

// delta and q of Eq. (1) for the present zeta.
void ClosedField::displace(ConstVectorRef d) {
  delta_ = d;
  for (const Loop& loop : loops_)
    for (size_t k = 0; k < loop.dofs.size(); ++k)
      delta_[loop.dofs[k]] -= loop.J_start.col(k).dot(zeta_.segment(loop.offset, loop.J_start.rows()));
  for (const Joint& joint : model_.joints())
    if (joint.nv)
      integrateJoint(joint, q_start_.segment(joint.idx_q, joint.nq), delta_.segment(joint.idx_v, joint.nv),
                     q_.segment(joint.idx_q, joint.nq));
}

double ClosedField::updateResidual() {
  double gap = 0;
  for (const Loop& loop : loops_) {
    const RowVectorUpTo6 all = calcClosureResidual<double>(ws_, model_.closures()[loop.index]);
    for (size_t r = 0; r < loop.chosen.size(); ++r) {
      const double value = all[loop.chosen[r]];
      residual_[loop.offset + static_cast<int>(r)] = value;
      if (!(std::abs(value) <= gap)) gap = std::abs(value);
    }
  }
  return gap;
}

// J of all loops at the workspace's positions.
void ClosedField::updateRows() {
  for (Loop& loop : loops_) {
    const Closure& closure = model_.closures()[loop.index];
    auto J = scratch_.topLeftCorner(getRows(closure.kind), model_.nv());
    calcClosureJacobian<double>(ws_, closure, J);
    for (size_t k = 0; k < loop.dofs.size(); ++k)
      for (size_t r = 0; r < loop.chosen.size(); ++r) loop.J(r, k) = J(loop.chosen[r], loop.dofs[k]);
  }
}

bool ClosedField::updateNewton() {
  for (Newton& newton : newtons_) {
    if (newton.sparse)
      std::fill(newton.sparse->valuePtr(), newton.sparse->valuePtr() + newton.sparse->nonZeros(), 0.0);
    else
      newton.K.setZero();
    for (const Pair& pair : newton.pairs) {
      const Loop &a = loops_[pair.a], &b = loops_[pair.b];
      for (Eigen::Index i = 0; i < a.J.rows(); ++i)
        for (Eigen::Index j = 0; j < b.J_start.rows(); ++j) {
          double sum = 0;
          for (const auto& [k, l] : pair.columns) sum += a.J(i, k) * b.J_start(j, l);
          const Eigen::Index row = a.offset - newton.offset + i, col = b.offset - newton.offset + j;
          if (newton.sparse)
            newton.sparse->coeffRef(row, col) = sum;
          else
            newton.K(row, col) = sum;
        }
    }
    if (newton.sparse) {
      newton.sparse_factor->factorize(*newton.sparse);
      if (newton.sparse_factor->info() != Eigen::Success) return false;
    } else if (newton.rows > 0) {
      newton.factor.compute(newton.K);
    }
  }
  return true;
}

// zeta after a step of Newton's method: the residual falls by J dq (notation.h).
void ClosedField::solveNewton() {
  for (Newton& newton : newtons_) {
    if (newton.rows == 0) continue;
    const auto residual = residual_.segment(newton.offset, newton.rows);
    if (newton.sparse)
      newton.x = newton.sparse_factor->solve(residual);
    else
      newton.x.noalias() = newton.factor.solve(residual);
    zeta_.segment(newton.offset, newton.rows) -= newton.x;
  }
}

bool ClosedField::close(ConstVectorRef d, ConstVectorRef u) {
  zeta_.setZero();
  double previous = std::numeric_limits<double>::infinity();
  for (int i = 0;; ++i) {
    displace(d);
    updatePlacements<double>(model_, ws_, q_);
    const double gap = updateResidual();
    if (gap <= kClosed) break;
    if (!(gap <= std::numeric_limits<double>::max()) || i == kMostSteps) return fail(describeWorst());
    if (gap > 0.5 * previous) {
      if (gap <= kAccepted) break;
      if (i > 3) return fail(describeWorst());
    }
    if (gap > kSlow * previous || i == 0) {
      updateColumns(model_, ws_);
      updateRows();
      if (!updateNewton()) return fail(describeWorst());
    }
    previous = gap;
    solveNewton();
  }
  for (int j : grouped_) {
    const Joint& joint = model_.joints()[j];
    const int angles = joint.kind == JointKind::Planar ? 1 : 3;
    if (delta_.segment(joint.idx_v + joint.nv - angles, angles).norm() > kMostRotation)
      return fail("joint '" + joint.name + "' turns by more than " + formatNumber(kMostRotation) + " rad in a step");
  }
  updateColumns(model_, ws_);
  updateRows();
  updateCompositeInertias(model_, ws_);
  if (!updateFactors()) return false;
  v_ = u;
  for (int refine = 0; refine < (rows_ > 0 ? 2 : 0); ++refine) {  // Eq. (2), and once more for the rounding of S
    multiply(v_, r_);
    r_ = -r_;
    solveRows(r_);
    addImpulse(r_, v_);
  }
  updateVelocities<double>(model_, ws_, v_);
  updateBias(model_, ws_);
  return true;
}

// M of every block, W = L^{-1} J^T, S and its factor.
bool ClosedField::updateFactors() {
  for (size_t b = 0; b < blocks_.size(); ++b) {
    Block& block = blocks_[b];
    for (size_t j = 0; j < block.dofs.size(); ++j) {
      const int dof = block.dofs[j];
      for (int k = dof; k >= 0; k = model_.dofs()[k].parent)
        block.M(j, places_[k].second) = ws_.YJ.col(dof).dot(ws_.J.col(k));
      block.M(j, j) += model_.armature()[dof];
    }
    block.factor.compute(block.M);
    if (block.factor.info() != Eigen::Success) {
      const Joint& joint = model_.joints()[model_.dofs()[block.dofs.front()].joint];
      return fail("the mass matrix of the bodies behind joint '" + joint.name +
                  "' is singular: one of them needs mass, inertia or the armature of a motor");
    }
  }
  for (const Loop& loop : loops_)
    for (size_t k = 0; k < loop.dofs.size(); ++k) {
      const auto [i, row] = loop.places[k];
      const auto [b, first] = loop.blocks[i];
      blocks_[b].Jt.row(row).segment(first, loop.J.rows()) = loop.J.col(k).transpose();
    }
  if (rows_ == 0) return true;
  if (S_sparse_)
    std::fill(S_sparse_->valuePtr(), S_sparse_->valuePtr() + S_sparse_->nonZeros(), 0.0);
  else
    S_.setZero();
  for (Block& block : blocks_) {
    block.W = block.Jt;
    block.factor.matrixL().solveInPlace(block.W);
    block.gram.noalias() = block.W.transpose() * block.W;
    for (size_t j = 0; j < block.rows.size(); ++j)
      for (size_t i = 0; i < block.rows.size(); ++i)
        if (block.rows[i] >= block.rows[j]) {
          if (S_sparse_)
            S_sparse_->coeffRef(block.rows[i], block.rows[j]) += block.gram(i, j);
          else
            S_(block.rows[i], block.rows[j]) += block.gram(i, j);
        }
  }
  independence_ = 1;
  if (S_sparse_) {
    const double largest = S_sparse_->diagonal().maxCoeff();
    S_sparse_factor_->factorize(*S_sparse_);
    if (S_sparse_factor_->info() != Eigen::Success) return fail("the rows of its loops are dependent");
    const VectorXd L = S_sparse_factor_->matrixL().nestedExpression().diagonal();
    for (int i = 0; i < rows_; ++i) {
      const double pivot = L[S_sparse_factor_->permutationP().indices()[i]];
      independence_ = std::min(independence_, pivot * pivot / largest);
    }
  } else {
    const double largest = S_.diagonal().maxCoeff();
    S_factor_.compute(S_);
    if (S_factor_.info() != Eigen::Success) independence_ = 0;
    for (int i = 0; i < rows_; ++i) {
      const double pivot = S_factor_.matrixLLT()(i, i);
      independence_ = std::min(independence_, pivot * pivot / largest);
    }
  }
  if (!(independence_ > kSingular)) return fail("the rows of its loops become dependent there: a singular posture");
  return true;
}

void ClosedField::solveRows(VectorXd& x) {
  if (S_sparse_)
    x = S_sparse_factor_->solve(x).eval();
  else
    S_factor_.solveInPlace(x);
}

// rows = J x
void ClosedField::multiply(const VectorXd& x, VectorXd& rows) const {
  for (const Loop& loop : loops_) {
    auto out = rows.segment(loop.offset, loop.J.rows());
    out.setZero();
    for (size_t k = 0; k < loop.dofs.size(); ++k) out += loop.J.col(k) * x[loop.dofs[k]];
  }
}

// x += M^{-1} J^T rows
void ClosedField::addImpulse(const VectorXd& rows, VectorXd& x) {
  for (Block& block : blocks_) {
    if (block.rows.empty()) continue;
    for (size_t r = 0; r < block.rows.size(); ++r) block.y[r] = rows[block.rows[r]];
    block.x.noalias() = block.W * block.y;
    block.factor.matrixU().solveInPlace(block.x);
    for (size_t k = 0; k < block.dofs.size(); ++k) x[block.dofs[k]] += block.x[k];
  }
}

// x <- M^{-1} x
void ClosedField::solveMass(VectorXd& x) {
  for (Block& block : blocks_) {
    for (size_t k = 0; k < block.dofs.size(); ++k) block.x[k] = x[block.dofs[k]];
    block.factor.solveInPlace(block.x);
    for (size_t k = 0; k < block.dofs.size(); ++k) x[block.dofs[k]] = block.x[k];
  }
}

void ClosedField::accelerate(ConstVectorRef tau, VectorRef d_rate, VectorRef u_rate) {
  a_ = tau - ws_.b;
  solveMass(a_);
  if (rows_ > 0) {
    for (const Loop& loop : loops_) {
      const RowVectorUpTo6 all = calcClosureAcceleration<double>(ws_, model_.closures()[loop.index]);
      for (size_t r = 0; r < loop.chosen.size(); ++r) gamma_[loop.offset + static_cast<int>(r)] = all[loop.chosen[r]];
    }
    lambda_.setZero();
    for (int refine = 0; refine < 2; ++refine) {  // Eq. (3), and once more for the rounding of S
      multiply(a_, r_);
      r_ = -r_ - gamma_;
      solveRows(r_);
      lambda_ += r_;
      addImpulse(r_, a_);
    }
  }
  u_rate = a_;
  d_rate = v_;
  for (int j : grouped_) {
    const Joint& joint = model_.joints()[j];
    auto D = scratch_.topLeftCorner(joint.nv, joint.nv);
    calcJointDifferenceJacobian(joint, delta_.segment(joint.idx_v, joint.nv), D);
    x_.head(joint.nv).noalias() = D * v_.segment(joint.idx_v, joint.nv);
    d_rate.segment(joint.idx_v, joint.nv) = x_.head(joint.nv);
  }
}

double ClosedField::calcGap() const {
  double gap = 0;
  for (const Loop& loop : loops_)
    gap = std::max(gap, calcClosureResidual<double>(ws_, model_.closures()[loop.index]).cwiseAbs().maxCoeff());
  return gap;
}

bool ClosedField::fail(const std::string& why) {
  failure_ = why;
  return false;
}

std::string ClosedField::describeWorst() const {
  const Loop* worst = nullptr;
  double largest = -1;
  for (const Loop& loop : loops_)
    for (size_t r = 0; r < loop.chosen.size(); ++r) {
      const double gap = std::abs(residual_[loop.offset + static_cast<int>(r)]);
      if (gap > largest) largest = gap, worst = &loop;
    }
  return "closure '" + (worst ? model_.closures()[worst->index].name : std::string()) + "' does not close";
}

}  // namespace bielle
