#pragma once
/// \file Dense decompositions of matrices of any size, and the products within them, compiled once (decompositions.cpp): one of
/// them takes the compiler ten seconds, and the linker keeps one copy of those that several rooms compile, of whichever is
/// first, not of the fastest.
#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>
#include <Eigen/SVD>

#include "bielle/math/types.h"

// BIELLE_DENSE(EXTERN): the instantiations, with `extern` where they are only declared.
#define BIELLE_DENSE(EXTERN)                                                                                         \
  EXTERN template class JacobiSVD<MatrixXd>;                                                                         \
  EXTERN template class ColPivHouseholderQR<MatrixXd>;                                                               \
  EXTERN template class CompleteOrthogonalDecomposition<MatrixXd>;                                                   \
  EXTERN template class HouseholderQR<MatrixXd>;                                                                     \
  EXTERN template class FullPivLU<MatrixXd>;                                                                         \
  EXTERN template class PartialPivLU<MatrixXd>;                                                                      \
  EXTERN template class LLT<MatrixXd>;                                                                               \
  EXTERN template class LDLT<MatrixXd>;                                                                              \
  EXTERN template class SelfAdjointEigenSolver<MatrixXd>;                                                            \
  EXTERN template class HouseholderSequence<MatrixXd, VectorXd>;                                                     \
  namespace internal {                                                                                               \
  EXTERN template struct general_matrix_matrix_product<Index, double, ColMajor, false, double, ColMajor, false,      \
                                                       ColMajor, 1>;                                                 \
  EXTERN template struct general_matrix_matrix_product<Index, double, ColMajor, false, double, RowMajor, false,      \
                                                       ColMajor, 1>;                                                 \
  EXTERN template struct general_matrix_matrix_product<Index, double, RowMajor, false, double, ColMajor, false,      \
                                                       ColMajor, 1>;                                                 \
  EXTERN template struct general_matrix_matrix_product<Index, double, RowMajor, false, double, RowMajor, false,      \
                                                       ColMajor, 1>;                                                 \
  EXTERN template struct general_matrix_vector_product<Index, double, DenseColumns, ColMajor, false, double,         \
                                                       DenseColumns, false, 0>;                                      \
  EXTERN template struct general_matrix_vector_product<Index, double, DenseColumns, ColMajor, false, double,         \
                                                       DenseRows, false, 0>;                                         \
  EXTERN template struct general_matrix_vector_product<Index, double, DenseRows, RowMajor, false, double,            \
                                                       DenseColumns, false, 0>;                                      \
  EXTERN template struct general_matrix_vector_product<Index, double, DenseRows, RowMajor, false, double, DenseRows, \
                                                       false, 0>;                                                    \
  EXTERN template struct triangular_solve_vector<double, double, Index, OnTheLeft, Lower, false, ColMajor>;          \
  EXTERN template struct triangular_solve_vector<double, double, Index, OnTheLeft, Upper, false, ColMajor>;          \
  EXTERN template struct triangular_solve_vector<double, double, Index, OnTheLeft, Lower, false, RowMajor>;          \
  EXTERN template struct triangular_solve_vector<double, double, Index, OnTheLeft, Upper, false, RowMajor>;          \
  EXTERN template struct triangular_solve_matrix<double, Index, OnTheLeft, Lower, false, ColMajor, ColMajor, 1>;     \
  EXTERN template struct triangular_solve_matrix<double, Index, OnTheLeft, Upper, false, ColMajor, ColMajor, 1>;     \
  EXTERN template struct triangular_solve_matrix<double, Index, OnTheLeft, Upper, false, RowMajor, ColMajor, 1>;     \
  EXTERN template struct triangular_solve_matrix<double, Index, OnTheRight, Upper, false, RowMajor, ColMajor, 1>;    \
  }

namespace Eigen {
namespace internal {
using DenseColumns = const_blas_data_mapper<double, Index, ColMajor>;
using DenseRows = const_blas_data_mapper<double, Index, RowMajor>;
}  // namespace internal
BIELLE_DENSE(extern)
}  // namespace Eigen
