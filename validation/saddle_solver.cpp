#include "saddle_solver.h"

namespace bielle::validation {
namespace {

// Rows, and pivots of scaled rows, below this share of the largest one are rounding of redundant rows.
constexpr double kMapRankThreshold = 1e-10;

}  // namespace

template <typename Real>
SaddleSolver<Real>::SaddleSolver(const MatrixXd& M, const MatrixXd& J)
    : D_(M.diagonal().cwiseSqrt().cwiseInverse()), E_(J.rowwise().norm().template cast<Real>()) {
  const int nv = static_cast<int>(M.rows()), m = static_cast<int>(J.rows());
  const Real largest = m > 0 ? E_.maxCoeff() : 0;
  for (int i = 0; i < m; ++i) E_[i] = E_[i] > kMapRankThreshold * largest ? 1 / (J.row(i) * D_.asDiagonal()).norm() : 0;
  const VectorXr D = D_.template cast<Real>();
  DMD_ = D.asDiagonal() * M.template cast<Real>() * D.asDiagonal();
  N_ = MatrixXr::Identity(nv, nv);
  for (auto* factor : {&rows_, &columns_}) factor->setThreshold(kMapRankThreshold);
  if (m > 0) {
    const MatrixXr EJD = E_.asDiagonal() * J.template cast<Real>() * D.asDiagonal();
    columns_.compute(EJD.transpose());
    N_ = MatrixXr(columns_.householderQ()).rightCols(nv - columns_.rank());
    rows_.compute(EJD);
  }
  within_.compute(N_.transpose() * DMD_ * N_);
}

template <typename Real>
void SaddleSolver<Real>::solve(const MatrixXd& force, const MatrixXd& target, MatrixXd& a,
                               MatrixXd& multipliers) const {
  const MatrixXr scaled = D_.template cast<Real>().asDiagonal() * force.template cast<Real>();
  MatrixXr z = MatrixXr::Zero(D_.size(), force.cols()), y = MatrixXr::Zero(E_.size(), force.cols());
  if (E_.size() > 0) z = rows_.solve(E_.asDiagonal() * target.template cast<Real>());
  z += N_ * within_.solve(N_.transpose() * (scaled - DMD_ * z));
  if (E_.size() > 0) y = columns_.solve(scaled - DMD_ * z);
  a = D_.asDiagonal() * z.template cast<double>();
  multipliers = (E_.asDiagonal() * y).template cast<double>();
}

template class SaddleSolver<double>;
template class SaddleSolver<long double>;

}  // namespace bielle::validation
