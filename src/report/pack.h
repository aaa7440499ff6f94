#pragma once
// Numbers for the page: base64 of little-endian float32, row after row.
#include <string>

#include "bielle/math/se3.h"
#include "bielle/motion/record.h"
#include "results/json_text.h"

namespace bielle {

std::string encodeBase64(const std::string& bytes);

// {"rows", "cols", "data"}
Json packTable(const RowMatrixXd& table);

// Position and quaternion x y z w.
using PoseRow = Eigen::Matrix<double, 1, 7>;
PoseRow makePoseRow(const SE3& X);
Json packPose(const SE3& X);

Json packVector(const VectorXd& vector);

// A number, or null if it is not finite (a missing limit).
Json packNumber(double value);

}  // namespace bielle
