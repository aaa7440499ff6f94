#include "contact_system.h"

#include <type_traits>

#include "bielle/math/small_dense.h"

namespace bielle {
namespace {

constexpr double kUnmoved = 1e-22;  // share of the largest |row|^2 below which nothing moves a row, as in SaddlePoint

// Cholesky factor in the lower triangle of A, in place. Tells whether all pivots are above the threshold.
LaneMask factorizeCholesky(MatrixX<Lanes>& A, double threshold) {
  const Eigen::Index n = A.rows();
  LaneMask regular = Lanes(0) <= Lanes(0);
  for (Eigen::Index j = 0; j < n; ++j) {
    const auto subtract = [&](auto rows, Eigen::Index i) {
      Lanes sums[rows];
      for (int r = 0; r < rows; ++r) sums[r] = A(i + r, j);
      for (Eigen::Index k = 0; k < j; ++k) {
        const Lanes factor = A(j, k);
        const Lanes* a = &A(i, k);
        for (int r = 0; r < rows; ++r) sums[r] -= a[r] * factor;
      }
      for (int r = 0; r < rows; ++r) A(i + r, j) = sums[r];
    };
    Eigen::Index i = j;
    for (; i + 4 <= n; i += 4) subtract(std::integral_constant<int, 4>(), i);
    for (; i < n; ++i) subtract(std::integral_constant<int, 1>(), i);
    regular = regular && A(j, j) > Lanes(threshold);
    const Lanes scale = 1 / sqrt(A(j, j));
    for (Eigen::Index r = j; r < n; ++r) A(r, j) *= scale;
  }
  return regular;
}

// X = L^{-1} X, four columns at a time.
void solveLower(const MatrixX<Lanes>& L, MatrixX<Lanes>& X) {
  const Eigen::Index n = X.rows();
  const auto solveColumns = [&](auto cols, Eigen::Index c) {
    for (Eigen::Index j = 0; j < n; ++j) {
      Lanes sums[cols];
      for (int i = 0; i < cols; ++i) sums[i] = X(j, c + i);
      for (Eigen::Index k = 0; k < j; ++k)
        for (int i = 0; i < cols; ++i) sums[i] -= L(j, k) * X(k, c + i);
      const Lanes scale = 1 / L(j, j);
      for (int i = 0; i < cols; ++i) X(j, c + i) = sums[i] * scale;
    }
  };
  Eigen::Index c = 0;
  for (; c + 4 <= X.cols(); c += 4) solveColumns(std::integral_constant<int, 4>(), c);
  for (; c < X.cols(); ++c) solveColumns(std::integral_constant<int, 1>(), c);
}

void solveLower(const MatrixX<Lanes>& L, VectorX<Lanes>& x) {
  for (Eigen::Index j = 0; j < x.size(); ++j) {
    x[j] /= L(j, j);
    for (Eigen::Index r = j + 1; r < x.size(); ++r) x[r] -= L(r, j) * x[j];
  }
}

void solveLowerTransposed(const MatrixX<Lanes>& L, VectorX<Lanes>& x) {
  for (Eigen::Index j = x.size() - 1; j >= 0; --j) {
    Lanes sum = x[j];
    for (Eigen::Index r = j + 1; r < x.size(); ++r) sum -= L(r, j) * x[r];
    x[j] = sum / L(j, j);
  }
}

}  // namespace

ContactSystem::ContactSystem(int size, int rows) {
  for (MatrixX<Lanes>* x : {&M, &L}) x->setZero(size, size);
  for (MatrixX<Lanes>* x : {&Jt, &Wt}) x->setZero(size, rows);
  for (VectorX<Lanes>* x : {&f, &ydd}) x->setZero(size);
  for (VectorX<Lanes>* x : {&gamma, &absent, &lambda, &D, &y_, &rhs_, &correction_}) x->setZero(rows);
  for (MatrixX<Lanes>* x : {&Ginv, &G_, &G_llt_}) x->setZero(rows, rows);
}

LaneMask ContactSystem::solve() {
  const Eigen::Index m = gamma.size();
  L = M;
  Wt = Jt;
  LaneMask regular = factorizeCholesky(L, 0);
  solveLower(L, Wt);
  G_.setZero();
  addSmallProductTransposed(Wt, Wt, G_);
  Lanes largest = 0;
  for (Eigen::Index i = 0; i < m; ++i) largest = select(G_(i, i) > largest, G_(i, i), largest);
  for (Eigen::Index i = 0; i < m; ++i) {
    regular = regular && G_(i, i) + absent[i] > kUnmoved * largest;
    D[i] = 1 / sqrt(G_(i, i) + absent[i]);
    for (Eigen::Index k = 0; k < Wt.rows(); ++k) Wt(k, i) *= D[i];
  }
  for (Eigen::Index j = 0; j < m; ++j) {
    for (Eigen::Index i = 0; i < m; ++i) G_(i, j) *= D[i] * D[j];
    G_(j, j) += absent[j];
  }
  G_llt_ = G_;
  regular = regular && factorizeCholesky(G_llt_, SaddlePointOptions().direct_threshold);

  ydd = f;
  solveLower(L, ydd);  // z
  rhs_ = -D.cwiseProduct(gamma);
  addSmallProductTransposed(Wt, ydd, rhs_, -1);
  y_ = rhs_;
  solveSmallCholesky(G_llt_, y_);
  correction_ = rhs_;  // a direct solution is refined once
  addSmallProduct(G_, y_, correction_, -1);
  solveSmallCholesky(G_llt_, correction_);
  y_ += correction_;
  addSmallProduct(Wt, y_, ydd);
  solveLowerTransposed(L, ydd);
  lambda = D.cwiseProduct(y_);
  Ginv.setIdentity();
  solveSmallCholesky(G_llt_, Ginv);
  return regular;
}

}  // namespace bielle
