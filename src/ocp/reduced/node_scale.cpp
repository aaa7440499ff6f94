// Derivatives of a step by its time scale: reduced_kernel.h Eq. (i). The row of s is the last one before those of dy.
#include "model/joint.h"
#include "ocp/reduced/node_assembly.h"

namespace bielle {

// (W N)^T v, where W N is get_WN(cluster).
template <typename GetWN>
void NodeAssembly::project(const VectorXd& v, const GetWN& get_WN, VectorRef out) const {
  for (const FreeJoint& free : free_joints_)
    out.segment(free.offset, free.size) = v.segment(free.joint->idx_v, free.size);
  for (size_t i = 0; i < reduction_.clusters.size(); ++i) {
    const ReducedCluster& cluster = reduction_.clusters[i];
    const MatrixXd& WN = get_WN(i);
    auto y = out.segment(cluster.offset, cluster.size);
    y.setZero();
    for (size_t k = 0; k < cluster.dofs.size(); ++k) y += v[cluster.dofs[k]] * WN.row(k).transpose();
  }
}

// h y'_0 / (2 s)
void NodeAssembly::addForeseenScale(const ReducedEvaluation& at, PaddedMap foreseen) {
  const auto getWN = [&](size_t i) -> const MatrixXd& { return at.midpoint->clusters[i].basis.WN; };
  project(at.midpoint->a, getWN, y_);
  foreseen.row(at.leading - 1) += at.dt / (2 * at.time_scale) * y_.transpose();
}

// eta of the drift after the kick.
void NodeAssembly::addKickScale(const StageSpec& spec, const ReducedEvaluation& at, PaddedMap dv) {
  const bool midpoint = spec.step == StepRule::Midpoint;
  const auto getWN = [&](size_t i) -> const MatrixXd& {
    return midpoint ? at.midpoint->clusters[i].basis.WN : at.clusters[i].at.WN;
  };
  const double s = at.time_scale;
  auto row = dv.row(at.leading - 1);
  project(at.a, getWN, y_);
  row += 2 * at.dt / s * y_.transpose();
  if (midpoint) {
    project(at.midpoint->v, getWN, y_);
  } else {
    velocity_ = at.x.segment(model_.nq(), model_.nv());
    project(velocity_, getWN, y_);
  }
  row += y_.transpose() / s;
}

// (W N')^T v+ / s, about the node's state.
void NodeAssembly::subtractVelocity(const ReducedEvaluation& at, const ReducedEvaluation& next, MatrixMap Ft) {
  velocity_ = at.x_next.segment(model_.nq(), model_.nv());
  project(
      velocity_, [&](size_t i) -> const MatrixXd& { return next.clusters[i].at.WN; }, y_);
  Ft.row(at.leading - 1).tail(reduction_.size) -= y_.transpose() / at.time_scale;
}

// How the first drift moves the point half way with s. \param h  length of the drift
void NodeAssembly::updateFirstDriftScale(double h, const ReducedEvaluation& at, const LaneView& view) {
  velocity_ = at.x.segment(model_.nq(), model_.nv());
  project(
      velocity_, [&](size_t i) -> const MatrixXd& { return at.clusters[i].at.WN; }, y_);
  project(
      at.midpoint->v, [&](size_t i) -> const MatrixXd& { return at.midpoint->clusters[i].basis.WN; }, y_v_s_);
  y_ /= at.time_scale;                          // eta
  y_v_s_ /= -at.time_scale;                     // what its velocity loses
  for (const FreeJoint& free : free_joints_) {  // whose velocity the drift does not change
    const Eigen::Index n = free.size, o = free.offset;
    const JointVector eta = y_.segment(o, n);
    if (free.curved)
      y_s_.segment(o, n) = free.first_q_v.lazyProduct(eta);
    else
      y_s_.segment(o, n) = h * eta;
    y_v_s_.segment(o, n).setZero();
  }
  for (size_t i = 0; i < reduction_.clusters.size(); ++i) {
    const LaneView::Drift& drift = view.clusters[i].first;
    const Eigen::Index o = reduction_.clusters[i].offset, r = reduction_.clusters[i].size;
    y_s_.segment(o, r).noalias() = drift.q_v * y_.segment(o, r);
    y_v_s_.segment(o, r).noalias() += drift.v_v * y_.segment(o, r);
  }
}

}  // namespace bielle
