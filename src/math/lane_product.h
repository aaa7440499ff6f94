#pragma once
/// \file Products of matrices with a few tens of rows and columns, where a general product spends as much time on
/// packing its operands as on multiplying them.
#include <algorithm>

#include "bielle/math/types.h"
#include "math/lanes.h"

namespace bielle {

/// Rows are processed in full lanes.
inline Eigen::Index roundUpToLane(Eigen::Index rows) { return (rows + kLane - 1) / kLane * kLane; }

/// Column-major matrix: entry (i, j) at data[i + j * stride]. Its rows can be read and written up to the next multiple
/// of kLane.
struct PaddedMatrix {
  double* data;
  Eigen::Index stride;
};

struct ConstPaddedMatrix {
  ConstPaddedMatrix(const double* d, Eigen::Index s) : data(d), stride(s) {}
  ConstPaddedMatrix(const PaddedMatrix& A) : data(A.data), stride(A.stride) {}
  const double* data;
  Eigen::Index stride;
};

/// Any strided matrix: entry (k, j) at data[k * row_stride + j * col_stride].
struct StridedMatrix {
  const double* data;
  Eigen::Index row_stride, col_stride;
};

/// C += sign A B, C (rows x cols), A (rows x depth), B (depth x cols). Entries below `rows` in the last lane of C
/// become undefined.
void addProduct(Eigen::Index rows, Eigen::Index cols, Eigen::Index depth, double sign, ConstPaddedMatrix A,
                StridedMatrix B, PaddedMatrix C);

/// C = A B, likewise; C may be uninitialized.
void setProduct(Eigen::Index rows, Eigen::Index cols, Eigen::Index depth, ConstPaddedMatrix A, StridedMatrix B,
                PaddedMatrix C);

/// The beginning of a buffer as a matrix whose rows are padded to full lanes.
using PaddedMap = Eigen::Map<MatrixXd, 0, Eigen::OuterStride<>>;
using ConstPaddedMap = Eigen::Map<const MatrixXd, 0, Eigen::OuterStride<>>;
/// A transposed part of such a matrix.
using RowMatrixMap = Eigen::Map<RowMatrixXd, 0, Eigen::OuterStride<>>;
using ConstRowMatrixMap = Eigen::Map<const RowMatrixXd, 0, Eigen::OuterStride<>>;
inline PaddedMap shapePadded(VectorXd& buffer, Eigen::Index rows, Eigen::Index cols) {
  return PaddedMap(buffer.data(), rows, cols, Eigen::OuterStride<>(roundUpToLane(rows)));
}
inline PaddedMatrix pad(PaddedMap A, Eigen::Index row = 0, Eigen::Index col = 0) {
  return {A.data() + row + col * A.outerStride(), A.outerStride()};
}
inline ConstPaddedMatrix pad(ConstPaddedMap A, Eigen::Index row = 0, Eigen::Index col = 0) {
  return {A.data() + row + col * A.outerStride(), A.outerStride()};
}
/// Padding rows take part in products, so they must be initialized.
void clearPadding(PaddedMap A);

/// H(i, j) += sign sum_k A(i, k) B(j, k) for i >= j >= begin, k < depth. Full lanes: entries above the diagonal change.
void addLowerProduct(Eigen::Index begin, Eigen::Index depth, double sign, ConstPaddedMatrix A, ConstPaddedMatrix B,
                     PaddedMap H);
/// H(i, j) = sum_k A(i, k) B(j, k) for i >= j, k < depth, likewise; H may be uninitialized.
void setLowerProduct(Eigen::Index depth, ConstPaddedMatrix A, ConstPaddedMatrix B, PaddedMap H);

/// Cholesky elimination of the first `num` unknowns of a symmetric H, of which the lower triangle is read: their
/// columns become L over Y^T, the rest of H is unchanged. False if a pivot is not positive.
bool factorizeColumns(PaddedMap H, Eigen::Index num);
/// X L^{-T} and X L^{-1} in place, L the lower triangle of a square matrix.
void solveTransposedFromRight(ConstMatrixRef L, PaddedMap X);
void solveFromRight(ConstMatrixRef L, PaddedMap X);

/// to = from^T, by blocks: a strided copy of whole rows costs much more.
template <class A, class B>
void copyTransposed(const A& from, B&& to) {
  constexpr Eigen::Index kBlock = 8;
  for (Eigen::Index c = 0; c < from.cols(); c += kBlock) {
    for (Eigen::Index r = 0; r < from.rows(); r += kBlock) {
      const Eigen::Index width = std::min(kBlock, from.cols() - c), height = std::min(kBlock, from.rows() - r);
      if (width == kBlock && height == kBlock) {
        to.template block<kBlock, kBlock>(c, r) = from.template block<kBlock, kBlock>(r, c).transpose();
      } else {
        to.block(c, r, width, height) = from.block(r, c, height, width).transpose();
      }
    }
  }
}

/// Copies the lower triangle of a square matrix to the upper one.
void copyLowerToUpper(MatrixXd& A);

}  // namespace bielle
