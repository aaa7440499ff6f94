#pragma once
/// \file Readers of one file that stands for both files of a robot.
#include <string>

#include "formats/robot_files.h"

namespace bielle {

/// A file of MuJoCo. \throws InputError for what is not MJCF, or cannot be read as a robot
RobotFiles readMjcf(const std::string& path);

/// A file of Gazebo (SDF). \throws InputError for what libsdformat refuses, what cannot be read as a robot, and where libsdformat is
/// not installed
RobotFiles readSdf(const std::string& path);

/// A file of USD in text form. \throws InputError for what is no usda, refers to other files, or cannot be read as a robot
RobotFiles readUsd(const std::string& path);

}  // namespace bielle
