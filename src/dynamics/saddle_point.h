#pragma once
/// \file The symmetric system behind constrained dynamics (the paper's eq. 4), with rows that may be redundant.
///
///     M a - J^T lambda = f,     J a = -g                                                                           (1)
///     G lambda = -g - J M^{-1} f,     G = J M^{-1} J^T                                                             (2)
///
/// With L L^T = M, z = L^{-1} f, D = diag(G)^{-1/2} and W = D J L^{-T} it reads
///
///     (W W^T) y = -D g - W z,     lambda = D y,     a = L^{-T} (z + W^T y).                                        (3)
///
/// W W^T = D G D has a unit diagonal. It is factorised directly where it is well conditioned; otherwise (3) is solved
/// by proximal iterations (Carpentier, Budhiraja, Mansard, RSS 2021),
///
///     y <- y + (W W^T + mu I)^{-1} (rhs - W W^T y),                                                                (4)
///
/// which converge to the least-squares, minimum-norm y. Neither a nor J^T lambda depends on the choice of rows. Rows
/// that no coordinate moves (zero rows) have no force.
///
/// Derivatives along any argument: with dID the derivative of M a - J^T lambda - f and dc that of J a + g, both at
/// fixed a and lambda,
///
///     dlambda = G^+ (J M^{-1} dID - dc),     da = M^{-1} (J^T dlambda - dID).                                      (5)
///
/// With redundant rows dlambda is determined up to the null space of J^T.
#include "math/lane_product.h"

namespace bielle {

struct SaddlePointOptions {
  double proximal = 1e-7;          ///< mu of Eq. (4), relative to the unit diagonal of W W^T
  int max_iterations = 30;         ///< of Eq. (4)
  double tolerance = 1e-13;        ///< stop when a correction is below this, relative to the solution
  double direct_threshold = 1e-5;  ///< smallest pivot of W W^T for which it is factorised directly
};

/// The factors of a system that Eq. (5) needs.
struct SaddlePointFactors {
  MatrixXd L;     ///< n x n, lower triangle: Cholesky factor of M
  MatrixXd Wt;    ///< n x m, W^T
  MatrixXd Ginv;  ///< m x m, (pseudo-)inverse of W W^T
  VectorXd D;     ///< m
  void resize(int n, int m);
};
/// Eq. (5) for Xt (k x n), which holds dID^T and becomes da^T, and dlambda_t (k x m), which holds dc^T and becomes
/// dlambda^T; the padding of both is finite. `room` is memory that grows to k x m.
void solveDerivatives(const SaddlePointFactors& factors, PaddedMap Xt, PaddedMap dlambda_t, VectorXd& room);

/// T is double, or Lanes for several systems of one size. Matrices of double have their rows padded to full registers;
/// those of Lanes need no padding.
template <typename T>
class SaddlePointOf {
 public:
  using Mask = typename LogicOf<T>::Mask;

  /// Sizes the memory for n coordinates and m rows; no allocation when the sizes stay.
  void resize(int n, int m);
  /// \param M n x n symmetric positive definite   \param J m x n
  /// \returns false where M is not positive definite
  Mask factorize(const MatrixX<T>& M, const MatrixX<T>& J, const SaddlePointOptions& options = {});
  /// Eq. (1) for f (n), g (m).
  void solve(const VectorX<T>& f, const VectorX<T>& g, VectorX<T>& a, VectorX<T>& lambda);
  /// Inverse of W W^T, or its pseudo-inverse as the limit of Eq. (4), in Ginv().
  void updateInverse();
  /// Whether some row is redundant: it is zero or follows from the others.
  Mask isRedundant() const { return dependent_ || unmoved_; }

  // Factors of the last system. L(): lower triangle; Ginv(): needs updateInverse().
  auto L() const { return view(L_, n_, n_); }
  auto W() const { return view(W_, m_, n_); }
  const MatrixX<T>& Ginv() const { return Ginv_; }
  const VectorX<T>& D() const { return D_; }

 private:
  using Storage = std::conditional_t<std::is_same_v<T, double>, VectorXd, MatrixX<T>>;
  static auto view(const Storage& storage, Eigen::Index rows, Eigen::Index cols) {
    if constexpr (std::is_same_v<T, double>)
      return ConstPaddedMap(storage.data(), rows, cols, Eigen::OuterStride<>(roundUpToLane(rows)));
    else
      return Eigen::Map<const MatrixX<T>>(storage.data(), rows, cols);
  }
  static auto view(Storage& storage, Eigen::Index rows, Eigen::Index cols) {
    if constexpr (std::is_same_v<T, double>)
      return shapePadded(storage, rows, cols);
    else
      return Eigen::Map<MatrixX<T>>(storage.data(), rows, cols);
  }
  void improveInverse();

  SaddlePointOptions options_;
  Eigen::Index n_ = 0, m_ = 0;
  Storage L_, W_;           // n x n, m x n
  Storage G_llt_;           // m x m: Cholesky factor of W W^T, with mu on its diagonal where rows depend on others
  MatrixX<T> G_, Ginv_;     // m x m
  MatrixX<T> P_, T1_, T2_;  // m x m, scratch
  VectorX<T> D_, rhs_, y_, correction_;
  Mask dependent_ = T(0) < T(0);  // some rows follow from others: Eq. (4)
  Mask unmoved_ = T(0) < T(0);    // some row is zero
};

/// One system, with its derivatives.
class SaddlePoint : public SaddlePointOf<double> {
 public:
  /// Prepares solveDerivatives().
  void updateInverse();
  /// Eq. (5): X (n x k) holds dID and becomes da; dlambda (m x k) holds dc and becomes dlambda.
  void solveDerivatives(MatrixRef X, MatrixRef dlambda);

 private:
  SaddlePointFactors factors_;
  VectorXd X_, dlambda_t_, room_;  // transposes within solveDerivatives(), padded
};

}  // namespace bielle
