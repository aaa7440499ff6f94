#include "math/linear_program.h"

#include <cmath>
#include <vector>

namespace bielle {
namespace {

constexpr double kPivot = 1e-9;  // smaller entries are rounding
constexpr double kOff = 1e-9;    // of A x = b, over 1 + sum |b|
constexpr int kMostPivots = 10000;

// Rows of the equations, then that of the costs; columns of the unknowns, then b.
class Tableau {
 public:
  Tableau(ConstMatrixRef A, ConstVectorRef b) : size_(A.cols()), basis_(A.rows()) {
    const Eigen::Index m = A.rows();
    T_.setZero(m + 1, size_ + m + 1);
    for (Eigen::Index i = 0; i < m; ++i) {
      const double sign = b[i] < 0 ? -1 : 1;
      T_.row(i).head(size_) = sign * A.row(i);
      T_(i, size_ + i) = 1;
      T_(i, size_ + m) = sign * b[i];
      basis_[i] = size_ + i;
    }
  }

  // How far A x = b is off, at least.
  std::optional<double> approach() {
    const Eigen::Index m = T_.rows() - 1;
    T_.row(m) = -T_.topRows(m).colwise().sum();
    T_.row(m).segment(size_, m).setZero();
    if (!descend()) return {};
    return -T_(m, T_.cols() - 1);
  }

  bool minimize(ConstVectorRef c) {
    const Eigen::Index m = T_.rows() - 1;
    // Unknowns of the first phase that are left, at zero, make place; where none can, the row depends on others.
    for (Eigen::Index i = 0; i < m; ++i) {
      if (basis_[i] < size_) continue;
      Eigen::Index column = 0;
      if (size_ > 0 && T_.row(i).head(size_).cwiseAbs().maxCoeff(&column) > kPivot) pivot(i, column);
    }
    T_.row(m).setZero();
    T_.row(m).head(size_) = c.transpose();
    for (Eigen::Index i = 0; i < m; ++i)
      if (basis_[i] < size_) T_.row(m) -= c[basis_[i]] * T_.row(i);
    return descend();
  }

  VectorXd solution() const {
    VectorXd x = VectorXd::Zero(size_);
    for (Eigen::Index i = 0; i + 1 < T_.rows(); ++i)
      if (basis_[i] < size_) x[basis_[i]] = T_(i, T_.cols() - 1);
    return x;
  }

 private:
  bool descend() {
    const Eigen::Index m = T_.rows() - 1, last = T_.cols() - 1;
    for (int i = 0; i < kMostPivots; ++i) {
      Eigen::Index column = 0, row = -1;
      while (column < size_ && T_(m, column) >= -kPivot) ++column;
      if (column == size_) return true;
      for (Eigen::Index k = 0; k < m; ++k) {
        if (T_(k, column) <= kPivot) continue;
        if (row < 0) {
          row = k;
          continue;
        }
        const double ratio = T_(k, last) / T_(k, column), least = T_(row, last) / T_(row, column);
        if (ratio < least || (ratio == least && basis_[k] < basis_[row])) row = k;
      }
      if (row < 0) return false;
      pivot(row, column);
    }
    return false;
  }

  void pivot(Eigen::Index row, Eigen::Index column) {
    T_.row(row) /= T_(row, column);
    for (Eigen::Index k = 0; k < T_.rows(); ++k)
      if (k != row) T_.row(k) -= T_(k, column) * T_.row(row).eval();
    basis_[row] = column;
  }

  Eigen::Index size_;
  RowMatrixXd T_;
  std::vector<Eigen::Index> basis_;
};

}  // namespace

std::optional<VectorXd> solveLinearProgram(ConstMatrixRef A, ConstVectorRef b, ConstVectorRef c) {
  Tableau tableau(A, b);
  const std::optional<double> off = tableau.approach();
  if (!off || !(*off <= kOff * (1 + b.cwiseAbs().sum())) || !tableau.minimize(c)) return {};
  return tableau.solution();
}

}  // namespace bielle
