#pragma once
// COLLADA files (.dae).
#include <string>

#include "bielle/math/types.h"

namespace bielle {

// The vertices of all meshes of the scene in metres, each where its nodes place it; `up_axis` is ignored, as ROS does. None if the
// text is damaged, or its nodes stand for each other without end.
Eigen::Matrix3Xd readCollada(const std::string& text);

}  // namespace bielle
