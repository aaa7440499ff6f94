#include "bielle/dynamics/saddle_point.h"

#include <cmath>

#include "bielle/math/small_dense.h"

namespace bielle {

void SaddlePoint::resize(int n, int m) {
  if (J_.rows() == m && J_.cols() == n) return;
  J_.setZero(m, n);
  W_.setZero(m, n);
  for (MatrixXd* matrix : {&G_, &Ginv_, &T1_, &T2_}) matrix->setZero(m, m);
  for (VectorXd* v : {&D_, &rhs_, &correction_}) v->setZero(m);
  // Of something, so that their status is not read before it is set when they are copied.
  M_llt_.compute(MatrixXd::Identity(n, n));
  G_llt_.compute(MatrixXd::Identity(m, m));
}

SaddlePointStatus SaddlePoint::factorize(const MatrixXd& M, const MatrixXd& J, const SaddlePointOptions& options) {
  options_ = options;
  M_llt_.compute(M);
  if (M_llt_.info() != Eigen::Success) return SaddlePointStatus::MassMatrixSingular;
  if (J.rows() == 0) return SaddlePointStatus::Ok;
  J_ = J;
  W_ = J;
  solveTransposedFromRight(M_llt_.matrixLLT(), W_);
  const double largest = std::sqrt(W_.rowwise().squaredNorm().maxCoeff());
  for (Eigen::Index i = 0; i < W_.rows(); ++i) {
    const double norm = W_.row(i).norm();
    D_[i] = norm > 1e-11 * largest ? 1 / norm : 0;  // a row that nothing moves, up to rounding, has no force
    W_.row(i) *= D_[i];
  }
  G_.noalias() = W_ * W_.transpose();
  G_llt_.compute(G_);
  const double pivot = G_llt_.info() == Eigen::Success ? G_llt_.matrixLLT().diagonal().array().square().minCoeff() : 0;
  redundant_ = !(pivot > options.direct_threshold);
  if (redundant_) {
    T1_ = G_;
    T1_.diagonal().array() += options.proximal;
    G_llt_.compute(T1_);
  }
  return SaddlePointStatus::Ok;
}

void SaddlePoint::solve(const VectorXd& f, const VectorXd& g, VectorXd& a, VectorXd& lambda) {
  a = f;
  M_llt_.solveInPlace(a);  // free accelerations
  if (J_.rows() == 0) return;
  rhs_ = -g;
  rhs_.noalias() -= J_ * a;
  rhs_.array() *= D_.array();
  lambda = rhs_;
  G_llt_.solveInPlace(lambda);
  const int iterations = redundant_ ? options_.max_iterations : 2;  // a direct solution is refined once
  for (int i = 1; i < iterations; ++i) {
    correction_ = rhs_;
    correction_.noalias() -= G_ * lambda;
    G_llt_.solveInPlace(correction_);
    lambda += correction_;  // Eq. (3)
    if (correction_.norm() <= options_.tolerance * lambda.norm()) break;
  }
  lambda.array() *= D_.array();
  a = f;
  a.noalias() += J_.transpose() * lambda;
  M_llt_.solveInPlace(a);
}

// Inverse of D G D, or its pseudo-inverse as the limit of Eq. (3): with P = (DGD + mu I)^{-1} and E = mu P, the sum
// P (I + E + E^2 + ...) is doubled at each pass, P_{2k} = P_k + E^k P_k.
void SaddlePoint::updateInverse() {
  if (J_.rows() == 0) return;
  Ginv_.setIdentity();
  G_llt_.solveInPlace(Ginv_);
  if (!redundant_) return;
  constexpr int kDoublings = 3;  // eight proximal steps
  T1_ = options_.proximal * Ginv_;
  for (int i = 0; i < kDoublings; ++i) {
    T2_ = Ginv_;
    T2_.noalias() += T1_ * Ginv_;
    Ginv_.swap(T2_);
    T2_.noalias() = T1_ * T1_;
    T1_.swap(T2_);
  }
  // G P G loses what is not in the range of G, rounding of the size of 1/mu above all; one Newton-Schulz step then gains
  // what eigenvalues near mu still lack.
  T1_.noalias() = G_ * Ginv_;
  T2_.noalias() = Ginv_ * T1_;
  T1_.noalias() = G_ * T2_;
  Ginv_ = 2 * T2_;
  Ginv_.noalias() -= T2_ * T1_;
}

void SaddlePoint::solveDerivatives(MatrixRef X, MatrixRef dlambda) {
  if (J_.rows() == 0) {
    X *= -1;
    M_llt_.solveInPlace(X);
    return;
  }
  // In the coordinates of L: W = D J L^{-T} and L^{-1} dID give J M^{-1} dID = D^{-1} W L^{-1} dID. All is done on
  // transposes, whose columns are long.
  const Eigen::Index columns = X.cols();
  if (X_.rows() < columns || X_.cols() != X.rows() || rhs_t_.cols() != J_.rows()) {
    X_.resize(columns, X.rows());
    for (MatrixXd* m : {&rhs_t_, &dlambda_t_}) m->resize(columns, J_.rows());
  }
  auto Xt = X_.topRows(columns), rhs = rhs_t_.topRows(columns), dlambda_t = dlambda_t_.topRows(columns);
  Xt = X.transpose();
  solveTransposedFromRight(M_llt_.matrixLLT(), Xt);
  for (Eigen::Index i = 0; i < D_.size(); ++i) rhs.col(i) = -D_[i] * dlambda.row(i).transpose();
  rhs.noalias() += Xt * W_.transpose();
  dlambda_t.noalias() = rhs * Ginv_.transpose();  // symmetric but for rounding, which redundant rows magnify
  Xt *= -1;
  Xt.noalias() += dlambda_t * W_;
  solveFromRight(M_llt_.matrixLLT(), Xt);
  X = Xt.transpose();
  for (Eigen::Index i = 0; i < D_.size(); ++i) dlambda.row(i) = D_[i] * dlambda_t.col(i).transpose();
}

}  // namespace bielle
