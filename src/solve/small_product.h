#pragma once
// Matrix product for the small matrices of a sweep, a few ten rows and columns, where a general product spends as much
// on packing its operands as on multiplying them.
#include "bielle/math/types.h"

namespace bielle {

/// Rows that one vector register holds. Rows are worked on in full lanes.
constexpr Eigen::Index kLane = 8;
inline Eigen::Index roundUpToLane(Eigen::Index rows) { return (rows + kLane - 1) / kLane * kLane; }

/// Column-major matrix: entry (i, j) at data[i + j * stride]. Its rows can be read and written up to the next multiple
/// of kLane.
struct PaddedMatrix {
  double* data;
  Eigen::Index stride;
};

/// Any strided matrix: entry (k, j) at data[k * row_stride + j * col_stride].
struct StridedMatrix {
  const double* data;
  Eigen::Index row_stride, col_stride;
};

/// C += sign A B, C (rows x cols), A (rows x depth), B (depth x cols). What lies below `rows` in the last lane of C is
/// overwritten by something.
void addProduct(Eigen::Index rows, Eigen::Index cols, Eigen::Index depth, double sign, PaddedMatrix A, StridedMatrix B,
                PaddedMatrix C);

}  // namespace bielle
