#pragma once
/// \file The symmetric system behind constrained dynamics (the paper's eq. 4), with rows that may be redundant.
///
///     M a - J^T lambda = f,     J a = -g                                                                             (1)
///     G lambda = -g - J M^{-1} f,     G = J M^{-1} J^T                                                               (2)
///
/// With D = diag(G)^{-1/2} the system (D G D) y = D rhs is factorised directly where it is well conditioned, and solved
/// by proximal iterations (Carpentier, Budhiraja, Mansard, RSS 2021) otherwise,
///
///     y <- y + (D G D + mu I)^{-1} (D rhs - D G D y),                                                                (3)
///
/// which converge to the least-squares, minimum-norm y; lambda = D y. Neither a nor J^T lambda depends on the choice of
/// rows.
///
/// Derivatives along any argument: with dID the derivative of M a - J^T lambda - f and dc that of J a + g, both at
/// fixed a and lambda,
///
///     dlambda = G^+ (J M^{-1} dID - dc),     da = M^{-1} (J^T dlambda - dID).                                        (4)
///
/// With redundant rows dlambda is right up to the null space of J^T.
#include "bielle/math/lane_product.h"

namespace bielle {

struct SaddlePointOptions {
  double proximal = 1e-7;          ///< mu of Eq. (3), relative to the unit diagonal of D G D
  int max_iterations = 30;         ///< of Eq. (3)
  double tolerance = 1e-13;        ///< stop when a correction is below this, relative to the solution
  double direct_threshold = 1e-5;  ///< smallest pivot of D G D for which it is factorised directly
};

enum class SaddlePointStatus { Ok, MassMatrixSingular };

/// What Eq. (4) needs of a factorised system.
struct SaddlePointFactors {
  MatrixXd L;     ///< n x n, lower triangle: Cholesky factor of M
  MatrixXd Wt;    ///< n x m, L^{-1} J^T D
  MatrixXd Ginv;  ///< m x m, (pseudo-)inverse of D G D
  VectorXd D;     ///< m
  void resize(int n, int m);
};

class SaddlePoint {
 public:
  /// Sizes the memory for n coordinates and m rows; no allocation when the sizes stay.
  void resize(int n, int m);
  /// \param M n x n symmetric positive definite   \param J m x n
  SaddlePointStatus factorize(const MatrixXd& M, const MatrixXd& J, const SaddlePointOptions& options = {});
  /// Eq. (1) for f (n), g (m).
  void solve(const VectorXd& f, const VectorXd& g, VectorXd& a, VectorXd& lambda);
  /// Prepares solveDerivatives().
  void updateInverse();
  /// Eq. (4): X (n x k) holds dID and becomes da; dlambda (m x k) holds dc and becomes dlambda.
  void solveDerivatives(MatrixRef X, MatrixRef dlambda);
  /// The same for another system of the same sizes, and for X^T (k x n) and dlambda^T (k x m), padding finite.
  void solveDerivatives(const SaddlePointFactors& factors, PaddedMap Xt, PaddedMap dlambda_t);
  /// Of the last system; needs updateInverse().
  const SaddlePointFactors& factors() const { return factors_; }
  /// Whether the rows needed Eq. (3).
  bool isRedundant() const { return redundant_; }

 private:
  SaddlePointOptions options_;
  MatrixXd J_;      ///< m x n
  VectorXd M_;      ///< n x n, padded: L, the Cholesky factor of M
  VectorXd W_;      ///< m x n, padded: D J L^{-T}
  MatrixXd G_;      ///< m x m: D G D
  VectorXd G_llt_;  ///< m x m, padded: its Cholesky factor
  SaddlePointFactors factors_;
  VectorXd D_, rhs_, correction_;
  MatrixXd T1_, T2_;
  VectorXd X_, rhs_t_, dlambda_t_;  ///< transposes within solveDerivatives(), padded
  bool redundant_ = false;
};

}  // namespace bielle
