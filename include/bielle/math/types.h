#pragma once
/// \file Eigen types, and the status of computations, used everywhere.
#include <Eigen/Core>
#include <vector>

namespace bielle {

using Eigen::Matrix3;
using Eigen::Matrix3d;
using Eigen::MatrixX;
using Eigen::MatrixXd;
using Eigen::Vector3;
using Eigen::Vector3d;
using Eigen::VectorX;
using Eigen::VectorXd;
template <typename T>
using Vector6 = Eigen::Matrix<T, 6, 1>;
template <typename T>
using Matrix6 = Eigen::Matrix<T, 6, 6>;
template <typename T>
using Matrix6X = Eigen::Matrix<T, 6, Eigen::Dynamic>;
using RowMatrixXd = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using Vector6d = Vector6<double>;
using Matrix6d = Matrix6<double>;
using Matrix6Xd = Matrix6X<double>;
using ConstVectorRef = Eigen::Ref<const VectorXd>;
using VectorRef = Eigen::Ref<VectorXd>;
using ConstMatrixRef = Eigen::Ref<const MatrixXd>;
using MatrixRef = Eigen::Ref<MatrixXd>;

// Argument types of functions that run for one node (T = double) or for several at once (T = Lanes). T is deduced from
// the workspace.
template <typename T>
struct ArgumentsOf {
  using ConstVector = Eigen::Ref<const VectorX<T>>;
  using Vector = Eigen::Ref<VectorX<T>>;
  using Matrix = Eigen::Ref<MatrixX<T>>;
  using Wrenches = std::vector<Vector6<T>>;
};

/// How a computation ended. A numerical failure is a status, never an exception or a NaN passed on; bad input throws an
/// InputError instead.
enum class NumericalStatus {
  Ok,
  NotFinite,      ///< a value is not finite
  Singular,       ///< the mass matrix has no inverse
  Indefinite,     ///< a matrix has no Cholesky factor: raise the regularization
  Contradictory,  ///< redundant rows of closures and contacts require different things
  NotClosed,      ///< no configuration was found that closes the loops or meets what else was requested
  NearDeadPoint,  ///< a linkage hardly follows its motors, or not at all
  Unbalanced,     ///< motors and contacts cannot produce the motion
  Inaccurate,     ///< errors exceed their tolerances
  NotConverged,   ///< iterations ended before their tolerance
  Failed          ///< for another reason, or not evaluated
};
const char* getName(NumericalStatus status);     ///< e.g. "near a dead point"
const char* getMessage(NumericalStatus status);  ///< a sentence with the remedy, without the full stop

}  // namespace bielle
