#pragma once
// Meshes that robot files name.
#include <filesystem>
#include <optional>
#include <string>

#include "bielle/model/model.h"

namespace bielle {

// The file of a mesh, empty if there is none. `package://name/rest`, like `model://name/rest`, stands for name/rest in any
// directory above the robot's or in $ROS_PACKAGE_PATH, or for rest beside the robot.
std::filesystem::path findMesh(const std::string& mesh, const std::string& directory);

// STL and OBJ files and the vertices of COLLADA files (.dae) are read here. What else assimp reads is read by `bielle-mesh`, a
// program of its own, so that a damaged file cannot harm this process.

// The box or capsule of least volume around the vertices of a file, along the axes of the file or the principal ones of the
// vertices; none if the file is missing, of an unknown kind, damaged, or larger than 100 MB.
std::optional<Shape> fitMesh(const std::string& mesh, const std::string& directory, const Vector3d& scale);

// Corners of the triangles of a file, three columns each, polygons cut into fans; none if the file is missing, of an unknown
// kind, damaged, or larger than 100 MB.
Eigen::Matrix3Xd readTriangles(const std::string& mesh, const std::string& directory);

}  // namespace bielle
