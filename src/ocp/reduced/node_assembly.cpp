#include "ocp/reduced/node_assembly.h"

#include <algorithm>

#include "model/joint.h"

namespace bielle {

NodeAssembly::NodeAssembly(const Model& model, const Reduction& reduction, const ReducedLayout& layout,
                           int most_residuals)
    : model_(model), reduction_(reduction), layout_(layout) {
  const int nv = model.nv(), nr = reduction.size, nu = model.nu();
  for (size_t i = 0; i < reduction.free_joints.size(); ++i) {
    const Joint& joint = model.joints()[reduction.free_joints[i]];
    free_joints_.push_back({&joint, reduction.free_offsets[i], joint.nv, isCurved(joint), {}, {}});
  }
  for (const bielle::Motor& motor : model.motors()) {
    for (const FreeJoint& free : free_joints_)
      if (free.joint == &model.joints()[motor.joint])
        motors_.push_back({-1, free.offset + motor.dof - free.joint->idx_v});
    for (size_t i = 0; i < reduction.clusters.size(); ++i) {
      const std::vector<int>& dofs = reduction.clusters[i].dofs;
      const auto dof = std::find(dofs.begin(), dofs.end(), motor.dof);
      if (dof != dofs.end()) motors_.push_back({static_cast<int>(i), static_cast<int>(dof - dofs.begin())});
    }
  }
  const Eigen::Index rows = roundUpToLane(most_residuals), padded = roundUpToLane(2 * nr + nu);
  for (MatrixXd* m : {&jacobians_.q, &jacobians_.v}) m->setZero(rows, nv);
  jacobians_.lambda.setZero(rows, layout.most_constraint_rows);
  jacobians_.u.setZero(rows, nu);
  for (VectorXd* v : {&weights_.gradient, &weights_.hessian}) v->setZero(most_residuals);
  for (VectorXd* x : {&Rt_, &Rt_scaled_}) x->setZero(padded * most_residuals);
  gradient_.setZero(2 * nr + nu);
  dlambda_.setZero(padded * layout.most_contact_rows);
}

// The columns of dv = dy_v + h dy' from the dynamics, then the effect of dv and dy on the step.
void NodeAssembly::setStep(double h, const ContactLayout& contacts, const ReducedEvaluation& at,
                           const ReducedEvaluation& next, LaneView& view, StageModel& out) {
  const int nr = reduction_.size, nu = model_.nu();
  PaddedMap dydd = shapePadded(view.dydd, nu + 2 * nr, nr);
  dydd.topRows(nu).setZero();
  addMotorRows(at, dydd);
  setContactDerivatives(contacts, view);
  solveDerivatives(at.factors, dydd, shapePadded(dlambda_, nu + 2 * nr, contacts.rows), room_);
  for (size_t i = 0; i < reduction_.clusters.size(); ++i) {
    const ReducedCluster& cluster = reduction_.clusters[i];
    out.gap.segment(cluster.offset, cluster.size) = view.clusters[i].gap;
    out.gap.segment(nr + cluster.offset, cluster.size) = view.clusters[i].gap_v;
  }
  calcFreeGaps(at, next, out.gap);
  for (FreeJoint& free : free_joints_)
    if (free.curved) updateFreeJoint(h, at, out.gap, free);
  dydd *= h;
  dydd.bottomRows(nr).diagonal().array() += 1;
  setTransition(h, view, dydd, out);
}

// The first nu rows of dydd (x size) -= (N^T B)^T
void NodeAssembly::addMotorRows(const ReducedEvaluation& at, PaddedMap dydd) const {
  for (size_t m = 0; m < motors_.size(); ++m) {
    const auto& [index, row] = motors_[m];
    if (index < 0) {
      dydd(m, row) -= 1;
    } else {
      const ReducedCluster& cluster = reduction_.clusters[index];
      dydd.row(m).segment(cluster.offset, cluster.size) -= at.clusters[index].at.N.row(row);
    }
  }
}

// Sets the right-hand sides of the contact rows.
void NodeAssembly::setContactDerivatives(const ContactLayout& contacts, const LaneView& view) {
  const int nr = reduction_.size, nu = model_.nu();
  PaddedMap dlambda = shapePadded(dlambda_, nu + 2 * nr, contacts.rows);
  dlambda.setZero();
  clearPadding(dlambda);
  for (const ContactLayout::Contact& contact : contacts.contacts) {
    const LaneView::Contact& columns = view.contacts[contact.slot];
    const std::vector<int>& outer = layout_.outers[layout_.slots[contact.slot]];
    for (size_t o = 0; o < outer.size(); ++o) {
      dlambda.row(nu + outer[o]).segment(contact.row, contact.rows) = columns.dy.col(o).head(contact.rows).transpose();
      dlambda.row(nu + nr + outer[o]).segment(contact.row, contact.rows) =
          columns.dv.col(o).head(contact.rows).transpose();
    }
  }
}

void NodeAssembly::calcFreeGaps(const ReducedEvaluation& at, const ReducedEvaluation& next, VectorXd& gap) const {
  const int nq = model_.nq(), nr = reduction_.size;
  for (const FreeJoint& free : free_joints_) {
    const Joint& joint = *free.joint;
    const int k = nq + joint.idx_v;
    calcJointDifference(joint, next.x.segment(joint.idx_q, joint.nq), at.x_next.segment(joint.idx_q, joint.nq),
                        gap.segment(free.offset, free.size));
    gap.segment(nr + free.offset, free.size) = at.x_next.segment(k, free.size) - next.x.segment(k, free.size);
  }
}

// reduced_kernel.h Eq. (g) for a curved joint outside all clusters, where N = 1 and J^T vanishes.
void NodeAssembly::updateFreeJoint(double h, const ReducedEvaluation& at, const VectorXd& gap, FreeJoint& free) const {
  const Joint& joint = *free.joint;
  const int n = free.size;
  JointMatrix Jq(n, n), Jd(n, n), Jdiff(n, n);
  const JointVector d = h * at.x_next.segment(model_.nq() + joint.idx_v, n), open = gap.segment(free.offset, n);
  calcJointIntegrateJacobians(joint, d, Jq, Jd);
  free.q_y = Jq;
  free.q_v = h * Jd;
  if (open.isZero(0)) return;
  calcJointDifferenceJacobian(joint, open, Jdiff);
  free.q_y = Jdiff.lazyProduct(Jq);
  free.q_v = h * Jdiff.lazyProduct(Jd);
}

// Columns of F^T, from those of dv and the derivatives of each reduced joint with respect to dv and dy.
void NodeAssembly::setTransition(double h, const LaneView& view, PaddedMap dv, StageModel& out) const {
  const Eigen::Index nr = reduction_.size, nu = model_.nu();
  MatrixMap Ft = out.Ft();
  const auto multiply = [&](const auto& derivative, Eigen::Index from, Eigen::Index to) {
    const Eigen::Index n = derivative.rows();
    setProduct(dv.rows(), n, n, pad(dv, 0, from), {derivative.data(), derivative.outerStride(), 1}, pad(Ft, 0, to));
  };
  const auto add = [&](const auto& derivative, Eigen::Index from, Eigen::Index to) {
    const Eigen::Index n = derivative.rows();
    for (Eigen::Index i = 0; i < n; ++i)
      for (Eigen::Index k = 0; k < n; ++k) Ft(nu + from + k, to + i) += derivative(i, k);
  };
  for (const FreeJoint& free : free_joints_) {
    const Eigen::Index o = free.offset, n = free.size;
    Ft.middleCols(nr + o, n) = dv.middleCols(o, n);
    if (free.curved) {
      multiply(free.q_v, o, o);
      add(free.q_y, o, o);
    } else {
      Ft.middleCols(o, n) = h * dv.middleCols(o, n);
      Ft.block(nu + o, o, n, n).diagonal().array() += 1;
    }
  }
  for (size_t i = 0; i < reduction_.clusters.size(); ++i) {
    const LaneView::Cluster& c = view.clusters[i];
    const Eigen::Index o = reduction_.clusters[i].offset;
    multiply(c.q_v, o, o);
    multiply(c.v_v, o, nr + o);
    add(c.q_y, o, o);
    add(c.v_y, o, nr + o);
  }
}

void NodeAssembly::setImpulseDerivatives(ConstMatrixRef by_q, ConstMatrixRef by_v, const ReducedEvaluation& at,
                                         const LaneView& view) {
  const int nr = reduction_.size, nu = model_.nu();
  PaddedMap dlambda = shapePadded(dlambda_, nu + 2 * nr, by_q.rows());
  dlambda.setZero();
  addTimesN(by_q, at, dlambda.middleRows(nu, nr));
  addTimesZ(by_v, view, dlambda.middleRows(nu, nr));
  addTimesN(by_v, at, dlambda.middleRows(nu + nr, nr));
}

namespace {

// out += (A X)^T for the dofs of a cluster.
void addClusterColumns(const ReducedCluster& cluster, ConstMatrixRef A, const MatrixXd& X, MatrixRef out) {
  for (int c = 0; c < cluster.size; ++c) {
    Eigen::Index i = 0;
    const auto addRows = [&](auto rows) {
      using Rows = Eigen::Array<double, rows, 1>;
      for (; i + rows <= A.rows(); i += rows) {
        Rows sum = Rows::Zero();
        for (size_t k = 0; k < cluster.dofs.size(); ++k)
          sum += X(k, c) * Eigen::Map<const Rows>(&A.coeffRef(i, cluster.dofs[k]));
        out.row(cluster.offset + c).segment<rows>(i) += sum.matrix().transpose();
      }
    };
    addRows(std::integral_constant<int, 8>());
    addRows(std::integral_constant<int, 4>());
    addRows(std::integral_constant<int, 2>());
    addRows(std::integral_constant<int, 1>());
  }
}

}  // namespace

void NodeAssembly::addTimesN(ConstMatrixRef A, const ReducedEvaluation& at, MatrixRef out) const {
  for (const FreeJoint& free : free_joints_)
    for (int k = 0; k < free.size; ++k) out.row(free.offset + k) += A.col(free.joint->idx_v + k).transpose();
  for (size_t i = 0; i < at.clusters.size(); ++i)
    addClusterColumns(reduction_.clusters[i], A, at.clusters[i].at.N, out);
}

void NodeAssembly::addTimesZ(ConstMatrixRef A, const LaneView& view, MatrixRef out) const {
  for (size_t i = 0; i < view.clusters.size(); ++i)
    addClusterColumns(reduction_.clusters[i], A, view.clusters[i].Z, out);
}

// With Rt = (dr/d(u, dy, dy_v))^T, one column per residual, Rt diag(hessian) Rt^T is the whole Hessian.
void NodeAssembly::setResiduals(const NodeCosts& costs, const StageSpec& spec, const ContactLayout& contacts,
                                const ConstraintWeights* constraints, const ReducedEvaluation& at, const LaneView& view,
                                StageModel& out) {
  const int nr = reduction_.size, nu = static_cast<int>(at.u.size()), columns = nu + 2 * nr, rows = costs.rows();
  if (rows == 0) {
    for (VectorXd* gradient : {&out.lx, &out.lu}) gradient->setZero();
    out.hessian().setZero();
    return;
  }
  // Clears the residuals of the last node, in full lanes: the memory is padded.
  for (Eigen::Index i = 0; i < costs.motionRows(); i += kLane) {
    jacobians_.q.middleRows<kLane>(i).setZero();
    jacobians_.v.middleRows<kLane>(i).setZero();
  }
  for (Eigen::Index i = 0; i < rows; i += kLane) {
    jacobians_.lambda.middleRows<kLane>(i).middleCols(contacts.closure_rows, contacts.rows).setZero();
    if (costs.needsControls()) jacobians_.u.middleRows<kLane>(i).setZero();
  }
  costs.differentiate({model_, view.ws, spec.constraints, at.u, at.lambda}, at, constraints, weights_, jacobians_);
  PaddedMap Rt = shapePadded(Rt_, columns, rows), scaled = shapePadded(Rt_scaled_, columns, rows);
  updateResidualDerivatives(costs, contacts, at, view, Rt);
  auto gradient = gradient_.head(columns);
  gradient.setZero();
  int counting = 0;  // rows so far with a non-zero weight
  for (int i = 0; i < rows; ++i) {
    if (!weights_.counts(i)) continue;
    gradient += weights_.gradient[i] * Rt.col(i);
    if (counting < i) Rt.col(counting) = Rt.col(i);
    scaled.col(counting++) = weights_.hessian[i] * Rt.col(i);
  }
  clearPadding(shapePadded(Rt_, columns, counting));
  clearPadding(shapePadded(Rt_scaled_, columns, counting));
  setLowerProduct(counting, pad(scaled), pad(Rt), out.hessian());
  out.lu = gradient.head(nu);
  out.lx = gradient.tail(2 * nr);
}

void NodeAssembly::updateResidualDerivatives(const NodeCosts& costs, const ContactLayout& contacts,
                                             const ReducedEvaluation& at, const LaneView& view, PaddedMap Rt) {
  const int nr = reduction_.size, nu = static_cast<int>(at.u.size()), motion_rows = costs.motionRows();
  Rt.setZero();
  const auto q = jacobians_.q.topRows(motion_rows), v = jacobians_.v.topRows(motion_rows);
  addTimesN(q, at, Rt.block(nu, 0, nr, motion_rows));
  addTimesZ(v, view, Rt.block(nu, 0, nr, motion_rows));
  addTimesN(v, at, Rt.block(nu + nr, 0, nr, motion_rows));
  if (costs.needsControls()) Rt.topRows(nu) = jacobians_.u.topLeftCorner(costs.rows(), nu).transpose();
  if (nu == 0 || contacts.rows == 0) return;
  const PaddedMap by_forces = shapePadded(dlambda_, nu + 2 * nr, contacts.rows);
  for (int i = 0; i < costs.rows(); ++i) {
    if (!weights_.counts(i)) continue;
    for (int j = 0; j < contacts.rows; ++j) {
      const double factor = jacobians_.lambda(i, contacts.closure_rows + j);
      if (factor != 0) Rt.col(i) += factor * by_forces.col(j);
    }
  }
}

}  // namespace bielle
