#pragma once
/// \file Quadratic model of one stage of a shooting problem.
#include "bielle/math/types.h"

namespace bielle {

/// A block of a larger matrix, and the transpose of one.
using MatrixMap = Eigen::Map<MatrixXd, 0, Eigen::OuterStride<>>;
using ConstMatrixMap = Eigen::Map<const MatrixXd, 0, Eigen::OuterStride<>>;
using RowMatrixMap = Eigen::Map<RowMatrixXd, 0, Eigen::OuterStride<>>;
using ConstRowMatrixMap = Eigen::Map<const RowMatrixXd, 0, Eigen::OuterStride<>>;

/// About (x_k, u_k), in tangent coordinates at x_k and at the node state x_{k+1}:
///     dx_{k+1} = Fx dx_k + Fu du_k + gap
///     l = cost + lx.dx + lu.du + 1/2 (dx.lxx.dx + 2 du.lux.dx + du.luu.du)
/// The terminal node has only cost, lx and lxx: its other sizes are zero.
///
/// The matrices are views of two that are stored as the sweep needs them: F^T = [Fu Fx]^T, and the lower triangle of
/// the Hessian [luu . ; lux^T lxx], both with columns aligned to the processor's vector registers.
class StageModel {
 public:
  VectorXd gap;  ///< ndx_{k+1}: difference(x_{k+1}, f_k(x_k, u_k))
  double cost = 0;
  VectorXd lx;  ///< ndx_k
  VectorXd lu;  ///< nu_k

  /// Sets the sizes, and all entries to zero.
  void resize(int ndx, int nu, int ndx_next);
  /// Exchanges the memory of the Hessian, with its content, for another piece of at least its size; while it has none,
  /// the Hessian must not be used.
  void swapHessian(VectorXd& memory) { hessian_.swap(memory); }
  bool hasSizes(int ndx, int nu, int ndx_next) const;

  RowMatrixMap Fx() { return {Ft_.data() + nu_, ndx_next_, ndx_, stride()}; }  ///< ndx_{k+1} x ndx_k
  RowMatrixMap Fu() { return {Ft_.data(), ndx_next_, nu_, stride()}; }         ///< ndx_{k+1} x nu_k
  ConstRowMatrixMap Fx() const { return {Ft_.data() + nu_, ndx_next_, ndx_, stride()}; }
  ConstRowMatrixMap Fu() const { return {Ft_.data(), ndx_next_, nu_, stride()}; }

  /// ndx_k x ndx_k, symmetric: only the lower triangle is written and read
  MatrixMap lxx() { return {hessian_.data() + nu_ * (1 + stride_), ndx_, ndx_, stride()}; }
  RowMatrixMap lux() { return {hessian_.data() + nu_, nu_, ndx_, stride()}; }  ///< nu_k x ndx_k
  MatrixMap luu() { return {hessian_.data(), nu_, nu_, stride()}; }            ///< nu_k x nu_k, likewise
  ConstMatrixMap lxx() const { return {hessian_.data() + nu_ * (1 + stride_), ndx_, ndx_, stride()}; }
  ConstRowMatrixMap lux() const { return {hessian_.data() + nu_, nu_, ndx_, stride()}; }
  ConstMatrixMap luu() const { return {hessian_.data(), nu_, nu_, stride()}; }

  /// (nu_k + ndx_k) x ndx_{k+1} and (nu_k + ndx_k) square
  MatrixMap Ft() { return {Ft_.data(), nu_ + ndx_, ndx_next_, stride()}; }
  MatrixMap hessian() { return {hessian_.data(), nu_ + ndx_, nu_ + ndx_, stride()}; }
  ConstMatrixMap Ft() const { return {Ft_.data(), nu_ + ndx_, ndx_next_, stride()}; }
  ConstMatrixMap hessian() const { return {hessian_.data(), nu_ + ndx_, nu_ + ndx_, stride()}; }

 private:
  Eigen::OuterStride<> stride() const { return Eigen::OuterStride<>(stride_); }

  Eigen::Index ndx_ = 0, nu_ = 0, ndx_next_ = 0;
  Eigen::Index stride_ = 0;  // nu + ndx, rounded up to full registers; the padding is finite
  VectorXd Ft_, hessian_;
};

}  // namespace bielle
