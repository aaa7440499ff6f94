#include "bielle/solve/lq_sweep.h"

#include <Eigen/Cholesky>

namespace bielle {

namespace {

using Eigen::Lower;

// The first rows x cols numbers of a buffer as a matrix.
Eigen::Map<MatrixXd> shape(VectorXd& buffer, Eigen::Index rows, Eigen::Index cols) {
  return Eigen::Map<MatrixXd>(buffer.data(), rows, cols);
}

// By blocks: a strided copy of whole rows would cost a tenth of the sweep.
void copyLowerToUpper(MatrixXd& A) {
  constexpr Eigen::Index kBlock = 16;
  for (Eigen::Index c = 0; c < A.cols(); c += kBlock) {
    const Eigen::Index width = std::min(kBlock, A.cols() - c), below = A.cols() - c - width;
    A.block(c, c + width, width, below) = A.block(c + width, c, below, width).transpose();
    for (Eigen::Index j = c; j < c + width; ++j) {
      for (Eigen::Index i = j + 1; i < c + width; ++i) A(j, i) = A(i, j);
    }
  }
}

// A value that is not finite in the models of a node reaches Vx or the diagonal of Vxx there, or one node earlier.
bool isFinite(const LqSweep::Node& node) { return node.Vx.allFinite() && node.Vxx.diagonal().allFinite(); }

}  // namespace

LqResult LqSweep::update(const std::vector<StageModel>& models, const LqRegularization& regularization,
                         const std::vector<ControlBox>& boxes) {
  resize(models);
  const int N = static_cast<int>(models.size()) - 1;
  LqResult result;
  Node& terminal = nodes_[N];
  terminal.Vx = models[N].lx;
  terminal.Vxx = models[N].lxx;
  terminal.Vxx.diagonal().array() += regularization.state;
  copyLowerToUpper(terminal.Vxx);
  for (int k = N - 1; k >= 0; --k) {
    Node& node = nodes_[k];
    updateQuadratic(models[k], nodes_[k + 1], regularization, node);
    if (!node.Vx.allFinite()) return {LqStatus::NotFinite, k, 0};
    double change = nodes_[k + 1].Vx.dot(models[k].gap) + 0.5 * models[k].gap.dot(Vxx_gap_.head(models[k].gap.size()));
    const LqStatus status = boxes.empty() ? updateGains(node, change) : updateBoxedGains(boxes[k], node, change);
    if (status != LqStatus::Ok) return {status, k, 0};
    copyLowerToUpper(node.Vxx);
    if (!isFinite(node)) return {LqStatus::NotFinite, k, 0};
    result.expected_change += change;
  }
  return result;
}

// Eqs. (2) to (4). Vx, Vxx (lower triangle) and Y_ hold Qx, Qxx and Qux from here to the gains.
void LqSweep::updateQuadratic(const StageModel& model, const Node& next, const LqRegularization& regularization,
                              Node& node) {
  const Eigen::Index n = model.Fx.cols(), nu = model.Fu.cols(), n_next = model.Fx.rows();
  auto p = p_.head(n_next), Vxx_gap = Vxx_gap_.head(n_next);
  Vxx_gap.noalias() = next.Vxx * model.gap;
  p = next.Vx + Vxx_gap;
  node.Vx = model.lx;
  node.Vx.noalias() += model.Fx.transpose() * p;
  node.Qu = model.lu;
  node.Qu.noalias() += model.Fu.transpose() * p;

  auto Vxx_Fu = shape(Vxx_F_, n_next, nu);
  Vxx_Fu.noalias() = next.Vxx * model.Fu;
  auto Quu = shape(Quu_, nu, nu);
  Quu = model.luu;
  Quu.noalias() += model.Fu.transpose() * Vxx_Fu;
  Quu.diagonal().array() += regularization.control;

  auto Vxx_Fx = shape(Vxx_F_, n_next, n);
  Vxx_Fx.noalias() = next.Vxx * model.Fx;
  auto Qux = shape(Y_, nu, n);
  Qux = model.lux;
  Qux.noalias() += model.Fu.transpose() * Vxx_Fx;
  node.Vxx = model.lxx;
  node.Vxx.diagonal().array() += regularization.state;
  node.Vxx.triangularView<Lower>() += model.Fx.transpose() * Vxx_Fx;
}

// Eqs. (5) to (7).
LqStatus LqSweep::updateGains(Node& node, double& change) {
  const Eigen::Index n = node.Vx.size(), nu = node.Qu.size();
  if (nu == 0) return LqStatus::Ok;
  Eigen::Ref<MatrixXd> L = shape(Quu_, nu, nu);
  if (!L.diagonal().allFinite() || !node.Qu.allFinite()) return LqStatus::NotFinite;
  if (Eigen::LLT<Eigen::Ref<MatrixXd>>(L).info() != Eigen::Success) return LqStatus::Indefinite;
  auto Y = shape(Y_, nu, n);
  L.triangularView<Lower>().solveInPlace(Y);
  node.k = -node.Qu;
  L.triangularView<Lower>().solveInPlace(node.k);
  node.Vx.noalias() += Y.transpose() * node.k;  // Qux^T k = Y^T (-L^{-1} Qu)
  L.triangularView<Lower>().transpose().solveInPlace(node.k);
  node.K = -Y;
  L.triangularView<Lower>().transpose().solveInPlace(node.K);
  node.Vxx.selfadjointView<Lower>().rankUpdate(Y.transpose(), -1.0);
  change += 0.5 * node.Qu.dot(node.k);
  return LqStatus::Ok;
}

// Eqs. (5) to (7) with the box.
LqStatus LqSweep::updateBoxedGains(const ControlBox& box, Node& node, double& change) {
  const Eigen::Index n = node.Vx.size(), nu = node.Qu.size();
  const auto Quu = shape(Quu_, nu, nu);
  auto Qux = shape(Y_, nu, n);
  node.k.setZero();
  switch (box_qp_.solve(Quu, node.Qu, box.lower, box.upper, node.k)) {
    case BoxQpStatus::Ok:
      break;
    case BoxQpStatus::Indefinite:
      return LqStatus::Indefinite;
    case BoxQpStatus::NotConverged:
      return Quu.allFinite() ? LqStatus::Indefinite : LqStatus::NotFinite;
  }
  node.Vx.noalias() += Qux.transpose() * node.k;
  change += node.Qu.dot(node.k);
  for (Eigen::Index j = 0; j < nu; ++j) change += 0.5 * node.k[j] * Quu.col(j).dot(node.k);

  // The free rows move to the top of the buffer, in place: a free index is never smaller than its rank.
  node.K.setZero();
  const int num_free = box_qp_.getNumFree();
  if (num_free == 0) return LqStatus::Ok;
  for (int i = 0; i < num_free; ++i) {
    if (box_qp_.getFreeIndex(i) != i) Qux.row(i) = Qux.row(box_qp_.getFreeIndex(i));
  }
  auto Y = Qux.topRows(num_free);
  const auto L = box_qp_.getFreeFactor();
  L.triangularView<Lower>().solveInPlace(Y);
  node.Vxx.selfadjointView<Lower>().rankUpdate(Y.transpose(), -1.0);
  L.triangularView<Lower>().transpose().solveInPlace(Y);
  for (int i = 0; i < num_free; ++i) node.K.row(box_qp_.getFreeIndex(i)) = -Y.row(i);
  return LqStatus::Ok;
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
    slope += models[k].lx.dot(dx[k]) + models[k].lu.dot(du[k]);
    dx[k + 1] = models[k].gap;
    dx[k + 1].noalias() += models[k].Fx * dx[k];
    dx[k + 1].noalias() += models[k].Fu * du[k];
  }
  return slope + models[N].lx.dot(dx[N]);
}

void LqSweep::resize(const std::vector<StageModel>& models) {
  nodes_.resize(models.size());
  Eigen::Index max_n = 0, max_nu = 0;
  for (size_t k = 0; k < models.size(); ++k) {
    const Eigen::Index n = models[k].lx.size(), nu = k + 1 < models.size() ? models[k].lu.size() : 0;
    nodes_[k].Vx.resize(n);
    nodes_[k].Vxx.resize(n, n);
    nodes_[k].Qu.resize(nu);
    nodes_[k].k.resize(nu);
    nodes_[k].K.resize(nu, n);
    max_n = std::max(max_n, n);
    max_nu = std::max(max_nu, nu);
  }
  p_.resize(max_n);
  Vxx_gap_.resize(max_n);
  Vxx_F_.resize(max_n * std::max(max_n, max_nu));
  Quu_.resize(max_nu * max_nu);
  Y_.resize(max_nu * max_n);
}

}  // namespace bielle
