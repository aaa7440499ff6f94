#include "dynamics/saddle_point.h"

#include <cmath>
#include <type_traits>

#include "math/small_dense.h"

namespace bielle {
namespace {

constexpr double kUnmoved = 1e-22;  // share of the largest |row|^2 below which a row is zero up to rounding

using LanesMap = Eigen::Map<MatrixX<Lanes>>;
using ConstLanesMap = Eigen::Map<const MatrixX<Lanes>>;

// Kernels that differ between the scalars: double keeps rows side by side in a register, Lanes a system in each lane.

void clear(PaddedMap A) { clearPadding(A); }
void clear(LanesMap) {}

// Cholesky factor in the lower triangle, in place. Returns whether all pivots (squares of its diagonal) exceed the
// threshold.
bool factorizeCholesky(PaddedMap A, double threshold) {
  return factorizeColumns(A, A.cols()) && (A.cols() == 0 || A.diagonal().array().square().minCoeff() > threshold);
}

LaneMask factorizeCholesky(LanesMap A, double threshold) {
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

// W = J L^{-T} in place.
void solveFactor(PaddedMap L, PaddedMap W) { solveTransposedFromRight(L, W); }

void solveFactor(LanesMap L, LanesMap W) {
  const Eigen::Index m = W.rows(), n = W.cols();
  const auto solveRows = [&](auto rows, Eigen::Index i) {
    for (Eigen::Index j = 0; j < n; ++j) {
      Lanes sums[rows];
      for (int r = 0; r < rows; ++r) sums[r] = W(i + r, j);
      for (Eigen::Index k = 0; k < j; ++k) {
        const Lanes factor = L(j, k);
        const Lanes* w = &W(i, k);
        for (int r = 0; r < rows; ++r) sums[r] -= factor * w[r];
      }
      const Lanes scale = 1 / L(j, j);
      for (int r = 0; r < rows; ++r) W(i + r, j) = sums[r] * scale;
    }
  };
  Eigen::Index i = 0;
  for (; i + 4 <= m; i += 4) solveRows(std::integral_constant<int, 4>(), i);
  for (; i < m; ++i) solveRows(std::integral_constant<int, 1>(), i);
}

// G = W W^T
void setGram(PaddedMap W, PaddedMap room, MatrixXd& G) {
  room.setZero();
  clearPadding(room);
  addProduct(W.rows(), W.rows(), W.cols(), 1, pad(W), {W.data(), W.outerStride(), 1}, pad(room));
  G = room;
}

void setGram(LanesMap W, LanesMap, MatrixX<Lanes>& G) {
  G.setZero();
  addSmallProduct(W, W.transpose(), G);
}

// x = L^{-1} x and x = L^{-T} x
template <typename Matrix, typename T>
void solveLower(const Matrix& L, VectorX<T>& x) {
  for (Eigen::Index j = 0; j < x.size(); ++j) {
    x[j] /= L(j, j);
    for (Eigen::Index r = j + 1; r < x.size(); ++r) x[r] -= L(r, j) * x[j];
  }
}

template <typename Matrix, typename T>
void solveLowerTransposed(const Matrix& L, VectorX<T>& x) {
  for (Eigen::Index j = x.size() - 1; j >= 0; --j) {
    T sum = x[j];
    for (Eigen::Index r = j + 1; r < x.size(); ++r) sum -= L(r, j) * x[r];
    x[j] = sum / L(j, j);
  }
}

template <typename Vector>
auto calcSquaredNorm(const Vector& x) {
  typename Vector::Scalar sum = 0;
  for (Eigen::Index i = 0; i < x.size(); ++i) sum += x[i] * x[i];
  return sum;
}

}  // namespace

void SaddlePointFactors::resize(int n, int m) {
  L.setZero(n, n);
  Wt.setZero(n, m);
  Ginv.setZero(m, m);
  D.setZero(m);
}

template <typename T>
void SaddlePointOf<T>::resize(int n, int m) {
  if (n_ == n && m_ == m) return;
  n_ = n;
  m_ = m;
  const auto allocate = [](Storage& storage, Eigen::Index rows, Eigen::Index cols) {
    if constexpr (std::is_same_v<T, double>)
      storage.setZero(roundUpToLane(rows) * cols);
    else
      storage.setZero(rows, cols);
  };
  allocate(L_, n, n);
  allocate(W_, m, n);
  allocate(G_llt_, m, m);
  for (MatrixX<T>* x : {&G_, &Ginv_, &P_, &T1_, &T2_}) x->setZero(m, m);
  for (VectorX<T>* x : {&D_, &rhs_, &y_, &correction_}) x->setZero(m);
}

template <typename T>
typename LogicOf<T>::Mask SaddlePointOf<T>::factorize(const MatrixX<T>& M, const MatrixX<T>& J,
                                                      const SaddlePointOptions& options) {
  using std::sqrt;
  options_ = options;
  auto L = view(L_, n_, n_), W = view(W_, m_, n_), G_llt = view(G_llt_, m_, m_);
  dependent_ = unmoved_ = T(0) < T(0);
  L = M;
  clear(L);
  const Mask regular = factorizeCholesky(L, 0);
  if (!any(regular) || m_ == 0) return regular;
  W = J;
  clear(W);
  solveFactor(L, W);
  T largest = 0;
  for (Eigen::Index i = 0; i < m_; ++i) {
    D_[i] = calcSquaredNorm(W.row(i));
    largest = select(D_[i] > largest, D_[i], largest);
  }
  for (Eigen::Index i = 0; i < m_; ++i) {
    const auto moved = D_[i] > kUnmoved * largest;
    unmoved_ = unmoved_ || !moved;
    D_[i] = select(moved, 1 / sqrt(select(moved, D_[i], T(1))), T(0));
    W.row(i) *= D_[i];
  }
  setGram(W, G_llt, G_);
  for (Eigen::Index i = 0; i < m_; ++i) G_(i, i) = select(D_[i] > T(0), G_(i, i), T(1));
  G_llt = G_;
  clear(G_llt);
  dependent_ = !factorizeCholesky(G_llt, options.direct_threshold);
  if (!any(dependent_)) return regular;
  for (Eigen::Index j = 0; j < m_; ++j) T1_.col(j) = G_llt.col(j);
  G_llt = G_;
  clear(G_llt);
  for (Eigen::Index i = 0; i < m_; ++i) G_llt(i, i) += options.proximal;
  factorizeCholesky(G_llt, 0);
  for (Eigen::Index j = 0; j < m_; ++j)
    for (Eigen::Index i = 0; i < m_; ++i) G_llt(i, j) = select(dependent_, G_llt(i, j), T1_(i, j));
  return regular;
}

template <typename T>
void SaddlePointOf<T>::solve(const VectorX<T>& f, const VectorX<T>& g, VectorX<T>& a, VectorX<T>& lambda) {
  const auto L = view(L_, n_, n_), W = view(W_, m_, n_), G_llt = view(G_llt_, m_, m_);
  a = f;
  solveLower(L, a);  // z
  if (m_ == 0) return solveLowerTransposed(L, a);
  rhs_ = -D_.cwiseProduct(g);
  addSmallProduct(W, a, rhs_, -1);
  y_ = rhs_;
  solveSmallCholesky(G_llt, y_);
  // A direct solution is refined once; Eq. (4) is iterated until nothing changes.
  Mask active = T(0) <= T(0);
  for (int i = 1; i < options_.max_iterations && any(active); ++i) {
    correction_ = rhs_;
    addSmallProduct(G_, y_, correction_, -1);
    solveSmallCholesky(G_llt, correction_);
    for (Eigen::Index r = 0; r < m_; ++r) y_[r] += select(active, correction_[r], T(0));
    const T tolerance = options_.tolerance * options_.tolerance;
    active = active && dependent_ && calcSquaredNorm(correction_) > tolerance * calcSquaredNorm(y_);
  }
  addSmallProductTransposed(W, y_, a);
  solveLowerTransposed(L, a);
  lambda = D_.cwiseProduct(y_);
}

template <typename T>
void SaddlePointOf<T>::updateInverse() {
  if (m_ == 0) return;
  Ginv_.setIdentity();
  solveSmallCholesky(view(G_llt_, m_, m_), Ginv_);
  if (any(dependent_)) improveInverse();
}

// With P = (W W^T + mu I)^{-1} and E = mu P, each pass doubles the terms of P (I + E + E^2 + ...):
// P_{2k} = P_k + E^k P_k.
template <typename T>
void SaddlePointOf<T>::improveInverse() {
  const auto multiply = [](const MatrixX<T>& A, const MatrixX<T>& B, MatrixX<T>& out) {
    out.setZero();
    addSmallProduct(A, B, out);
  };
  MatrixX<T>& P = P_;
  P = Ginv_;
  constexpr int kDoublings = 3;  // eight proximal steps
  T1_ = options_.proximal * P;
  for (int i = 0; i < kDoublings; ++i) {
    multiply(T1_, P, T2_);
    P += T2_;
    multiply(T1_, T1_, T2_);
    T1_.swap(T2_);
  }
  // P G P removes components outside the range of G, above all rounding of the size of 1/mu; one Newton-Schulz step
  // then corrects eigenvalues near mu.
  multiply(G_, P, T1_);
  multiply(P, T1_, T2_);
  multiply(G_, T2_, T1_);
  multiply(T2_, T1_, P);
  for (Eigen::Index j = 0; j < m_; ++j)
    for (Eigen::Index i = 0; i < m_; ++i) Ginv_(i, j) = select(dependent_, 2 * T2_(i, j) - P(i, j), Ginv_(i, j));
}

template class SaddlePointOf<double>;
template class SaddlePointOf<Lanes>;

void SaddlePoint::updateInverse() {
  SaddlePointOf<double>::updateInverse();
  factors_.L = L();
  factors_.Wt.resize(L().rows(), W().rows());
  copyTransposed(W(), factors_.Wt);
  factors_.Ginv = Ginv();
  factors_.D = D();
}

void SaddlePoint::solveDerivatives(MatrixRef X, MatrixRef dlambda) {
  const Eigen::Index columns = X.cols(), n = X.rows(), m = dlambda.rows(), padded = roundUpToLane(columns);
  if (X_.size() < padded * n || dlambda_t_.size() < padded * m) {
    X_.setZero(padded * n);
    dlambda_t_.setZero(padded * m);
  }
  PaddedMap Xt = shapePadded(X_, columns, n), dlambda_t = shapePadded(dlambda_t_, columns, m);
  copyTransposed(X, Xt);
  copyTransposed(dlambda, dlambda_t);
  clearPadding(Xt);
  clearPadding(dlambda_t);
  bielle::solveDerivatives(factors_, Xt, dlambda_t, room_);
  copyTransposed(Xt, X);
  copyTransposed(dlambda_t, dlambda);
}

void solveDerivatives(const SaddlePointFactors& factors, PaddedMap Xt, PaddedMap dlambda_t, VectorXd& room) {
  // J M^{-1} dID = D^{-1} W L^{-1} dID. It operates on transposes, whose columns are long.
  const Eigen::Index columns = Xt.rows(), n = Xt.cols(), m = factors.D.size(), padded = roundUpToLane(columns);
  if (room.size() < padded * m) room.setZero(padded * m);
  PaddedMap rhs = shapePadded(room, columns, m);
  const MatrixXd &L = factors.L, &Wt = factors.Wt;
  solveTransposedFromRight(L, Xt);
  for (Eigen::Index i = 0; i < m; ++i) rhs.col(i) = -factors.D[i] * dlambda_t.col(i);
  clearPadding(rhs);
  addProduct(columns, m, n, 1, pad(Xt), {Wt.data(), 1, n}, pad(rhs));
  // Ginv is symmetric up to rounding, which redundant rows magnify.
  setProduct(columns, m, m, pad(rhs), {factors.Ginv.data(), m, 1}, pad(dlambda_t));
  Xt *= -1;
  addProduct(columns, n, m, 1, pad(dlambda_t), {Wt.data(), n, 1}, pad(Xt));
  solveFromRight(L, Xt);
  for (Eigen::Index i = 0; i < m; ++i) dlambda_t.col(i) *= factors.D[i];
}

}  // namespace bielle
