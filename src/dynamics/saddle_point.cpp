#include "bielle/dynamics/saddle_point.h"

#include <cmath>

#include "bielle/math/lane_product.h"
#include "bielle/math/small_dense.h"

namespace bielle {

void SaddlePointFactors::resize(int n, int m) {
  L.setZero(n, n);
  Wt.setZero(n, m);
  Ginv.setZero(m, m);
  D.setZero(m);
}

void SaddlePoint::resize(int n, int m) {
  if (J_.rows() == m && J_.cols() == n) return;
  J_.setZero(m, n);
  M_.setZero(roundUpToLane(n) * n);
  W_.setZero(roundUpToLane(m) * n);
  G_llt_.setZero(roundUpToLane(m) * m);
  factors_.resize(n, m);
  for (MatrixXd* matrix : {&G_, &T1_, &T2_}) matrix->setZero(m, m);
  for (VectorXd* v : {&D_, &rhs_, &correction_}) v->setZero(m);
}

SaddlePointStatus SaddlePoint::factorize(const MatrixXd& M, const MatrixXd& J, const SaddlePointOptions& options) {
  options_ = options;
  const Eigen::Index n = J_.cols(), m = J_.rows();
  PaddedMap L = shapePadded(M_, n, n), W = shapePadded(W_, m, n), G_llt = shapePadded(G_llt_, m, m);
  L = M;
  clearPadding(L);
  if (!factorizeColumns(L, n)) return SaddlePointStatus::MassMatrixSingular;
  if (m == 0) return SaddlePointStatus::Ok;
  J_ = J;
  W = J;
  clearPadding(W);
  solveTransposedFromRight(L, W);
  D_ = W.rowwise().squaredNorm().cwiseSqrt();
  const double largest = D_.maxCoeff();
  for (Eigen::Index i = 0; i < m; ++i)  // a row that nothing moves, up to rounding, has no force
    D_[i] = D_[i] > 1e-11 * largest ? 1 / D_[i] : 0;
  W.array().colwise() *= D_.array();
  G_llt.setZero();
  clearPadding(G_llt);
  addProduct(m, m, n, 1, pad(W), {W.data(), W.outerStride(), 1}, pad(G_llt));
  G_ = G_llt;
  const double pivot = factorizeColumns(G_llt, m) ? G_llt.diagonal().array().square().minCoeff() : 0;
  redundant_ = !(pivot > options.direct_threshold);
  if (redundant_) {
    G_llt = G_;
    G_llt.diagonal().array() += options.proximal;
    factorizeColumns(G_llt, m);
  }
  return SaddlePointStatus::Ok;
}

void SaddlePoint::solve(const VectorXd& f, const VectorXd& g, VectorXd& a, VectorXd& lambda) {
  const PaddedMap L = shapePadded(M_, J_.cols(), J_.cols()), G_llt = shapePadded(G_llt_, J_.rows(), J_.rows());
  a = f;
  solveSmallCholesky(L, a);  // free accelerations
  if (J_.rows() == 0) return;
  rhs_ = -g;
  rhs_.noalias() -= J_ * a;
  rhs_.array() *= D_.array();
  lambda = rhs_;
  solveSmallCholesky(G_llt, lambda);
  const int iterations = redundant_ ? options_.max_iterations : 2;  // a direct solution is refined once
  for (int i = 1; i < iterations; ++i) {
    correction_ = rhs_;
    correction_.noalias() -= G_ * lambda;
    solveSmallCholesky(G_llt, correction_);
    lambda += correction_;  // Eq. (3)
    if (correction_.norm() <= options_.tolerance * lambda.norm()) break;
  }
  lambda.array() *= D_.array();
  a = f;
  a.noalias() += J_.transpose() * lambda;
  solveSmallCholesky(L, a);
}

// Inverse of D G D, or its pseudo-inverse as the limit of Eq. (3): with P = (DGD + mu I)^{-1} and E = mu P, the sum
// P (I + E + E^2 + ...) is doubled at each pass, P_{2k} = P_k + E^k P_k.
void SaddlePoint::updateInverse() {
  const Eigen::Index n = J_.cols(), m = J_.rows();
  factors_.L = shapePadded(M_, n, n);
  if (m == 0) return;
  copyTransposed(shapePadded(W_, m, n), factors_.Wt);
  factors_.D = D_;
  MatrixXd& Ginv = factors_.Ginv;
  Ginv.setIdentity();
  solveSmallCholesky(shapePadded(G_llt_, m, m), Ginv);
  if (!redundant_) return;
  constexpr int kDoublings = 3;  // eight proximal steps
  T1_ = options_.proximal * Ginv;
  for (int i = 0; i < kDoublings; ++i) {
    T2_ = Ginv;
    T2_.noalias() += T1_ * Ginv;
    Ginv.swap(T2_);
    T2_.noalias() = T1_ * T1_;
    T1_.swap(T2_);
  }
  // G P G loses what is not in the range of G, rounding of the size of 1/mu above all; one Newton-Schulz step then gains
  // what eigenvalues near mu still lack.
  T1_.noalias() = G_ * Ginv;
  T2_.noalias() = Ginv * T1_;
  T1_.noalias() = G_ * T2_;
  Ginv = 2 * T2_;
  Ginv.noalias() -= T2_ * T1_;
}

void SaddlePoint::solveDerivatives(MatrixRef X, MatrixRef dlambda) {
  const Eigen::Index columns = X.cols(), n = X.rows(), m = J_.rows(), padded = roundUpToLane(columns);
  if (X_.size() < padded * n || dlambda_t_.size() < padded * m) {
    X_.setZero(padded * n);
    dlambda_t_.setZero(padded * m);
  }
  PaddedMap Xt = shapePadded(X_, columns, n), dlambda_t = shapePadded(dlambda_t_, columns, m);
  copyTransposed(X, Xt);
  copyTransposed(dlambda, dlambda_t);
  clearPadding(Xt);
  clearPadding(dlambda_t);
  solveDerivatives(factors_, Xt, dlambda_t);
  copyTransposed(Xt, X);
  copyTransposed(dlambda_t, dlambda);
}

void SaddlePoint::solveDerivatives(const SaddlePointFactors& factors, PaddedMap Xt, PaddedMap dlambda_t) {
  // In the coordinates of L: W = D J L^{-T} and L^{-1} dID give J M^{-1} dID = D^{-1} W L^{-1} dID. All is done on
  // transposes, whose columns are long.
  const Eigen::Index columns = Xt.rows(), n = Xt.cols(), m = factors.D.size(), padded = roundUpToLane(columns);
  if (rhs_t_.size() < padded * m) rhs_t_.setZero(padded * m);
  PaddedMap rhs = shapePadded(rhs_t_, columns, m);
  const MatrixXd &L = factors.L, &Wt = factors.Wt;
  solveTransposedFromRight(L, Xt);
  for (Eigen::Index i = 0; i < m; ++i) rhs.col(i) = -factors.D[i] * dlambda_t.col(i);
  clearPadding(rhs);
  addProduct(columns, m, n, 1, pad(Xt), {Wt.data(), 1, n}, pad(rhs));
  // Symmetric but for rounding, which redundant rows magnify.
  setProduct(columns, m, m, pad(rhs), {factors.Ginv.data(), m, 1}, pad(dlambda_t));
  Xt *= -1;
  addProduct(columns, n, m, 1, pad(dlambda_t), {Wt.data(), n, 1}, pad(Xt));
  solveFromRight(L, Xt);
  for (Eigen::Index i = 0; i < m; ++i) dlambda_t.col(i) *= factors.D[i];
}

}  // namespace bielle
