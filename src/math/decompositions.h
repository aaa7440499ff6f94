#pragma once
/// \file Dense decompositions of matrices of any size, and the products within them, compiled once (decompositions.cpp,
/// decompositions_plain.cpp): one of them takes the compiler ten seconds, and the linker keeps one copy of those
/// that several rooms compile, of whichever is first, not of the fastest. What they are given is best a MatrixXd or a
/// VectorXd, since they are compiled anew for every kind of expression.
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
  EXTERN template class LLT<MatrixXd>;                                                                               \
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
  EXTERN template struct general_matrix_vector_product<Index, double, DenseRows, RowMajor, false, double, DenseRows, \
                                                       false, BuiltIn>;                                              \
  EXTERN template struct gebp_kernel<double, double, Index, DenseBlock, gebp_traits<double, double>::mr,             \
                                     gebp_traits<double, double>::nr, false, false>;                                 \
  EXTERN template struct product_triangular_matrix_matrix<double, Index, Lower, true, ColMajor, false, ColMajor,     \
                                                          false, ColMajor, 1>;                                       \
  EXTERN template struct product_triangular_matrix_matrix<double, Index, UnitLower, true, ColMajor, false, ColMajor, \
                                                          false, ColMajor, 1>;                                       \
  EXTERN template struct product_triangular_matrix_matrix<double, Index, Upper, true, RowMajor, false, ColMajor,     \
                                                          false, ColMajor, 1>;                                       \
  EXTERN template struct product_triangular_matrix_matrix<double, Index, UnitUpper, true, RowMajor, false, ColMajor, \
                                                          false, ColMajor, 1>;                                       \
  EXTERN template struct triangular_solve_vector<double, double, Index, OnTheLeft, Lower, false, ColMajor>;          \
  EXTERN template struct triangular_solve_vector<double, double, Index, OnTheLeft, Upper, false, ColMajor>;          \
  EXTERN template struct triangular_solve_vector<double, double, Index, OnTheLeft, Lower, false, RowMajor>;          \
  EXTERN template struct triangular_solve_vector<double, double, Index, OnTheLeft, Upper, false, RowMajor>;          \
  EXTERN template struct triangular_solve_matrix<double, Index, OnTheLeft, Lower, false, ColMajor, ColMajor, 1>;     \
  EXTERN template struct triangular_solve_matrix<double, Index, OnTheLeft, Upper, false, ColMajor, ColMajor, 1>;     \
  EXTERN template struct triangular_solve_matrix<double, Index, OnTheLeft, Upper, false, RowMajor, ColMajor, 1>;     \
  EXTERN template struct triangular_solve_matrix<double, Index, OnTheRight, Upper, false, RowMajor, ColMajor, 1>;    \
  }

// Functions of these classes and for them, which are templates themselves. They run where nothing is in a hurry, so
// that -O1 will do, at which most of their callers are compiled; results are then the same to the last bit.
#define BIELLE_DENSE_PLAIN(EXTERN)                                                                                 \
  EXTERN template void ColPivHouseholderQR<MatrixXd>::_solve_impl(const VectorXd&, VectorXd&) const;               \
  EXTERN template void CompleteOrthogonalDecomposition<MatrixXd>::_solve_impl(const VectorXd&, VectorXd&) const;   \
  EXTERN template void CompleteOrthogonalDecomposition<MatrixXd>::_solve_impl(const MatrixXd::IdentityReturnType&, \
                                                                              MatrixXd&) const;                    \
  EXTERN template SelfAdjointEigenSolver<MatrixXd>& SelfAdjointEigenSolver<MatrixXd>::compute(                     \
      const EigenBase<MatrixXd>&, int);                                                                            \
  EXTERN template class CompleteOrthogonalDecomposition<MatrixXd>;                                                 \
  EXTERN template class FullPivLU<MatrixXd>;                                                                       \
  EXTERN template class EigenSolver<MatrixXd>;                                                                     \
  EXTERN template EigenSolver<MatrixXd>& EigenSolver<MatrixXd>::compute(const EigenBase<MatrixXd>&, bool);         \
  namespace internal {                                                                                             \
  EXTERN template void make_block_householder_triangular_factor(DenseFactor&, const Block<MatrixXd>&,              \
                                                                const VectorBlock<const VectorXd>&);               \
  EXTERN template void make_block_householder_triangular_factor(DenseFactor&, const Block<MatrixXd>&,              \
                                                                const Block<const VectorXd, Dynamic, 1, false>&);  \
  EXTERN template void apply_block_householder_on_the_left(Block<MatrixXd>&, const Block<MatrixXd>&,               \
                                                           const VectorBlock<const VectorXd>&, bool);              \
  }

namespace Eigen {
namespace internal {
using DenseFactor = Matrix<double, Dynamic, Dynamic, RowMajor>;
using DenseColumns = const_blas_data_mapper<double, Index, ColMajor>;
using DenseRows = const_blas_data_mapper<double, Index, RowMajor>;
using DenseBlock = blas_data_mapper<double, Index, ColMajor, Unaligned, 1>;
}  // namespace internal
BIELLE_DENSE(extern)
BIELLE_DENSE_PLAIN(extern)
}  // namespace Eigen
