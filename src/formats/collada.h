#pragma once
// COLLADA files (.dae).
#include <string>

#include "bielle/math/types.h"

namespace bielle {

// The vertices of all meshes of the scene in metres, each where its nodes place it; `up_axis` is ignored, as ROS does. None if the
// text is damaged, its nodes stand for each other without end, or one is placed by <lookat> or <skew>.
Eigen::Matrix3Xd readCollada(const std::string& text);

}  // namespace bielle
