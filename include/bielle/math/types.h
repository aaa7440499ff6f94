#pragma once
/// \file Eigen types used everywhere.
#include <Eigen/Core>

namespace bielle {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Matrix6Xd = Eigen::Matrix<double, 6, Eigen::Dynamic>;
using ConstVectorRef = Eigen::Ref<const VectorXd>;
using VectorRef = Eigen::Ref<VectorXd>;
using ConstMatrixRef = Eigen::Ref<const MatrixXd>;
using MatrixRef = Eigen::Ref<MatrixXd>;

}  // namespace bielle
