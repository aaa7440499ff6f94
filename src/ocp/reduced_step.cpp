// The step of reduced_node.h: robot_problem.h Eq. (3), of one node or of several at once.
#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/rnea.h"
#include "reduced_node.h"

namespace bielle {

bool ReducedNode::updateStep(ConstVectorRef x, ConstVectorRef u, const NodeModel* previous) {
  takeWork();
  const ReducedNode* before = previous && previous->x_next() == x ? static_cast<const ReducedNode*>(previous) : nullptr;
  if (!updateState(x, before)) return false;
  ReducedWork& work = *work_;
  updateDriftAccelerations();
  updateInverseDynamics(model_, work.ws, work.a_d);
  // Eq. (b)
  calcMotorForces(model_, u, tau_);
  work.force = tau_ - work.ws.b;
  projectVector(work.force, work.f);
  for (Cluster& b : clusters_) updateTwists(getPlacedView(b.loop, work.ws), b.at, b.work->motion);
  work.tree.updateMassMatrix(work.ws, work.lifts, work.M);
  updateContacts();
  if (!solveContacts()) return false;
  a_ = work.a_d;
  addFromReduced(work.ydd, a_);
  stepFreeJoints();
  return closeStep(before);
}

// Eq. (b) for y' and lambda_c.
bool ReducedNode::solveContacts() {
  ReducedWork& work = *work_;
  ContactWork& contacts = work.contacts.at(contact_rows_);
  if (contacts.saddle_point.factorize(work.M, contacts.JcN) != SaddlePointStatus::Ok) {
    failure_ = "the mass matrix is singular";
    return false;
  }
  contacts.saddle_point.solve(work.f, contacts.gamma, work.ydd, contacts.lambda);
  contacts.saddle_point.updateInverse();
  factors_ = contacts.saddle_point.factors();
  lambda_.tail(contact_rows_) = contacts.lambda;
  return true;
}

bool ReducedNode::startStep(ConstVectorRef x, ConstVectorRef u, const NodeModel* previous) {
  takeWork();
  before_ = previous && previous->x_next() == x ? static_cast<const ReducedNode*>(previous) : nullptr;
  calcMotorForces(model_, u, tau_);
  setState(x);
  if (before_)
    for (size_t i = 0; i < clusters_.size(); ++i) takePoint(clusters_[i], before_->clusters_[i].next);
  return true;
}

// Steps that fail together with others are tried once more alone, which says why.
void ReducedNode::finishSteps(NodeModel* const* nodes, int count, bool* ok) {
  takeWork();
  ReducedLanes& lanes = work_->lanes;
  LaneMask placed;
  const LaneMask solved = lanes.startSteps(nodes, count, placed);
  for (int l = 0; l < count; ++l) {
    ok[l] = placed[l];
    if (solved[l] || !ok[l]) continue;
    ReducedNode& node = *static_cast<ReducedNode*>(nodes[l]);
    node.takeWork();
    ContactWork& contacts = work_->contacts.at(node.contact_rows_);
    lanes.loadSystem(l, work_->M, contacts.JcN, work_->f, contacts.gamma);
    ok[l] = node.solveContacts();
    if (!ok[l]) work_->ydd.setZero();
    lanes.storeAccelerations(l, work_->ydd);
  }
  const LaneMask closed = lanes.finishSteps();
  for (int l = 0; l < count; ++l) ok[l] = ok[l] && closed[l];
  lanes.storeSteps(ok);
  for (int l = 0; l < count; ++l)
    if (ok[l]) static_cast<ReducedNode*>(nodes[l])->finishStep();
}

void ReducedNode::finishStep() {
  stepFreeJoints();
  for (Cluster& b : clusters_) {
    scatterConfiguration(model_, b.loop, b.next.basis().q, x_next_.head(model_.nq()));
    scatterVelocity(b.loop, b.v_next, x_next_.tail(model_.nv()));
  }
}

// What the values of residuals depend on.
void ReducedNode::showStep(int index) {
  takeWork();
  showView(work_->lanes.getView(index));
}

void ReducedNode::showView(LaneView& view) {
  shown_ = &view.ws;
  state_model_ = &view.state_cost;
  view.ws.q = q_;
  view.ws.v = v_;
  view.ws.X_WB = X_WB_;
  view.ws.stage = WorkspaceStage::Velocity;
}

// a_d = -J^+ gamma of the loops.
void ReducedNode::updateDriftAccelerations() {
  ReducedWork& work = *work_;
  updateDrift(model_, work.ws);
  work.a_d.setZero();
  for (Cluster& b : clusters_) {
    calcClusterDrift(getPlacedView(b.loop, work.ws), b.loop, b.at, b.work->rows, b.work->zeta);
    b.work->independent = b.work->zeta;
    applyPseudoInverse(b.loop, b.at, -1, b.work->independent, b.work->a);
    scatterVelocity(b.loop, b.work->a, work.a_d);
  }
}

void ReducedNode::addColumns(ConstMatrixRef A, Lift lift, MatrixRef out) const {
  if (lift == Lift::N)
    for (const FreeJoint& free : work_->free_joints) {
      const Joint& joint = model_.joints()[free.joint];
      for (int k = 0; k < joint.nv; ++k) out.row(free.offset + k) += A.col(joint.idx_v + k).transpose();
    }
  for (const Cluster& b : clusters_) {
    const MatrixXd& X = lift == Lift::N ? b.at.N : b.work->motion.Z;
    for (int c = 0; c < b.loop.size; ++c) {
      Eigen::Index i = 0;
      const auto addRows = [&](auto rows) {
        using Rows = Eigen::Array<double, rows, 1>;
        for (; i + rows <= A.rows(); i += rows) {
          Rows sum = Rows::Zero();
          for (size_t k = 0; k < b.loop.dofs.size(); ++k)
            sum += X(k, c) * Eigen::Map<const Rows>(&A.coeffRef(i, b.loop.dofs[k]));
          out.row(b.loop.offset + c).segment<rows>(i) += sum.matrix().transpose();
        }
      };
      addRows(std::integral_constant<int, 8>());
      addRows(std::integral_constant<int, 4>());
      addRows(std::integral_constant<int, 2>());
      addRows(std::integral_constant<int, 1>());
    }
  }
}

void ReducedNode::projectVector(const VectorXd& x, VectorXd& out) const {
  for (size_t i = 0; i < reduction_.free_joints.size(); ++i) {
    const Joint& joint = model_.joints()[reduction_.free_joints[i]];
    out.segment(reduction_.free_offsets[i], joint.nv) = x.segment(joint.idx_v, joint.nv);
  }
  for (const Cluster& b : clusters_)
    for (int c = 0; c < b.loop.size; ++c) {
      double sum = 0;
      for (size_t k = 0; k < b.loop.dofs.size(); ++k) sum += b.at.N(k, c) * x[b.loop.dofs[k]];
      out[b.loop.offset + c] = sum;
    }
}

void ReducedNode::addFromReduced(const VectorXd& y, VectorXd& x) const {
  for (size_t i = 0; i < reduction_.free_joints.size(); ++i) {
    const Joint& joint = model_.joints()[reduction_.free_joints[i]];
    x.segment(joint.idx_v, joint.nv) += y.segment(reduction_.free_offsets[i], joint.nv);
  }
  for (const Cluster& b : clusters_)
    for (size_t k = 0; k < b.loop.dofs.size(); ++k)
      x[b.loop.dofs[k]] += b.at.N.row(k).dot(y.segment(b.loop.offset, b.loop.size));
}

// J_c N and gamma_c + J_c a_d; the accelerations of the workspace are those of a_d.
void ReducedNode::updateContacts() {
  ReducedWork& work = *work_;
  const ConstraintSet& set = spec_.constraints;
  VectorXd& gamma = work.contacts.at(contact_rows_).gamma;
  MatrixXd& JcN = work.contacts.at(contact_rows_).JcN;
  JcN.setZero();
  for (size_t c = num_loops_; c < set.closures.size(); ++c) {
    const Closure& contact = set.closures[c];
    const int row = set.offsets[c] - loop_rows_, n = getRows(contact.kind);
    gamma.segment(row, n) = calcClosureAcceleration(work.ws, contact) + calcClosureStabilization(work.ws, contact);
    const SE3 X_WF = getPlacement(work.ws, contact.body1, contact.X_B1);
    const ReducedTree::Columns& tip = work.tree.getTip(pool_->sizes().slots[contact_slots_[c - num_loops_]]);
    for (size_t o = 0; o < tip.outer.size(); ++o)
      JcN.col(tip.outer[o]).segment(row, n) = selectRows(contact, X_WF.actInvMotion(tip.J.col(o)));
  }
}

// robot_problem.h Eq. (3), where there are no loops.
void ReducedNode::stepFreeJoints() {
  const double h = spec_.dt;
  auto w = x_next_.tail(model_.nv());
  w = v_ + h * a_;
  for (int i : reduction_.free_joints) {
    const Joint& joint = model_.joints()[i];
    const JointVector d = h * w.segment(joint.idx_v, joint.nv);
    integrateJoint(joint, q_.segment(joint.idx_q, joint.nq), d, x_next_.segment(joint.idx_q, joint.nq));
  }
}

// The same for the loops; x_next_ holds w already.
bool ReducedNode::closeStep(const ReducedNode* previous) {
  const int nq = model_.nq(), nv = model_.nv();
  const double h = spec_.dt;
  for (Cluster& b : clusters_) {
    ClusterWork& work = *b.work;
    gatherVelocity(b.loop, x_next_.tail(nv), work.d);
    work.d *= h;
    // To second order the closures open by h^2/2 gamma along h w: J J^T zeta = h^2/2 gamma, with the zeta of close().
    // What that lacked in the step before, it will lack again.
    work.zeta = b.surplus = (0.5 * h * h) * work.independent;
    if (previous) work.zeta += previous->clusters_[&b - clusters_.data()].surplus;
    if (!b.next.close(b.loop, work.scratch, b.at, work.d, work.zeta)) return fail(b, b.next);
    b.surplus = b.next.zeta() - b.surplus;
    const ClusterBasis& next = b.next.basis();
    // (I - J'^+ J') w' = N' (W N')^T w'
    work.target.setZero();
    addSmallProductTransposed(next.WN, b.next.step(), work.target, 1 / h);
    b.v_next.setZero();
    addSmallProduct(next.N, work.target, b.v_next);
    scatterConfiguration(model_, b.loop, next.q, x_next_.head(nq));
    scatterVelocity(b.loop, b.v_next, x_next_.tail(nv));
  }
  return true;
}

}  // namespace bielle
