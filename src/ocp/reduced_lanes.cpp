#include "reduced_lanes.h"

#include <algorithm>

#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/rnea.h"
#include "reduced_node.h"

namespace bielle {
namespace {

using JointMatrixLanes = Eigen::Matrix<Lanes, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, 6, 6>;

// Jacobians of q (+) d with respect to q, and of the difference d with respect to its end: node by node but for the one
// kind that loops are full of.
struct StepJacobians {
  JointMatrixLanes q, difference;
};
StepJacobians calcStepJacobians(const Joint& joint, const VectorUpTo6<Lanes>& d) {
  if (joint.kind == JointKind::Spherical) {
    const Vector3<Lanes> w = d;
    return {exp3(w).transpose(), calcRightJacobianInverse3(w)};
  }
  const int n = joint.nv;
  StepJacobians out{JointMatrixLanes(n, n), JointMatrixLanes(n, n)};
  JointMatrix q(n, n), step(n, n), difference(n, n);
  JointVector one(n);
  for (Eigen::Index l = 0; l < kLane; ++l) {
    unpackLane(d.data(), l, n, one.data());
    calcJointIntegrateJacobians(joint, one, q, step);
    calcJointDifferenceJacobian(joint, one, difference);
    for (int c = 0; c < n; ++c)
      for (int r = 0; r < n; ++r) {
        out.q(r, c).set(l, q(r, c));
        out.difference(r, c).set(l, difference(r, c));
      }
  }
  return out;
}

// Placements as the numbers they are made of.
static_assert(sizeof(SE3) == 12 * sizeof(double) && sizeof(SE3Of<Lanes>) == 12 * sizeof(Lanes));
const double* getNumbers(const SE3& X) { return X.R.data(); }
Lanes* getNumbers(SE3Of<Lanes>& X) { return X.R.data(); }

}  // namespace

BlockLanes::BlockLanes(const LoopBlock& l)
    : loop(l), at(l), next(l), own(l.model), motion(l), ahead(l), scratch(l), closing(l) {
  const int n = l.model.nv(), r = l.size, rank = l.rank;
  target.setZero(r);
  for (VectorX<Lanes>* x : {&left, &step, &a_d, &v_next}) x->setZero(n);
  for (VectorX<Lanes>* x : {&zeta, &independent, &drift, &predicted, &surplus}) x->setZero(rank);
  rows.setZero(l.closures.rows);
  for (MatrixX<Lanes>* x : {&HN, &HnNn, &JqN, &P, &Pn}) x->setZero(n, r);
  for (MatrixX<Lanes>* x : {&E, &En, &S, &mixed, &mixed_next}) x->setZero(r, r);
}

ReducedLanes::ReducedLanes(const Model& model, const Reduction& reduction, const std::vector<int>& tips,
                           const std::vector<int>& slots)
    : model_(model), reduction_(reduction), tips_(tips), ws_(model), tree_(model, reduction, tips) {
  blocks_.reserve(reduction.blocks.size());  // lifts point into them
  for (const LoopBlock& block : reduction.blocks) {
    blocks_.emplace_back(block);
    lifts_.push_back({&blocks_.back().motion, &blocks_.back().HN});
  }
  for (int tip : slots) {
    ContactLanes contact;
    contact.tip = tip;
    for (Matrix6X<Lanes>* x : {&contact.dy, &contact.dv, &contact.J}) x->setZero(6, tree_.getTip(tip).outer.size());
    contacts_.push_back(contact);
  }
  for (size_t i = 0; i < reduction.free_joints.size(); ++i) {
    const Joint& joint = model.joints()[reduction.free_joints[i]];
    free_.push_back({joint.idx_v, reduction.free_offsets[i], joint.nv});
  }
  nodes_.reserve(kLane);
  f_ext_.assign(model.numBodies(), Vector6<Lanes>::Zero());
  for (VectorX<Lanes>* x : {&v_, &a_, &tau_}) x->setZero(model.nv());
  for (MatrixX<Lanes>* x : {&A_y_, &A_v_, &M_}) x->setZero(reduction.size, reduction.size);
  for (VectorX<Lanes>* x : {&f_, &ydd_}) x->setZero(reduction.size);
}

int ReducedLanes::findLane(const ReducedNode* node) const {
  const auto found = std::find(nodes_.begin(), nodes_.end(), node);
  return found == nodes_.end() ? -1 : static_cast<int>(found - nodes_.begin());
}

void ReducedLanes::setNodes(NodeModel* const* nodes, int count) {
  nodes_.clear();
  for (int l = 0; l < count; ++l) nodes_.push_back(static_cast<const ReducedNode*>(nodes[l]));
  packNodes();
}

void ReducedLanes::linearize(NodeModel* const* nodes, int count) {
  using Node = const ReducedNode&;
  setNodes(nodes, count);
  pack([](Node n) { return n.a_.data(); }, a_.size(), a_.data());
  for (size_t i = 0; i < blocks_.size(); ++i) packBlock(i);
  updateColumns(model_, ws_);
  updateVelocities(model_, ws_, v_);
  updateAccelerations(model_, ws_, a_);
  for (BlockLanes& b : blocks_) {
    const auto view = getPlacedView(b.loop, ws_);
    updateTwists(view, b.at, b.motion);
    updateVelocityLift(view, b.motion);
    updateAccelerationLift(view, b.motion);
  }
  updateForces();
  tree_.updateDerivatives(ws_, lifts_, A_y_, A_v_);
  for (ContactLanes& contact : contacts_)
    if (contact.used) updateContact(contact);
  for (BlockLanes& b : blocks_) linearizeStep(b);
}

// `get` says where the numbers of a node are; lanes without a node do what the first one does.
template <typename Get>
void ReducedLanes::pack(const Get& get, Eigen::Index size, Lanes* out) const {
  std::array<const double*, kLane> in;
  for (size_t l = 0; l < kLane; ++l) in[l] = get(*nodes_[l < nodes_.size() ? l : 0]);
  packLanes(in, size, out);
}

void ReducedLanes::packNodes() {
  using Node = const ReducedNode&;
  pack([](Node n) { return getNumbers(n.X_WB_.front()); }, 12 * model_.numBodies(), getNumbers(ws_.X_WB.front()));
  ws_.stage = WorkspaceStage::Placement;
  pack([](Node n) { return n.v_.data(); }, v_.size(), v_.data());
  pack([](Node n) { return n.tau_.data(); }, tau_.size(), tau_.data());
  pack([](Node n) { return &n.spec_.dt; }, 1, &h_);
  for (size_t i = 0; i < blocks_.size(); ++i)
    packBasis([&](Node n) -> const BlockBasis& { return n.blocks_[i].at; }, blocks_[i].at);
  for (size_t i = 0; i < contacts_.size(); ++i) packContact(i);
}

template <typename GetBasis>
void ReducedLanes::packBasis(const GetBasis& getBasis, BlockBasisOf<Lanes>& to) const {
  using Node = const ReducedNode&;
  pack([&](Node n) { return getBasis(n).N.data(); }, to.N.size(), to.N.data());
  pack([&](Node n) { return getBasis(n).WN.data(); }, to.WN.size(), to.WN.data());
  pack([&](Node n) { return getBasis(n).J.data(); }, to.J.size(), to.J.data());
  pack([&](Node n) { return getBasis(n).L.data(); }, to.L.size(), to.L.data());
  for (size_t k = 0; k < to.rows.size(); ++k)
    for (size_t l = 0; l < kLane; ++l) to.rows[k][l] = getBasis(*nodes_[l < nodes_.size() ? l : 0]).rows[k];
}

// What linearize() needs of the points ahead.
void ReducedLanes::packBlock(size_t i) {
  using Node = const ReducedNode&;
  BlockLanes& b = blocks_[i];
  packBasis([&](Node n) -> const BlockBasis& { return n.blocks_[i].next.basis(); }, b.next);
  pack([&](Node n) { return n.blocks_[i].next.zeta().data(); }, b.zeta.size(), b.zeta.data());
  pack([&](Node n) { return n.blocks_[i].next.step().data(); }, b.step.size(), b.step.data());
  pack([&](Node n) { return getNumbers(n.blocks_[i].next.placements().front()); }, 12 * b.loop.model.numBodies(),
       getNumbers(b.own.X_WB.front()));
  b.own.stage = WorkspaceStage::Placement;
}

// Nodes without this contact have no force there, and whatever its other numbers.
void ReducedLanes::packContact(size_t slot) {
  ContactLanes& contact = contacts_[slot];
  contact.used = false;
  contact.wrench.setZero();
  contact.kd = 0;
  contact.kp_rate.setZero();
  contact.kp_residual.setZero();
  for (size_t l = 0; l < nodes_.size(); ++l) {
    const ReducedNode& node = *nodes_[l];
    const int index = node.findContact(static_cast<int>(slot));
    if (index < 0) continue;
    const Closure& closure = node.spec_.constraints.closures[index];
    const SE3 X_WF = node.X_WB_[closure.body1] * closure.X_B1;
    const VectorUpTo6<double> lambda =
        node.lambda_.segment(node.spec_.constraints.offsets[index], getRows(closure.kind));
    const Vector6d wrench = X_WF.actForce(expandRows(closure, lambda));
    for (int k = 0; k < 12; ++k) getNumbers(contact.X_WF)[k].set(l, getNumbers(X_WF)[k]);
    for (int k = 0; k < 6; ++k) contact.wrench[k].set(l, wrench[k]);
    contact.kd.set(l, closure.kd);
    contact.used = true;
    if (closure.kp == 0) continue;
    const SE3 X_12 = X_WF.inverseTimes(closure.X_B2);
    const RowVectorUpTo6 residual = closure.kp * calcClosureResidual(closure, X_12);
    const RowsBy6 rate = closure.kp * calcClosureResidualRate(closure, X_12);
    for (int r = 0; r < residual.size(); ++r) contact.kp_residual[r].set(l, residual[r]);
    for (int c = 0; c < 6; ++c)
      for (int r = 0; r < rate.rows(); ++r) contact.kp_rate(r, c).set(l, rate(r, c));
  }
}

void ReducedLanes::packBlockStep(size_t i) {
  using Node = const ReducedNode&;
  BlockLanes& b = blocks_[i];
  pack([&](Node n) { return n.blocks_[i].at.q.data(); }, b.at.q.size(), b.at.q.data());
  for (size_t l = 0; l < kLane; ++l) {
    const ReducedNode* before = nodes_[l < nodes_.size() ? l : 0]->before_;
    for (Eigen::Index k = 0; k < b.surplus.size(); ++k) b.surplus[k].set(l, before ? before->blocks_[i].surplus[k] : 0);
  }
}

void ReducedLanes::startSteps(NodeModel* const* nodes, int count) {
  setNodes(nodes, count);
  for (size_t i = 0; i < blocks_.size(); ++i) packBlockStep(i);
  updateColumns(model_, ws_);
  updateVelocities(model_, ws_, v_);
  updateCompositeInertias(model_, ws_);
  updateDrift(model_, ws_);
  a_.setZero();  // here a_d
  for (BlockLanes& b : blocks_) {
    const auto view = getPlacedView(b.loop, ws_);
    calcBlockDrift<Lanes>(view, b.loop, b.at, b.rows, b.drift);
    b.independent = b.drift;
    applyPseudoInverse<Lanes>(b.loop, b.at, -1, b.independent, b.a_d);
    for (size_t k = 0; k < b.loop.dofs.size(); ++k) a_[b.loop.dofs[k]] = b.a_d[k];
    updateTwists(view, b.at, b.motion);
  }
  updateInverseDynamics(model_, ws_, a_);
  for (const FreeDofs& free : free_)
    for (int k = 0; k < free.size; ++k) f_[free.offset + k] = tau_[free.dof + k] - ws_.b[free.dof + k];
  for (BlockLanes& b : blocks_) {
    for (size_t k = 0; k < b.loop.dofs.size(); ++k) b.left[k] = tau_[b.loop.dofs[k]] - ws_.b[b.loop.dofs[k]];
    auto f = f_.segment(b.loop.offset, b.loop.size);
    f.setZero();
    addSmallProductTransposed(b.at.N, b.left, f);
  }
  tree_.updateMassMatrix(ws_, lifts_, M_);
  for (ContactLanes& contact : contacts_)
    if (contact.used) updateContactRows(contact);
}

// J_c N and gamma_c + J_c a_d; the accelerations of the workspace are those of a_d.
void ReducedLanes::updateContactRows(ContactLanes& contact) {
  const auto& tip = tree_.getTip(contact.tip);
  const int body = tips_[contact.tip];
  contact.gamma = contact.X_WF.actInvMotion(ws_.A[body] - ws_.A[0] + contact.kd * ws_.V[body]) - contact.kp_residual;
  for (size_t o = 0; o < tip.outer.size(); ++o) contact.J.col(o) = contact.X_WF.actInvMotion(tip.J.col(o));
}

void ReducedLanes::loadSystem(int lane, MatrixXd& M, MatrixXd& JcN, VectorXd& f, VectorXd& gamma) const {
  const ReducedNode& node = *nodes_[lane];
  const ConstraintSet& set = node.spec_.constraints;
  unpackLane(M_.data(), lane, M_.size(), M.data());
  unpackLane(f_.data(), lane, f_.size(), f.data());
  JcN.setZero();
  for (size_t c = set.num_loops; c < set.closures.size(); ++c) {
    const ContactLanes& contact = contacts_[node.contact_slots_[c - set.num_loops]];
    const std::vector<int>& outer = getOuter(contact);
    const int row = set.offsets[c] - node.loop_rows_, n = getRows(set.closures[c].kind);
    Vector6d full;
    unpackLane(contact.gamma.data(), lane, 6, full.data());
    gamma.segment(row, n) = selectRows(set.closures[c], full);
    for (size_t o = 0; o < outer.size(); ++o) {
      unpackLane(&contact.J(0, o), lane, 6, full.data());
      JcN.col(outer[o]).segment(row, n) = selectRows(set.closures[c], full);
    }
  }
}

void ReducedLanes::storeAccelerations(int lane, const VectorXd& ydd) {
  for (Eigen::Index k = 0; k < ydd.size(); ++k) ydd_[k].set(lane, ydd[k]);
}

// robot_problem.h Eq. (3). Lanes without a node are left to themselves.
LaneMask ReducedLanes::finishSteps() {
  for (Eigen::Index k = 0; k < ydd_.size(); ++k)
    for (Eigen::Index l = nodes_.size(); l < kLane; ++l) ydd_[k].set(l, ydd_[k][0]);
  for (const FreeDofs& free : free_)
    for (int k = 0; k < free.size; ++k) a_[free.dof + k] += ydd_[free.offset + k];
  LaneMask closed = Lanes(0) <= Lanes(0);
  for (BlockLanes& b : blocks_) closed = closed && close(b);
  return closed;
}

LaneMask ReducedLanes::close(BlockLanes& b) {
  const auto ydd = ydd_.segment(b.loop.offset, b.loop.size);
  addSmallProduct(b.at.N, ydd, b.a_d);  // now a
  for (size_t k = 0; k < b.loop.dofs.size(); ++k) {
    const int dof = b.loop.dofs[k];
    a_[dof] = b.a_d[k];
    b.step[k] = h_ * (v_[dof] + h_ * a_[dof]);
  }
  // To second order the closures open by h^2/2 gamma along h w: J J^T zeta = h^2/2 gamma, with the zeta of close(). What that
  // lacked in the step before, it will lack again.
  b.predicted = b.independent * (0.5 * h_ * h_);
  b.zeta = b.predicted + b.surplus;
  const LaneMask closed = b.closing.close(b.loop, b.scratch, b.at, b.step, b.zeta);
  b.surplus = b.closing.zeta() - b.predicted;
  // (I - J'^+ J') w' = N' (W N')^T w'
  const BlockBasisOf<Lanes>& next = b.closing.basis();
  b.target.setZero();
  addSmallProductTransposed(next.WN, b.closing.step(), b.target);
  b.target /= h_;
  b.v_next.setZero();
  addSmallProduct(next.N, b.target, b.v_next);
  return closed;
}

// H N of the loop forces, and the wrenches of the contacts on the bodies. The forces that the loops are left with are
// those through their joints.
void ReducedLanes::updateForces() {
  for (Vector6<Lanes>& f : f_ext_) f.setZero();
  for (const ContactLanes& contact : contacts_)
    if (contact.used) f_ext_[tips_[contact.tip]] += contact.wrench;
  updateInverseDynamicsFactors(model_, ws_, f_ext_);
  for (BlockLanes& b : blocks_) {
    for (size_t k = 0; k < b.loop.dofs.size(); ++k) {
      const int dof = b.loop.dofs[k];
      const Lanes left =
          ws_.J.col(dof).dot(ws_.F[model_.dofs()[dof].joint]) + model_.armature()[dof] * a_[dof] - tau_[dof];
      b.left[k] = b.loop.inverse_metric[k] * left;
    }
    b.independent.setZero();
    addSmallProduct(b.at.J, b.left, b.independent);
    solveGram(b.at, b.independent);
    expandIndependent(b.at, b.independent, b.rows);
    calcForceLift(getPlacedView(b.loop, ws_), b.motion, b.rows, b.HN);
  }
}

// Eq. (c)
void ReducedLanes::updateContact(ContactLanes& contact) {
  const auto& tip = tree_.getTip(contact.tip);
  const Vector6<Lanes>&V1 = ws_.V[tips_[contact.tip]], &A2 = ws_.A[0];
  for (size_t o = 0; o < tip.outer.size(); ++o) {
    const Vector6<Lanes> J = tip.J.col(o), dV = tip.dV.col(o);
    const Vector6<Lanes> dq = tip.dA.col(o) - crossMotion(V1, dV) + crossMotion(J, A2) + contact.kd * dV;
    const Vector6<Lanes> dv = tip.dW.col(o) - crossMotion(V1, J) + contact.kd * J;
    contact.dy.col(o) = contact.X_WF.actInvMotion(dq) - contact.kp_rate * contact.X_WF.actInvMotion(J);
    contact.dv.col(o) = contact.X_WF.actInvMotion(dv);
  }
}

// The products of Eqs. (d) to (g).
void ReducedLanes::linearizeStep(BlockLanes& b) {
  b.independent = b.zeta / h_;  // close() moves by h w', so its zeta is h times that of Eq. (e)
  expandIndependent(b.at, b.independent, b.rows);
  calcForceLift(getPlacedView(b.loop, ws_), b.motion, b.rows, b.HN);
  updateColumns(b.loop.model, b.own);
  const auto ahead = getOwnView(b.loop, b.own);
  updateTwists(ahead, b.next, b.ahead);
  b.independent.setZero();  // mu
  addSmallProduct(b.next.J, b.step, b.independent);
  b.independent /= h_;
  solveGram(b.next, b.independent);
  expandIndependent(b.next, b.independent, b.rows);
  calcForceLift(ahead, b.ahead, b.rows, b.HnNn);

  // J_q N, J_d^{-T} W N and J_d^{-T} W N': the identity but for the blocks of curved joints.
  b.JqN = b.at.N;
  b.P = b.at.WN;
  b.Pn = b.next.WN;
  for (const Joint& joint : b.loop.model.joints()) {
    if (!isCurved(joint)) continue;
    const int i = joint.idx_v, n = joint.nv;
    const StepJacobians jacobians = calcStepJacobians(joint, b.step.segment(i, n));
    b.JqN.middleRows(i, n) = jacobians.q.lazyProduct(b.at.N.middleRows(i, n));
    b.P.middleRows(i, n) = jacobians.difference.transpose().lazyProduct(b.at.WN.middleRows(i, n));
    b.Pn.middleRows(i, n) = jacobians.difference.transpose().lazyProduct(b.next.WN.middleRows(i, n));
  }
  for (MatrixX<Lanes>* m : {&b.mixed, &b.mixed_next, &b.E, &b.En, &b.S}) m->setZero();
  addSmallProductTransposed(b.P, b.next.N, b.mixed);
  addSmallProductTransposed(b.Pn, b.next.N, b.mixed_next);
  addSmallProductTransposed(b.at.N, b.HN, b.E);
  b.E *= -h_;
  addSmallProductTransposed(b.P, b.JqN, b.E);
  addSmallProductTransposed(b.Pn, b.JqN, b.En);
  addSmallProductTransposed(b.next.N, b.HnNn, b.S);
}

}  // namespace bielle
