// State space and step of reduced_node.h.
#include "reduced_node.h"

#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/rnea.h"

namespace bielle {

ReducedWork::ReducedWork(const Model& model, const Reduction& reduction) : derivatives(model, reduction) {
  for (const LoopBlock& block : reduction.blocks) blocks.emplace_back(block);
  lifts.resize(blocks.size());
  left.setZero(model.nv(), reduction.size);
  dydd.setZero(reduction.size, 2 * reduction.size + model.nu());
}

ReducedWork& ReducedWorkPool::get() {
  const std::lock_guard<std::mutex> lock(mutex_);
  std::unique_ptr<ReducedWork>& work = works_[std::this_thread::get_id()];
  if (!work) work = std::make_unique<ReducedWork>(model_, reduction_);
  return *work;
}

ReducedNode::ReducedNode(const Model& model, const Reduction& reduction, const StageSpec& spec,
                         std::shared_ptr<ReducedWorkPool> pool)
    : NodeModel(model, spec), reduction_(reduction), pool_(std::move(pool)) {
  for (const LoopBlock& block : reduction.blocks) blocks_.emplace_back(block);
  for (size_t i = 0; i < reduction.free_joints.size(); ++i) {
    free_joints_.emplace_back();
    free_joints_.back().joint = reduction.free_joints[i];
    free_joints_.back().offset = reduction.free_offsets[i];
  }
  const int nv = model.nv(), nr = reduction.size, nu = model.nu();
  num_loops_ = spec.constraints.num_loops;
  loop_rows_ = 0;
  for (int c = 0; c < num_loops_; ++c) loop_rows_ += getRows(spec.constraints.closures[c].kind);
  contact_rows_ = spec.constraints.rows - loop_rows_;
  for (VectorXd* v : {&tau_, &a_, &a_d_, &w_, &force_}) v->setZero(nv);
  for (VectorXd* v : {&ydd_, &f_}) v->setZero(nr);
  for (VectorXd* v : {&gamma_, &lambda_c_}) v->setZero(contact_rows_);
  Jc_.setZero(contact_rows_, nv);
  JcN_.setZero(contact_rows_, nr);
  for (MatrixXd* m : {&Cc_q_, &Cc_v_}) m->setZero(contact_rows_, nv);
  dlambda_.setZero(contact_rows_, 2 * nr + nu);
  M_.setZero(nr, nr);
  saddle_point_.resize(nr, contact_rows_);
  f_ext_.assign(model.numBodies(), Vector6d::Zero());
  chart_x_.setConstant(model.nq() + nv, std::numeric_limits<double>::quiet_NaN());
}

void ReducedNode::takeWork() {
  work_ = &pool_->get();
  for (size_t i = 0; i < blocks_.size(); ++i) blocks_[i].work = &work_->blocks[i];
}

void ReducedNode::integrate(ConstVectorRef x, ConstVectorRef dx, VectorRef x_out) {
  takeWork();
  if (!updateChart(x)) {
    x_out.setConstant(std::numeric_limits<double>::quiet_NaN());
    return;
  }
  const int nq = model_.nq(), nr = reduction_.size;
  for (size_t i = 0; i < reduction_.free_joints.size(); ++i) {
    const Joint& joint = model_.joints()[reduction_.free_joints[i]];
    const int at = reduction_.free_offsets[i], n = joint.nv;
    JointVector d = dx.segment(at, n);
    integrateJoint(joint, x.segment(joint.idx_q, joint.nq), d, x_out.segment(joint.idx_q, joint.nq));
    x_out.segment(nq + joint.idx_v, n) = x.segment(nq + joint.idx_v, n) + dx.segment(nr + at, n);
  }
  for (Block& b : blocks_) {
    const LoopBlock& loop = b.loop;
    b.work->d.noalias() = b.chart.N * dx.segment(loop.offset, loop.size);
    if (!b.work->scratch.close(loop, b.chart, b.work->d, {})) {
      fail(b, b.work->scratch);
      x_out.setConstant(std::numeric_limits<double>::quiet_NaN());
      return;
    }
    // The velocity at the new point whose coordinates about the old one are N^T v + dy_v.
    gatherVelocity(loop, x.tail(model_.nv()), b.work->v);
    b.work->target = dx.segment(nr + loop.offset, loop.size);
    addSmallProductTransposed(b.chart.WN, b.work->v, b.work->target);
    b.work->mixed.setZero();
    addSmallProductTransposed(b.chart.WN, b.work->scratch.basis().N, b.work->mixed);
    if (!factorizeSmall(b.work->mixed, b.work->mixed_pivots)) {
      failure_ = "closure '" + loop.closures.closures.front().name + "': the step turns its loops too far";
      x_out.setConstant(std::numeric_limits<double>::quiet_NaN());
      return;
    }
    solveFactorized(b.work->mixed, b.work->mixed_pivots, b.work->target);
    b.work->v.noalias() = b.work->scratch.basis().N * b.work->target;
    scatterConfiguration(model_, loop, b.work->scratch.basis().q, x_out.head(nq));
    scatterVelocity(loop, b.work->v, x_out.tail(model_.nv()));
  }
}

void ReducedNode::difference(ConstVectorRef x0, ConstVectorRef x1, VectorRef dx) {
  takeWork();
  if (!updateChart(x0)) {
    dx.setConstant(std::numeric_limits<double>::quiet_NaN());
    return;
  }
  for (Block& b : blocks_) differenceAbout(b, b.chart, x0, x1, dx);
  differenceFree(x0, x1, dx);
}

bool ReducedNode::updateState(ConstVectorRef x) {
  takeWork();
  return updateState(x, nullptr);
}

bool ReducedNode::updateState(ConstVectorRef x, const ReducedNode* previous) {
  const int nq = model_.nq(), nv = model_.nv();
  failure_.clear();
  updatePositions(model_, ws_, x.head(nq));
  updateVelocities(model_, ws_, x.tail(nv));
  updateMassMatrix(model_, ws_);
  for (size_t i = 0; i < blocks_.size(); ++i) {
    Block& b = blocks_[i];
    if (previous) {
      b.at.assign(previous->blocks_[i].next);
    } else {
      gatherConfiguration(model_, b.loop, x.head(nq), b.work->q);
      if (!b.at.update(b.loop, b.work->q)) return fail(b, b.at);
    }
    gatherVelocity(b.loop, x.tail(nv), b.work->v);
    updateVelocities(b.loop.model, b.at.workspace(), b.work->v);
  }
  return true;
}

bool ReducedNode::updateStep(ConstVectorRef x, ConstVectorRef u, const NodeModel* previous) {
  takeWork();
  const bool follows = previous && previous->x_next() == x;
  if (!updateState(x, follows ? static_cast<const ReducedNode*>(previous) : nullptr)) return false;
  updateBias(model_, ws_);
  a_d_.setZero();
  for (Block& b : blocks_) {
    b.work->a.setZero();
    updateAccelerations(b.loop.model, b.at.workspace(), b.work->a);
    const ConstraintSet& set = b.loop.closures;
    for (size_t c = 0; c < set.closures.size(); ++c)
      b.work->rows.segment(set.offsets[c], getRows(set.closures[c].kind)) =
          calcClosureAcceleration(b.at.workspace(), set.closures[c]);
    for (int i = 0; i < b.loop.rank; ++i) b.work->gamma[i] = b.work->rows[b.at.basis().rows[i]];
    b.work->independent = b.work->gamma;
    b.at.solveGram(b.work->independent);
    b.work->a.noalias() = -b.at.basis().JW.transpose() * b.work->independent;
    scatterVelocity(b.loop, b.work->a, a_d_);
  }
  // Eq. (b)
  calcMotorForces(model_, u, tau_);
  force_ = tau_ - ws_.b;
  force_.noalias() -= ws_.M * a_d_;
  projectVector(force_, f_);
  work_->left.setZero();
  addColumns(ws_.M, &BlockBasisN, work_->left);
  projectRows(work_->left, M_);
  if (contact_rows_ > 0) updateContacts();
  if (saddle_point_.factorize(M_, JcN_) != SaddlePointStatus::Ok) {
    failure_ = "the mass matrix is singular";
    return false;
  }
  saddle_point_.solve(f_, gamma_, ydd_, lambda_c_);
  lambda_.tail(contact_rows_) = lambda_c_;
  a_ = a_d_;
  addFromReduced(ydd_, a_);
  return closeStep(x);
}

void ReducedNode::addColumns(const MatrixXd& A, Accessor accessor, MatrixRef out) const {
  if (accessor == &BlockBasisN)
    for (size_t i = 0; i < reduction_.free_joints.size(); ++i) {
      const Joint& joint = model_.joints()[reduction_.free_joints[i]];
      out.middleCols(reduction_.free_offsets[i], joint.nv) += A.middleCols(joint.idx_v, joint.nv);
    }
  for (const Block& b : blocks_) {
    const MatrixXd& X = accessor(b);
    for (int c = 0; c < b.loop.size; ++c)
      for (size_t k = 0; k < b.loop.dofs.size(); ++k) out.col(b.loop.offset + c) += X(k, c) * A.col(b.loop.dofs[k]);
  }
}

void ReducedNode::projectRows(const MatrixXd& A, MatrixRef out) const {
  for (size_t i = 0; i < reduction_.free_joints.size(); ++i) {
    const Joint& joint = model_.joints()[reduction_.free_joints[i]];
    out.middleRows(reduction_.free_offsets[i], joint.nv) = A.middleRows(joint.idx_v, joint.nv);
  }
  for (const Block& b : blocks_) {
    const MatrixXd& N = b.at.basis().N;
    for (Eigen::Index col = 0; col < A.cols(); ++col)
      for (int c = 0; c < b.loop.size; ++c) {
        double sum = 0;
        for (size_t k = 0; k < b.loop.dofs.size(); ++k) sum += N(k, c) * A(b.loop.dofs[k], col);
        out(b.loop.offset + c, col) = sum;
      }
  }
}

void ReducedNode::projectVector(const VectorXd& x, VectorXd& out) const {
  for (size_t i = 0; i < reduction_.free_joints.size(); ++i) {
    const Joint& joint = model_.joints()[reduction_.free_joints[i]];
    out.segment(reduction_.free_offsets[i], joint.nv) = x.segment(joint.idx_v, joint.nv);
  }
  for (const Block& b : blocks_)
    for (int c = 0; c < b.loop.size; ++c) {
      double sum = 0;
      for (size_t k = 0; k < b.loop.dofs.size(); ++k) sum += b.at.basis().N(k, c) * x[b.loop.dofs[k]];
      out[b.loop.offset + c] = sum;
    }
}

void ReducedNode::addFromReduced(const VectorXd& y, VectorXd& x) const {
  for (size_t i = 0; i < reduction_.free_joints.size(); ++i) {
    const Joint& joint = model_.joints()[reduction_.free_joints[i]];
    x.segment(joint.idx_v, joint.nv) += y.segment(reduction_.free_offsets[i], joint.nv);
  }
  for (const Block& b : blocks_)
    for (size_t k = 0; k < b.loop.dofs.size(); ++k)
      x[b.loop.dofs[k]] += b.at.basis().N.row(k).dot(y.segment(b.loop.offset, b.loop.size));
}

void ReducedNode::updateContacts() {
  const ConstraintSet& set = spec_.constraints;
  for (size_t c = num_loops_; c < set.closures.size(); ++c) {
    const Closure& contact = set.closures[c];
    const int row = set.offsets[c] - loop_rows_, n = getRows(contact.kind);
    calcClosureJacobian(ws_, contact, Jc_.middleRows(row, n));
    gamma_.segment(row, n) = calcClosureAcceleration(ws_, contact) + calcClosureStabilization(ws_, contact);
  }
  gamma_.noalias() += Jc_ * a_d_;
  JcN_.setZero();
  addColumns(Jc_, &BlockBasisN, JcN_);
}

// robot_problem.h Eq. (3)
bool ReducedNode::closeStep(ConstVectorRef x) {
  const int nq = model_.nq(), nv = model_.nv();
  const double h = spec_.dt;
  w_ = x.tail(nv) + h * a_;
  for (int i : reduction_.free_joints) {
    const Joint& joint = model_.joints()[i];
    const JointVector d = h * w_.segment(joint.idx_v, joint.nv);
    integrateJoint(joint, x.segment(joint.idx_q, joint.nq), d, x_next_.segment(joint.idx_q, joint.nq));
  }
  x_next_.tail(nv) = w_;
  for (Block& b : blocks_) {
    gatherVelocity(b.loop, w_, b.work->d);
    b.work->d *= h;
    // To second order the closures open by h^2/2 gamma along h w: J J^T zeta = h^2/2 gamma, with the zeta of close().
    b.work->zeta = (0.5 * h * h) * b.work->independent;
    if (!b.next.close(b.loop, b.at.basis(), b.work->d, b.work->zeta)) return fail(b, b.next);
    b.work->w = b.next.step() / h;
    b.mu.noalias() = b.next.basis().J * b.work->w;
    b.next.solveGram(b.mu);
    b.v_next = b.work->w;
    b.v_next.noalias() -= b.next.basis().JW.transpose() * b.mu;
    scatterConfiguration(model_, b.loop, b.next.basis().q, x_next_.head(nq));
    scatterVelocity(b.loop, b.v_next, x_next_.tail(nv));
  }
  return true;
}

void ReducedNode::differenceAbout(Block& b, const BlockBasis& basis, ConstVectorRef x0, ConstVectorRef x1,
                                  VectorRef dx) const {
  const int nq = model_.nq(), nr = reduction_.size;
  gatherConfiguration(model_, b.loop, x1.head(nq), b.work->q);
  b.loop.model.difference(basis.q, b.work->q, b.work->d);
  dx.segment(b.loop.offset, b.loop.size).noalias() = basis.WN.transpose() * b.work->d;
  for (size_t k = 0; k < b.loop.dofs.size(); ++k) b.work->d[k] = x1[nq + b.loop.dofs[k]] - x0[nq + b.loop.dofs[k]];
  dx.segment(nr + b.loop.offset, b.loop.size).noalias() = basis.WN.transpose() * b.work->d;
}

void ReducedNode::differenceFree(ConstVectorRef x0, ConstVectorRef x1, VectorRef dx) const {
  const int nq = model_.nq(), nr = reduction_.size;
  for (size_t i = 0; i < reduction_.free_joints.size(); ++i) {
    const Joint& joint = model_.joints()[reduction_.free_joints[i]];
    const int o = reduction_.free_offsets[i], n = joint.nv, k = joint.idx_v;
    calcJointDifference(joint, x0.segment(joint.idx_q, joint.nq), x1.segment(joint.idx_q, joint.nq), dx.segment(o, n));
    dx.segment(nr + o, n) = x1.segment(nq + k, n) - x0.segment(nq + k, n);
  }
}

// Bases at x for integrate() and difference(): those of the last linearization, unless x is another point.
bool ReducedNode::updateChart(ConstVectorRef x) {
  if (chart_x_ == x) return true;
  for (Block& b : blocks_) {
    gatherConfiguration(model_, b.loop, x.head(model_.nq()), b.work->q);
    if (!b.work->scratch.update(b.loop, b.work->q)) return fail(b, b.work->scratch);
    b.chart = b.work->scratch.basis();
  }
  chart_x_ = x;
  return true;
}

void ReducedNode::storeChart() {
  for (Block& b : blocks_) b.chart = b.at.basis();
  chart_x_.head(model_.nq()) = ws_.q;
  chart_x_.tail(model_.nv()) = ws_.v;
}

std::shared_ptr<ReducedWorkPool> makeReducedWorkPool(const Model& model, const Reduction& reduction) {
  return std::make_shared<ReducedWorkPool>(model, reduction);
}

std::unique_ptr<NodeModel> makeReducedNode(const Model& model, const Reduction& reduction, const StageSpec& spec,
                                           std::shared_ptr<ReducedWorkPool> pool) {
  return std::make_unique<ReducedNode>(model, reduction, spec, std::move(pool));
}

}  // namespace bielle
