#include "solve/lq_sweep.h"

#include <algorithm>
#include <cmath>

#include "math/lane_product.h"

namespace bielle {

namespace {

using Eigen::Index;

bool hasFiniteLower(MatrixMap Q, Index size) {
  for (Index j = 0; j < size; ++j) {
    if (!Q.col(j).segment(j, size - j).allFinite()) return false;
  }
  return true;
}

// A value that is not finite in the models of a node reaches Vx or the diagonal of Vxx there, or one node earlier.
bool isFinite(const LqSweep::Node& node) { return node.Vx.allFinite() && node.Vxx.diagonal().allFinite(); }

}  // namespace

LqResult LqSweep::update(const std::vector<StageModel>& models, const LqRegularization& regularization,
                         const std::vector<ControlBox>& boxes, const std::vector<ConstraintWeights>& weights) {
  start(models, regularization);
  const int N = static_cast<int>(models.size()) - 1;
  for (int k = N; k >= 0 && result_.status == NumericalStatus::Ok; --k)
    updateNode(k, models[k], k < N && !boxes.empty() ? &boxes[k] : nullptr, weights.empty() ? nullptr : &weights[k]);
  return result_;
}

void LqSweep::start(const std::vector<StageModel>& models, const LqRegularization& regularization) {
  resize(models);
  regularization_ = regularization;
  result_ = LqResult();
}

NumericalStatus LqSweep::updateNode(int k, const StageModel& model, const ControlBox* box,
                                    const ConstraintWeights* weights) {
  Node& node = nodes_[k];
  MatrixMap Q = copyHessian(model);
  node.gradient << model.lu, model.lx;
  if (weights) addConstraints(model, *weights, Q, node.gradient);
  if (k + 1 == static_cast<int>(nodes_.size())) {
    node.Vx = node.gradient;
    node.Vxx = Q;
    node.Vxx.diagonal().array() += regularization_.state;
    copyLowerToUpper(node.Vxx);
    return NumericalStatus::Ok;
  }
  const NumericalStatus status = updateStage(model, nodes_[k + 1], box, Q, node);
  if (status != NumericalStatus::Ok) result_ = {status, k, 0};
  return status;
}

MatrixMap LqSweep::copyHessian(const StageModel& model) {
  const ConstMatrixMap from = model.hessian();
  std::copy_n(from.data(), from.outerStride() * from.cols(), hessian_.data());
  return {hessian_.data(), from.rows(), from.cols(), Eigen::OuterStride<>(from.outerStride())};
}

// Columns in full lanes: their padding is zero.
void LqSweep::addConstraints(const StageModel& model, const ConstraintWeights& weights, MatrixMap Q,
                             VectorXd& gradient) {
  const ConstMatrixMap Ct = model.Ct();
  const Index stride = Ct.outerStride();
  int num = 0;
  for (Index i = 0; i < weights.gradient.size(); ++i) {
    if (weights.gradient[i] != 0) gradient += weights.gradient[i] * Ct.col(i);
    if (weights.hessian[i] == 0) continue;
    const Eigen::Map<const VectorXd> row(Ct.data() + i * stride, stride);
    Ct_.segment(num * stride, stride) = row;
    Ct_scaled_.segment(num++ * stride, stride) = weights.hessian[i] * row;
  }
  addLowerProduct(0, num, 1, {Ct_scaled_.data(), stride}, {Ct_.data(), stride}, Q);
}

NumericalStatus LqSweep::updateStage(const StageModel& model, const Node& next, const ControlBox* box, MatrixMap Q,
                                     Node& node) {
  updateQuadratic(model, next, Q, node);
  if (!node.Vx.allFinite()) return NumericalStatus::NotFinite;
  result_.expected_change += next.Vx.dot(model.gap) + 0.5 * model.gap.dot(Vxx_gap_.head(model.gap.size()));
  const NumericalStatus status = box ? eliminateBoxedControls(*box, Q, node) : eliminateControls(Q, node);
  if (status != NumericalStatus::Ok) return status;
  return isFinite(node) ? NumericalStatus::Ok : NumericalStatus::NotFinite;
}

// Eqs. (2) to (4). Vx holds Qx until the elimination.
void LqSweep::updateQuadratic(const StageModel& model, const Node& next, MatrixMap Q, Node& node) {
  const Index n = model.lx.size(), nu = model.lu.size(), n_next = model.gap.size();
  const ConstMatrixMap Ft = model.Ft();
  auto p = p_.head(n_next), Vxx_gap = Vxx_gap_.head(n_next), gradient = gradient_.head(nu + n);
  Vxx_gap.noalias() = next.Vxx * model.gap;
  p = next.Vx + Vxx_gap;
  gradient = node.gradient;
  gradient.noalias() += Ft * p;
  node.Qu = gradient.head(nu);
  node.Vx = gradient.tail(n);

  auto Ft_Vxx = shapePadded(Ft_Vxx_, nu + n, n_next);
  setProduct(nu + n, n_next, n_next, pad(Ft), {next.Vxx.data(), 1, n_next}, pad(Ft_Vxx));
  Q.diagonal().head(nu).array() += regularization_.control;
  Q.diagonal().tail(n).array() += regularization_.state;
  addLowerProduct(0, n_next, 1, pad(Ft), pad(Ft_Vxx), Q);
}

// Eqs. (5) to (7).
NumericalStatus LqSweep::eliminateControls(MatrixMap Q, Node& node) {
  const Index n = node.Vx.size(), nu = node.Qu.size();
  if (!hasFiniteLower(Q, nu) || !node.Qu.allFinite()) return NumericalStatus::NotFinite;
  if (!factorizeColumns(Q, nu)) return NumericalStatus::Indefinite;
  const auto L = Q.topLeftCorner(nu, nu).triangularView<Eigen::Lower>();
  node.k = -node.Qu;
  L.solveInPlace(node.k);
  node.Vx.noalias() += Q.bottomLeftCorner(n, nu) * node.k;  // Qux^T k = Y^T (-L^{-1} Qu)
  L.transpose().solveInPlace(node.k);
  result_.expected_change += 0.5 * node.Qu.dot(node.k);
  updateGains(static_cast<int>(nu), Q, node);
  node.K = shapePadded(Kt_, n, nu).transpose();
  return NumericalStatus::Ok;
}

// Eqs. (5) to (7) with the box.
NumericalStatus LqSweep::eliminateBoxedControls(const ControlBox& box, MatrixMap Q, Node& node) {
  const Index n = node.Vx.size(), nu = node.Qu.size();
  const auto Quu = Q.topLeftCorner(nu, nu);
  node.k.setZero();
  const NumericalStatus status = box_qp_.solve(Quu, node.Qu, box.lower, box.upper, node.k);
  if (status == NumericalStatus::NotConverged && !hasFiniteLower(Q, nu)) return NumericalStatus::NotFinite;
  if (status != NumericalStatus::Ok) return NumericalStatus::Indefinite;
  node.Vx.noalias() += Q.bottomLeftCorner(n, nu) * node.k;
  auto Quu_k = Kt_.head(nu);
  Quu_k.noalias() = Quu.selfadjointView<Eigen::Lower>() * node.k;
  result_.expected_change += node.Qu.dot(node.k) + 0.5 * node.k.dot(Quu_k);

  // The free rows and columns move to the front, in place: a free index is never smaller than its rank.
  const int num_free = box_qp_.numFree();
  for (int j = 0; j < num_free; ++j) {
    if (const int free = box_qp_.getFreeIndex(j); free != j) Q.col(j) = Q.col(free);
    for (int i = j; i < num_free; ++i) Q(i, j) = Q(box_qp_.getFreeIndex(i), j);
  }
  if (!factorizeColumns(Q, num_free)) return NumericalStatus::Indefinite;
  updateGains(num_free, Q, node);
  node.K.setZero();
  for (int i = 0; i < num_free; ++i) node.K.row(box_qp_.getFreeIndex(i)) = shapePadded(Kt_, n, nu).col(i).transpose();
  return NumericalStatus::Ok;
}

// Vxx of Eq. (6), and K^T of Eq. (5) of the free controls, from L and Y^T in the first columns of Q.
void LqSweep::updateGains(int num_free, MatrixMap Q, Node& node) {
  const Index n = node.Vx.size(), nu = node.Qu.size();
  auto Kt = shapePadded(Kt_, n, nu);
  addLowerProduct(nu, num_free, -1, pad(Q), pad(Q), Q);
  node.Vxx = Q.bottomRightCorner(n, n);
  copyLowerToUpper(node.Vxx);
  Kt.leftCols(num_free) = -Q.bottomLeftCorner(n, num_free);
  clearPadding(Kt);
  MatrixMap free = shapePadded(Kt_, n, num_free);
  solveFromRight(Q.topLeftCorner(num_free, num_free), free);
}

double LqSweep::calcStep(const std::vector<StageModel>& models, std::vector<VectorXd>& dx,
                         std::vector<VectorXd>& du) const {
  const int N = static_cast<int>(models.size()) - 1;
  dx.resize(N + 1);
  du.resize(N);
  dx[0].setZero(models[0].lx.size());
  double slope = 0;
  for (int k = 0; k < N; ++k) {
    du[k] = nodes_[k].k;
    du[k].noalias() += nodes_[k].K * dx[k];
    const VectorXd& gradient = nodes_[k].gradient;
    slope += gradient.tail(dx[k].size()).dot(dx[k]) + gradient.head(du[k].size()).dot(du[k]);
    dx[k + 1] = models[k].gap;
    dx[k + 1].noalias() += models[k].Fx() * dx[k];
    dx[k + 1].noalias() += models[k].Fu() * du[k];
  }
  return slope + nodes_[N].gradient.dot(dx[N]);
}

void LqSweep::resize(const std::vector<StageModel>& models) {
  nodes_.resize(models.size());
  Eigen::Index max_n = 0, max_nu = 0, max_rows = 0;
  for (size_t k = 0; k < models.size(); ++k) {
    const Eigen::Index n = models[k].lx.size(), nu = k + 1 < models.size() ? models[k].lu.size() : 0;
    nodes_[k].Vx.resize(n);
    nodes_[k].Vxx.resize(n, n);
    nodes_[k].Qu.resize(nu);
    nodes_[k].k.resize(nu);
    nodes_[k].K.resize(nu, n);
    nodes_[k].gradient.resize(nu + n);
    max_n = std::max(max_n, n);
    max_nu = std::max(max_nu, nu);
    max_rows = std::max(max_rows, models[k].Ct().cols());
  }
  const Index rows = roundUpToLane(max_n + max_nu);
  p_.resize(max_n);
  Vxx_gap_.resize(max_n);
  gradient_.resize(max_n + max_nu);
  Ft_Vxx_.resize(rows * max_n);
  hessian_.setZero(rows * (max_n + max_nu));
  for (VectorXd* m : {&Ct_, &Ct_scaled_}) m->resize(rows * max_rows);
  Kt_.resize(roundUpToLane(max_n) * max_nu);
}

}  // namespace bielle
