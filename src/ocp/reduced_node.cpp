// State space of reduced_node.h, and its memory.
#include <algorithm>
#include <cstring>

#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/rnea.h"
#include "bielle/math/lane_product.h"
#include "impact_nodes.h"

namespace bielle {

ClusterWork::ClusterWork(const ReducedCluster& l) : scratch(l), start(l), point(l), motion(l), ahead(l), gap(l) {
  const int n = l.model.nv(), r = l.size, rank = l.rank;
  q.setZero(l.model.nq());
  for (VectorXd* x : {&v, &a, &d}) x->setZero(n);
  for (VectorXd* x : {&independent, &zeta}) x->setZero(rank);
  rows.setZero(l.closures.rows);
  HN.setZero(n, r);
  mixed.setZero(r, r);
  target.setZero(r);
  mixed_pivots.resize(r);
}

template <typename T>
void placeWhole(const Model& model, const Reduction& reduction, typename ArgumentsOf<T>::ConstVector q,
                std::vector<SE3Of<T>>& X_WB) {
  for (int i = 1; i < model.numBodies(); ++i) {
    const ReducedJoint& reduced = reduction.joints[reduction.joint_of_body[i]];
    const Joint& joint = model.joints()[i];
    if (reduced.cluster >= 0) {
      X_WB[i] = X_WB[reduction.clusters[reduced.cluster].root] * X_WB[i];
    } else {
      const SE3Of<T> X_JB = calcJointPlacement<T>(joint, q.segment(joint.idx_q, joint.nq));
      X_WB[i] = X_WB[joint.parent] * joint.X_PJ * X_JB;
    }
  }
}
template void placeWhole(const Model&, const Reduction&, ConstVectorRef, std::vector<SE3>&);
template void placeWhole(const Model&, const Reduction&, ArgumentsOf<Lanes>::ConstVector, std::vector<SE3Of<Lanes>>&);

namespace {

int find(const std::vector<int>& list, int value) {
  return static_cast<int>(std::find(list.begin(), list.end(), value) - list.begin());
}

// The slots of the contacts of a stage: those of their bodies, one after the other.
std::vector<int> findSlots(const ConstraintSet& set, const std::vector<int>& tips, const std::vector<int>& slots) {
  std::vector<int> out;
  for (size_t c = set.num_loops; c < set.closures.size(); ++c) {
    int slot = find(slots, find(tips, set.closures[c].body1));
    while (std::find(out.begin(), out.end(), slot) != out.end()) ++slot;
    out.push_back(slot);
  }
  return out;
}

}  // namespace

ReducedSizes::ReducedSizes(const std::vector<StageSpec>& specs) {
  const auto add = [](int value, std::vector<int>& list) {
    if (find(list, value) == static_cast<int>(list.size())) list.push_back(value);
  };
  std::map<int, int> most;  // contacts of each body
  for (const StageSpec& spec : specs) {
    const ConstraintSet& set = spec.constraints;
    int loop_rows = 0;
    std::map<int, int> count;
    for (int c = 0; c < set.num_loops; ++c) loop_rows += getRows(set.closures[c].kind);
    for (size_t c = set.num_loops; c < set.closures.size(); ++c) {
      const int body = set.closures[c].body1;
      add(body, tips);
      most[body] = std::max(most[body], ++count[body]);
    }
    add(set.rows - loop_rows, contact_rows);
    rows = std::max(rows, set.rows - loop_rows);
    constraints = std::max(constraints, set.rows);
    residuals = std::max(residuals, countResidualRows(spec));
    if (spec.state.weight != 0) state_costs.insert(&spec.state);
  }
  for (size_t tip = 0; tip < tips.size(); ++tip) slots.insert(slots.end(), most[tips[tip]], static_cast<int>(tip));
}

bool StateCostOrder::operator()(const StateCost* a, const StateCost* b) const {
  const auto compare = [](const double* x, const double* y, Eigen::Index size) {
    return size == 0 ? 0 : std::memcmp(x, y, size * sizeof(double));
  };
  if (const int order = compare(&a->weight, &b->weight, 1)) return order < 0;
  for (VectorXd StateCost::*member : {&StateCost::q_ref, &StateCost::v_ref, &StateCost::weights}) {
    const VectorXd &x = a->*member, &y = b->*member;  // all of the same model
    if (const int order = compare(x.data(), y.data(), x.size())) return order < 0;
  }
  return false;
}

const StateCost* ReducedSizes::findStateCost(const StateCost& cost) const {
  return cost.weight == 0 ? nullptr : *state_costs.find(&cost);
}

ReducedWork::ReducedWork(const Model& model, const Reduction& reduction, const ReducedSizes& sizes)
    : ws(model),
      tree(model, reduction, sizes.tips),
      state_cost(model, reduction),
      lanes(model, reduction, sizes.tips, sizes.slots) {
  const int nv = model.nv(), nr = reduction.size, nu = model.nu();
  clusters.reserve(reduction.clusters.size());  // lifts point into them
  for (const ReducedCluster& cluster : reduction.clusters) {
    clusters.emplace_back(cluster);
    lifts.push_back({&clusters.back().motion, &clusters.back().HN});
  }
  for (size_t i = 0; i < reduction.free_joints.size(); ++i) {
    free_joints.emplace_back();
    free_joints.back().joint = reduction.free_joints[i];
    free_joints.back().offset = reduction.free_offsets[i];
    free_joints.back().size = model.joints()[reduction.free_joints[i]].nv;
    free_joints.back().curved = isCurved(model.joints()[reduction.free_joints[i]]);
  }
  for (int rows : sizes.contact_rows) {
    ContactWork& work = contacts[rows];
    work.saddle_point.resize(nr, rows);
    work.JcN.setZero(rows, nr);
    for (VectorXd* x : {&work.gamma, &work.lambda}) x->setZero(rows);
  }
  for (const bielle::Motor& motor : model.motors()) {
    const auto free = std::find(reduction.free_joints.begin(), reduction.free_joints.end(), motor.joint);
    if (free != reduction.free_joints.end())
      motors.push_back({-1, reduction.free_offsets[free - reduction.free_joints.begin()] + motor.dof -
                                model.joints()[motor.joint].idx_v});
    for (size_t i = 0; i < reduction.clusters.size(); ++i) {
      const int row = find(reduction.clusters[i].dofs, motor.dof);
      if (row < static_cast<int>(reduction.clusters[i].dofs.size())) motors.push_back({static_cast<int>(i), row});
    }
  }
  for (VectorXd* x : {&a_d, &force}) x->setZero(nv);
  for (VectorXd* x : {&f, &ydd}) x->setZero(nr);
  M.setZero(nr, nr);
  const Eigen::Index rows = roundUpToLane(sizes.residuals);
  for (MatrixXd* m : {&jacobians.q, &jacobians.v}) m->setZero(rows, nv);
  jacobians.lambda.setZero(rows, sizes.constraints);
  const Eigen::Index padded = roundUpToLane(2 * nr + nu);
  for (VectorXd* x : {&Rt, &Rt_scaled}) x->setZero(padded * sizes.residuals);
  gradient.setZero(2 * nr + nu);
  dlambda.setZero(padded * sizes.rows);
}

ReducedWork& ReducedWorkPool::get() {
  const std::lock_guard<std::mutex> lock(mutex_);
  std::unique_ptr<ReducedWork>& work = works_[std::this_thread::get_id()];
  if (!work) work = std::make_unique<ReducedWork>(model_, reduction_, sizes_);
  return *work;
}

ReducedNode::ReducedNode(const Model& model, const Reduction& reduction, const StageSpec& spec,
                         std::shared_ptr<ReducedWorkPool> pool)
    : NodeModel(model, spec), reduction_(reduction), pool_(std::move(pool)) {
  for (const ReducedCluster& cluster : reduction.clusters) clusters_.emplace_back(cluster);
  const int nv = model.nv(), nr = reduction.size;
  const ConstraintSet& set = spec.constraints;
  num_loops_ = set.num_loops;
  loop_rows_ = 0;
  for (int c = 0; c < num_loops_; ++c) loop_rows_ += getRows(set.closures[c].kind);
  contact_rows_ = set.rows - loop_rows_;
  contact_slots_ = findSlots(set, pool_->sizes().tips, pool_->sizes().slots);
  slot_rows_.assign(6 * pool_->sizes().slots.size(), -1);
  for (size_t c = num_loops_; c < set.closures.size(); ++c)
    for (int r = 0; r < getRows(set.closures[c].kind); ++r)
      slot_rows_[6 * contact_slots_[c - num_loops_] + r] = set.offsets[c] - loop_rows_ + r;
  X_WB_.resize(model.numBodies());
  q_.setZero(model.nq());
  for (VectorXd* v : {&v_, &tau_, &a_, &state_difference_}) v->setZero(nv);
  state_cost_ = pool_->sizes().findStateCost(spec.state);
  factors_.resize(nr, contact_rows_);
  chart_x_.setConstant(model.nq() + nv, std::numeric_limits<double>::quiet_NaN());
}

void ReducedNode::takeWork() {
  work_ = &pool_->get();
  for (size_t i = 0; i < clusters_.size(); ++i) clusters_[i].work = &work_->clusters[i];
}

void ReducedNode::integrate(ConstVectorRef x, ConstVectorRef dx, VectorRef x_out) {
  takeWork();
  const int nq = model_.nq(), nr = reduction_.size;
  const bool linearized = chart_x_ == x;  // here, and so the bases may still be there
  for (size_t i = 0; i < reduction_.free_joints.size(); ++i) {
    const Joint& joint = model_.joints()[reduction_.free_joints[i]];
    const int at = reduction_.free_offsets[i], n = joint.nv;
    JointVector d = dx.segment(at, n);
    integrateJoint(joint, x.segment(joint.idx_q, joint.nq), d, x_out.segment(joint.idx_q, joint.nq));
    x_out.segment(nq + joint.idx_v, n) = x.segment(nq + joint.idx_v, n) + dx.segment(nr + at, n);
  }
  for (Cluster& b : clusters_) {
    const ReducedCluster& loop = b.loop;
    ClusterWork& work = *b.work;
    gatherConfiguration(model_, loop, x.head(nq), work.q);
    const bool known = linearized && b.at.q == work.q;
    if (!known && !work.start.update(loop, work.scratch, work.q)) {
      fail(b, work.start);
      x_out.setConstant(std::numeric_limits<double>::quiet_NaN());
      return;
    }
    const ClusterBasis &from = known ? b.at : work.start.basis(), &to = work.point.basis();
    work.d.noalias() = from.N * dx.segment(loop.offset, loop.size);
    if (!work.point.close(loop, work.scratch, from, work.d, {})) {
      fail(b, work.point);
      x_out.setConstant(std::numeric_limits<double>::quiet_NaN());
      return;
    }
    // The velocity at the new point whose coordinates about the old one are N^T v + dy_v.
    gatherVelocity(loop, x.tail(model_.nv()), work.v);
    work.target = dx.segment(nr + loop.offset, loop.size);
    addSmallProductTransposed(from.WN, work.v, work.target);
    work.mixed.setZero();
    addSmallProductTransposed(from.WN, to.N, work.mixed);
    if (!factorizeSmall(work.mixed, work.mixed_pivots)) {
      failure_ = "closure '" + loop.closures.closures.front().name + "': the step turns its loops too far";
      x_out.setConstant(std::numeric_limits<double>::quiet_NaN());
      return;
    }
    solveFactorized(work.mixed, work.mixed_pivots, work.target);
    work.v.noalias() = to.N * work.target;
    scatterConfiguration(model_, loop, to.q, x_out.head(nq));
    scatterVelocity(loop, work.v, x_out.tail(model_.nv()));
  }
}

// In lanes, where the bases are at hand.
void ReducedNode::integrateNodes(const Integration* items, int count) {
  takeWork();
  std::array<Integration, kLane> together;
  int num = 0;
  for (int i = 0; i < count; ++i) {
    ReducedNode& node = *static_cast<ReducedNode*>(items[i].node);
    if (node.isKnown(*items[i].x))
      together[num++] = items[i];
    else
      node.integrate(*items[i].x, *items[i].dx, *items[i].x_out);
  }
  if (num == 0) return;
  const LaneMask done = work_->lanes.integrate(together.data(), num);
  for (int l = 0; l < num; ++l)  // those that fail say why
    if (!done[l]) together[l].node->integrate(*together[l].x, *together[l].dx, *together[l].x_out);
}

bool ReducedNode::isKnown(ConstVectorRef x) const {
  if (chart_x_ != x) return false;
  for (const Cluster& b : clusters_)
    for (size_t j = 0; j < b.loop.joints.size(); ++j) {
      const Joint &own = b.loop.model.joints()[j + 1], &joint = model_.joints()[b.loop.joints[j]];
      if (b.at.q.segment(own.idx_q, own.nq) != x.segment(joint.idx_q, joint.nq)) return false;
    }
  return true;
}

void ReducedNode::difference(ConstVectorRef x0, ConstVectorRef x1, VectorRef dx) {
  takeWork();
  if (!updateChart(x0)) {
    dx.setConstant(std::numeric_limits<double>::quiet_NaN());
    return;
  }
  for (Cluster& b : clusters_) differenceAbout(b, b.chart, x0, x1, dx);
  differenceFree(x0, x1, dx);
}

// In lanes, where the bases of the last linearization serve.
void ReducedNode::calcDifferences(const Difference* items, int count) {
  takeWork();
  std::array<Difference, kLane> together;
  int num = 0;
  for (int i = 0; i < count; ++i) {
    ReducedNode& node = *static_cast<ReducedNode*>(items[i].node);
    if (node.chart_x_ == *items[i].x0)
      together[num++] = items[i];
    else
      node.difference(*items[i].x0, *items[i].x1, *items[i].dx);
  }
  if (num > 0) work_->lanes.calcDifferences(together.data(), num);
}

bool ReducedNode::updateState(ConstVectorRef x) {
  takeWork();
  return updateState(x, nullptr);
}

bool ReducedNode::updatePoint(ConstVectorRef x, const ReducedNode* previous) {
  setState(x);
  for (size_t i = 0; i < clusters_.size(); ++i) {
    Cluster& b = clusters_[i];
    ClusterState& point = b.work->point;
    if (!previous) {
      gatherConfiguration(model_, b.loop, q_, b.work->q);
      if (!point.update(b.loop, b.work->scratch, b.work->q)) return fail(b, point);
    }
    takePoint(b, previous ? previous->clusters_[i].next : point);
  }
  placeWhole(model_, reduction_, q_, X_WB_);
  return true;
}

void ReducedNode::setState(ConstVectorRef x) {
  failure_.clear();
  has_state_value_ = false;
  q_ = x.head(model_.nq());
  v_ = x.tail(model_.nv());
}

// Placements of a cluster stay as seen from the body that carries it.
void ReducedNode::takePoint(Cluster& b, const ClusterState& point) {
  b.at = point.basis();
  for (size_t j = 0; j < b.loop.joints.size(); ++j) X_WB_[b.loop.joints[j]] = point.placements()[j + 1];
}

bool ReducedNode::updateState(ConstVectorRef x, const ReducedNode* previous) {
  if (!updatePoint(x, previous)) return false;
  restore();
  updateCompositeInertias(model_, work_->ws);
  return true;
}

void ReducedNode::restore() {
  takeWork();
  Workspace& ws = work_->ws;
  shown_ = &ws;
  ws.q = q_;
  ws.X_WB = X_WB_;
  ws.stage = WorkspaceStage::Placement;
  updateColumns(model_, ws);
  updateVelocities(model_, ws, v_);
}

void ReducedNode::differenceAbout(Cluster& b, const MatrixXd& WN, ConstVectorRef x0, ConstVectorRef x1,
                                  VectorRef dx) const {
  const int nq = model_.nq(), nr = reduction_.size;
  for (size_t j = 0; j < b.loop.joints.size(); ++j) {
    const Joint& joint = model_.joints()[b.loop.joints[j]];
    calcJointDifference(joint, x0.segment(joint.idx_q, joint.nq), x1.segment(joint.idx_q, joint.nq),
                        b.work->d.segment(b.loop.model.joints()[j + 1].idx_v, joint.nv));
  }
  dx.segment(b.loop.offset, b.loop.size).setZero();
  addSmallProductTransposed(WN, b.work->d, dx.segment(b.loop.offset, b.loop.size));
  for (size_t k = 0; k < b.loop.dofs.size(); ++k) b.work->d[k] = x1[nq + b.loop.dofs[k]] - x0[nq + b.loop.dofs[k]];
  dx.segment(nr + b.loop.offset, b.loop.size).setZero();
  addSmallProductTransposed(WN, b.work->d, dx.segment(nr + b.loop.offset, b.loop.size));
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

// Bases at x for difference(): those of the last linearization, unless x is another point.
bool ReducedNode::updateChart(ConstVectorRef x) {
  if (chart_x_ == x) return true;
  for (Cluster& b : clusters_) {
    gatherConfiguration(model_, b.loop, x.head(model_.nq()), b.work->q);
    if (!b.work->point.update(b.loop, b.work->scratch, b.work->q)) return fail(b, b.work->point);
    b.chart = b.work->point.basis().WN;
  }
  chart_x_ = x;
  return true;
}

void ReducedNode::storeChart() {
  for (Cluster& b : clusters_) b.chart = b.at.WN;
  chart_x_.head(model_.nq()) = q_;
  chart_x_.tail(model_.nv()) = v_;
}

std::shared_ptr<ReducedWorkPool> makeReducedWorkPool(const Model& model, const Reduction& reduction,
                                                     const std::vector<StageSpec>& specs) {
  return std::make_shared<ReducedWorkPool>(model, reduction, specs);
}

std::unique_ptr<NodeModel> makeReducedNode(const Model& model, const Reduction& reduction, const StageSpec& spec,
                                           std::shared_ptr<ReducedWorkPool> pool) {
  if (spec.kind == StageKind::Impact)
    return std::make_unique<ReducedImpactNode>(model, reduction, spec, std::move(pool));
  return std::make_unique<ReducedNode>(model, reduction, spec, std::move(pool));
}

}  // namespace bielle
