#include "bielle/dynamics/reduction.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "bielle/dynamics/constrained.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/rnea.h"
#include "bielle/model/builder.h"

namespace bielle {
namespace {

constexpr double kClosedTolerance = 1e-13;    // what close() aims at
constexpr double kAcceptedTolerance = 1e-11;  // what it accepts when rounding stops it
constexpr double kRankTolerance = 1e-6;       // diagonal of L, relative to its first entry

// Rows of a factorization that one operation works on.
constexpr int kLane = 8;
using Lane = Eigen::Array<double, kLane, 1>;

// The cluster's joints over their common root, which becomes the world of the block.
Model makeBlockModel(const Model& model, const LoopCluster& cluster, const std::vector<int>& joints) {
  ModelBuilder builder("loops of " + model.name());
  builder.setGravity(Vector3d::Zero());
  std::vector<std::string> links(model.numBodies(), "world");
  for (int i : joints) {
    Joint joint = model.joints()[i];
    links[i] = model.bodies()[i].name;
    builder.addLink(links[i], links[joint.parent], joint, {});
  }
  for (int c : cluster.closures) {
    const Closure& closure = model.closures()[c];
    builder.addFrame(closure.name + "|1", links[closure.body1], closure.X_B1);
    builder.addFrame(closure.name + "|2", links[closure.body2], closure.X_B2);
    builder.addClosure(closure.name, closure.kind, closure.name + "|1", closure.name + "|2", closure.axis);
  }
  return builder.build();
}

// W: the inertia of each dof, with a floor that keeps (1) well conditioned. A mechanism without inertia has no preference.
VectorXd makeMetric(const Workspace& ws, const std::vector<int>& dofs) {
  constexpr double kFloor = 1e-3;
  VectorXd metric(dofs.size());
  for (size_t k = 0; k < dofs.size(); ++k) metric[k] = ws.M(dofs[k], dofs[k]);
  const double largest = metric.maxCoeff();
  return largest > 0 ? VectorXd((metric / largest).cwiseMax(kFloor)) : VectorXd::Ones(metric.size());
}

// Parent, path and outer coordinates of a unit carried by body `root`.
void connectUnit(const Model& model, const Reduction& reduction, int root, ReducedUnit& unit) {
  if (root == 0) return;
  unit.parent = reduction.unit_of_body[root];
  const ReducedUnit& up = reduction.units[unit.parent];
  unit.outer = up.outer;
  for (int k = 0; k < up.size; ++k) unit.outer.push_back(up.offset + k);
  std::vector<int> dofs;
  if (up.block >= 0) {
    dofs = reduction.blocks[up.block].dofs;
  } else {
    const Joint& joint = model.joints()[up.joint];
    for (int k = 0; k < joint.nv; ++k) dofs.push_back(joint.idx_v + k);
  }
  const std::vector<int>& support = model.supportDofs(root);
  for (size_t k = 0; k < dofs.size(); ++k)
    if (std::binary_search(support.begin(), support.end(), dofs[k])) unit.path.push_back(static_cast<int>(k));
}

// What the paths through a block are made of.
void addGroups(LoopBlock& block) {
  std::vector<int> last_group(block.model.numBodies(), -1);
  block.body_dof.assign(block.model.numBodies(), -1);
  for (int i = 1; i < block.model.numBodies(); ++i) {
    const Joint& joint = block.model.joints()[i];
    last_group[i] = last_group[joint.parent];
    block.body_dof[i] = block.body_dof[joint.parent];
    const int step = joint.kind == JointKind::Universal ? 1 : joint.nv;
    for (int k = joint.idx_v; k < joint.idx_v + joint.nv; k += step) {
      block.groups.push_back({k, k + step, block.body_dof[i], last_group[i]});
      block.body_dof[i] = k + step - 1;
      last_group[i] = static_cast<int>(block.groups.size()) - 1;
    }
  }
}

// The closures of a block for someone who looks at the whole model.
void placeClosures(const Model& model, LoopBlock& block) {
  block.placed = block.closures.closures;
  for (size_t c = 0; c < block.placed.size(); ++c) {
    const Closure& whole = model.closures()[block.cluster_closures[c]];
    block.placed[c].body1 = whole.body1;
    block.placed[c].body2 = whole.body2;
  }
}

}  // namespace

Reduction makeReduction(const Model& model, ConstVectorRef q) {
  Reduction out;
  Workspace whole(model);
  updatePositions(model, whole, q);
  updateMassMatrix(model, whole);
  std::vector<int> owner(model.numBodies(), -1);
  for (const LoopCluster& cluster : model.clusters()) {
    LoopBlock block;
    block.dofs = cluster.dofs;
    for (int k : cluster.dofs)
      if (block.joints.empty() || block.joints.back() != model.dofs()[k].joint)
        block.joints.push_back(model.dofs()[k].joint);
    for (int i : block.joints) owner[i] = static_cast<int>(out.blocks.size());
    block.model = makeBlockModel(model, cluster, block.joints);
    block.closures = makeConstraintSet(block.model);
    block.cluster_closures = cluster.closures;
    VectorXd q_block(block.model.nq());
    gatherConfiguration(model, block, q, q_block);
    const Mobility mobility = calcMobility(block.model, q_block, kRankTolerance);
    block.rank = mobility.rank;
    block.size = mobility.mobility;
    block.metric = makeMetric(whole, block.dofs);
    block.inverse_metric = block.metric.cwiseInverse();
    block.inverse_root = block.metric.cwiseSqrt().cwiseInverse();
    for (size_t k = 0; k < block.dofs.size(); ++k) block.own_dofs.push_back(static_cast<int>(k));
    block.root = model.joints()[block.joints.front()].parent;
    addGroups(block);
    placeClosures(model, block);
    Workspace ws(block.model);
    updatePositions(block.model, ws, q_block);
    for (const Closure& closure : block.closures.closures)
      if (!(calcClosureResidual(ws, closure).cwiseAbs().maxCoeff() < 1e-8))
        throw ModelError(model.name(), "closure '" + closure.name + "'", "it is open at the given configuration",
                         "close the configuration first (assemble, closeConfiguration)");
    out.blocks.push_back(std::move(block));
  }
  // Units and their reduced coordinates, in the order of the first joint of each.
  std::vector<int> block_unit(out.blocks.size(), -1);
  std::vector<int>& unit_of = out.unit_of_body;
  unit_of.assign(model.numBodies(), -1);
  for (int i = 1; i < model.numBodies(); ++i) {
    if (owner[i] >= 0 && block_unit[owner[i]] >= 0) {
      unit_of[i] = block_unit[owner[i]];
      continue;
    }
    ReducedUnit unit;
    unit.offset = out.size;
    unit_of[i] = static_cast<int>(out.units.size());
    if (owner[i] < 0) {
      unit.joint = i;
      unit.size = model.joints()[i].nv;
      out.free_joints.push_back(i);
      out.free_offsets.push_back(out.size);
    } else {
      unit.block = owner[i];
      block_unit[owner[i]] = unit_of[i];
      out.blocks[owner[i]].offset = out.size;
      unit.size = out.blocks[owner[i]].size;
    }
    // The first joint of a block hangs on the body that carries the whole block.
    connectUnit(model, out, model.joints()[i].parent, unit);
    out.size += unit.size;
    out.units.push_back(unit);
  }
  if (out.size == 0)
    throw ModelError(model.name(), "closures", "they leave the robot no mobility", "see `bielle info` for ranks");
  return out;
}

ReducedUnit makeTip(const Model& model, const Reduction& reduction, int body) {
  ReducedUnit tip;
  connectUnit(model, reduction, body, tip);
  return tip;
}

BlockBasis::BlockBasis(const LoopBlock& block) {
  const int n = block.model.nv();
  q.setZero(block.model.nq());
  N.setZero(n, block.size);
  WN.setZero(n, block.size);
  J.setZero(block.rank, n);
  L.setZero(block.rank, block.rank);
  rows.resize(block.rank);
}

BlockScratch::BlockScratch(const LoopBlock& block) : ws(block.model) {
  const int n = block.model.nv(), m = block.closures.rows, rank = block.rank;
  residual.setZero(m);
  correction.setZero(rank);
  J_all.setZero(m, n);
  J.setZero(rank, n);
  JW.setZero(rank, n);
  newton.setZero(rank, rank);
  pivots.resize(rank);
  const int padded = (m + kLane - 1) / kLane * kLane;
  reflected.setZero(padded, n);
  reflectors.setZero(n, rank);
  products.setZero(padded);
  beta.setZero(rank);
  rest.setZero(m);
}

BlockState::BlockState(const LoopBlock& block) : basis_(block), placements_(block.model.numBodies()) {
  zeta_.setZero(block.rank);
  step_.setZero(block.model.nv());
}

void applyPseudoInverse(const LoopBlock& block, const BlockBasis& basis, double s, MatrixRef X, MatrixRef out) {
  solveGram(basis, X);
  out.setZero();
  addSmallProductTransposed(basis.J, X, out, s);
  out.array().colwise() *= block.inverse_metric.array();
}

namespace {

void updateJacobian(const LoopBlock& block, BlockScratch& scratch) {
  const ConstraintSet& set = block.closures;
  for (size_t c = 0; c < set.closures.size(); ++c)
    calcClosureJacobian(scratch.ws, set.closures[c],
                        scratch.J_all.middleRows(set.offsets[c], getRows(set.closures[c].kind)));
}

// Returns the largest entry.
double updateResidual(const LoopBlock& block, BlockScratch& scratch) {
  const ConstraintSet& set = block.closures;
  for (size_t c = 0; c < set.closures.size(); ++c)
    scratch.residual.segment(set.offsets[c], getRows(set.closures[c].kind)) =
        calcClosureResidual(scratch.ws, set.closures[c]);
  return scratch.residual.size() ? scratch.residual.cwiseAbs().maxCoeff() : 0;
}

// Rows of a matrix that are named.
void selectRows(const MatrixXd& all, const std::vector<int>& rows, MatrixXd& out) {
  for (Eigen::Index k = 0; k < all.cols(); ++k)
    for (size_t i = 0; i < rows.size(); ++i) out(i, k) = all(rows[i], k);
}

// J W^{-1/2} = [L, 0] Q^T with Q = H_1 H_2 ..., H = I - beta v v^T, the v in the columns of `reflectors`. Rows are taken
// by what the ones before leave of them, largest first. False when the rank is another than the block's.
bool factorize(const LoopBlock& block, BlockScratch& scratch, BlockBasis& basis) {
  MatrixXd& E = scratch.reflected;
  VectorXd &rest = scratch.rest, &products = scratch.products;
  const int m = static_cast<int>(rest.size()), n = static_cast<int>(E.cols()), rank = block.rank;
  E.topRows(m) = scratch.J_all * block.inverse_root.asDiagonal();
  rest = E.topRows(m).rowwise().squaredNorm();
  double first = 0, last = 0;
  for (int p = 0; p < rank; ++p) {
    int row = 0;
    for (int r = 1; r < m; ++r)
      if (rest[r] > rest[row]) row = r;
    basis.rows[p] = row;
    double* v = &scratch.reflectors(0, p);
    for (int k = p; k < n; ++k) v[k] = E(row, k);
    // E x for the row x, |x|^2 among it, and with v = x - pivot e_p from it E v.
    for (Eigen::Index lane = 0; lane < E.rows(); lane += kLane) {
      Lane sum = Lane::Zero();
      for (int k = p; k < n; ++k) sum += v[k] * Eigen::Map<const Lane>(&E(lane, k));
      products.segment<kLane>(lane).array() = sum;
    }
    const double norm = std::sqrt(products[row]), pivot = v[p] > 0 ? -norm : norm;
    if (p == 0) first = norm;
    if (!(norm > kRankTolerance * first)) return false;
    last = norm;
    const double beta = 1 / (norm * (norm + std::abs(v[p])));
    scratch.beta[p] = beta;
    v[p] -= pivot;
    for (Eigen::Index lane = 0; lane < E.rows(); lane += kLane) {
      const Lane Ev = products.segment<kLane>(lane).array() - pivot * Eigen::Map<const Lane>(&E(lane, p));
      const Lane scaled = beta * Ev;
      for (int k = p; k < n; ++k) Eigen::Map<Lane>(&E(lane, k)) -= v[k] * scaled;
    }
    for (int r = 0; r < m; ++r) rest[r] -= E(r, p) * E(r, p);
    rest[row] = -std::numeric_limits<double>::infinity();
  }
  for (int k = 0; k < rank; ++k)
    for (int p = k; p < rank; ++p) basis.L(p, k) = E(basis.rows[p], k);
  // What is left must be nothing but rounding.
  double left = 0;
  for (int r = 0; r < m; ++r)
    if (std::isfinite(rest[r])) left = std::max(left, E.row(r).tail(n - rank).norm());
  return left <= kRankTolerance * last || left <= 1e-3 * kRankTolerance * first;
}

}  // namespace

// Eq. (1): N = W^{-1/2} Q_2 with the last columns of Q, and L L^T = J W^{-1} J^T.
bool BlockState::updateBases(const LoopBlock& block, BlockScratch& scratch) {
  const int rank = block.rank, size = block.size, n = static_cast<int>(block.metric.size());
  placements_ = scratch.ws.X_WB;
  updateColumns(block.model, scratch.ws);
  updateJacobian(block, scratch);
  if (!factorize(block, scratch, basis_)) return false;
  MatrixXd& N = basis_.N;
  N.setZero();
  for (int c = 0; c < size; ++c) N(rank + c, c) = 1;
  for (int p = rank - 1; p >= 0; --p) {
    const double* v = &scratch.reflectors(0, p);
    for (int c = 0; c < size; ++c) {
      double dot = 0;
      for (int k = p; k < n; ++k) dot += v[k] * N(k, c);
      dot *= scratch.beta[p];
      for (int k = p; k < n; ++k) N(k, c) -= dot * v[k];
    }
  }
  for (int c = 0; c < size; ++c)
    for (int k = 0; k < n; ++k) {
      N(k, c) *= block.inverse_root[k];
      basis_.WN(k, c) = block.metric[k] * N(k, c);
    }
  selectRows(scratch.J_all, basis_.rows, basis_.J);
  return true;
}

void BlockState::load(const LoopBlock& block, BlockScratch& scratch) const {
  scratch.ws.q = basis_.q;
  scratch.ws.X_WB = placements_;
  scratch.ws.stage = WorkspaceStage::Placement;
  updateColumns(block.model, scratch.ws);
}

bool BlockState::update(const LoopBlock& block, BlockScratch& scratch, ConstVectorRef q) {
  closed_ = true;
  basis_.q = q;
  updatePlacements(block.model, scratch.ws, basis_.q);
  return updateBases(block, scratch);
}

bool BlockState::close(const LoopBlock& block, BlockScratch& scratch, const BlockBasis& start, ConstVectorRef d,
                       const VectorXd& zeta_guess) {
  closed_ = false;
  // Newton on zeta with the matrix J(q) W^{-1} J(q_0)^T of the independent rows, refreshed while it pays.
  scratch.JW.noalias() = start.J * block.inverse_metric.asDiagonal();
  step_ = d;
  if (zeta_guess.size()) {
    zeta_ = zeta_guess;
    addSmallProductTransposed(scratch.JW, zeta_, step_, -1);
  } else {
    zeta_.setZero();
  }
  double gap = 0, previous = 0;
  constexpr int kMaxIterations = 30;
  for (int i = 0; i <= kMaxIterations; ++i) {
    block.model.integrate(start.q, step_, basis_.q);
    updatePlacements(block.model, scratch.ws, basis_.q);
    gap = updateResidual(block, scratch);
    if (!std::isfinite(gap)) return false;
    const bool stalled = i > 0 && gap > 0.5 * previous;
    if (gap <= kClosedTolerance || (stalled && gap <= kAcceptedTolerance)) break;
    if (i == kMaxIterations) return false;
    if (i == 0 || gap > 0.05 * previous) {
      updateColumns(block.model, scratch.ws);
      updateJacobian(block, scratch);
      selectRows(scratch.J_all, start.rows, scratch.J);
      scratch.newton.setZero();
      addSmallProduct(scratch.J, scratch.JW.transpose(), scratch.newton);
      if (!factorizeSmall(scratch.newton, scratch.pivots)) return false;
    }
    previous = gap;
    for (size_t r = 0; r < start.rows.size(); ++r) scratch.correction[r] = scratch.residual[start.rows[r]];
    // The residual falls by J dq (notation.h), and dq = -W^{-1} J(q_0)^T dzeta.
    solveFactorized(scratch.newton, scratch.pivots, scratch.correction);
    zeta_ -= scratch.correction;
    addSmallProductTransposed(scratch.JW, scratch.correction, step_);
  }
  closed_ = true;
  return updateBases(block, scratch);
}

std::string BlockState::describeFailure(const LoopBlock& block, const BlockScratch& scratch) const {
  const ConstraintSet& set = block.closures;
  if (closed_)
    return "closure '" + set.closures.front().name + "': the rank of its loops is no longer " +
           std::to_string(block.rank) + ": a configuration where they can move in other ways";
  size_t worst = 0;
  double largest = -1;
  for (size_t c = 0; c < set.closures.size(); ++c) {
    const double gap = scratch.residual.segment(set.offsets[c], getRows(set.closures[c].kind)).cwiseAbs().maxCoeff();
    if (gap > largest) largest = gap, worst = c;
  }
  return "closure '" + set.closures[worst].name + "' does not close: the step is too large, or out of its reach";
}

void BlockPoint::selectIndependent(const MatrixXd& all, MatrixXd& out) const { selectRows(all, basis().rows, out); }

void expandIndependent(const BlockBasis& basis, ConstVectorRef independent, VectorRef all) {
  all.setZero();
  for (size_t i = 0; i < basis.rows.size(); ++i) all[basis.rows[i]] = independent[i];
}

void gatherConfiguration(const Model& model, const LoopBlock& block, ConstVectorRef q, VectorRef q_block) {
  int at = 0;
  for (int i : block.joints) {
    const Joint& joint = model.joints()[i];
    q_block.segment(at, joint.nq) = q.segment(joint.idx_q, joint.nq);
    at += joint.nq;
  }
}

void scatterConfiguration(const Model& model, const LoopBlock& block, ConstVectorRef q_block, VectorRef q) {
  int at = 0;
  for (int i : block.joints) {
    const Joint& joint = model.joints()[i];
    q.segment(joint.idx_q, joint.nq) = q_block.segment(at, joint.nq);
    at += joint.nq;
  }
}

void gatherVelocity(const LoopBlock& block, ConstVectorRef v, VectorRef v_block) {
  for (size_t k = 0; k < block.dofs.size(); ++k) v_block[k] = v[block.dofs[k]];
}

void scatterVelocity(const LoopBlock& block, ConstVectorRef v_block, VectorRef v) {
  for (size_t k = 0; k < block.dofs.size(); ++k) v[block.dofs[k]] = v_block[k];
}

}  // namespace bielle
