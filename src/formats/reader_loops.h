#pragma once
/// \file Loops in a file beside a URDF.
///
/// A file loop_closures.yaml is looked for beside the URDF, in the directory above and in `config` there, unless the YAML file of the
/// robot has closures. It may have
/// - `closures: [{link_a, link_b, point, axis}, ...]`: hinges where the links stand with all joints at zero, in the frame of the root
///   link; `dependent: [...]`, joints whose <mimic> only approximates a loop and is left out; `independent: [...]`, joints with a
///   motor (sw2robot);
/// - `ball_loops` and `pin_loops: [{name, parent, child, parent_xyz, child_xyz, axis}, ...]`: balls and hinges, the axis in the
///   parent; `ball_upgrades: [...]`, joints that are balls; `actuated_joints: [...]`, those with a motor (robonex-description).
///
/// Without one, a file robot_data.yaml with `closing_joints: [{name, type, parent, child, origin_xyz_m, origin_rpy_rad, axis}, ...]`
/// in one of these places (fusion2URDF): joints in their parent links, which close loops with all joints at zero; their ranges are
/// left out. Joints with `passive: false` in its `joints` have motors; the rest of the file repeats the URDF and is not read. (The
/// keys, not the name of the file, tell which of the two it is.)
#include <filesystem>

#include "formats/robot_files.h"

namespace bielle {

/// What stands at a place of a link: the link itself, or what is fixed to it there; empty if there is nothing.
/// \param is_point  whether directions do not matter   \param within  m, and of entries of rotations
std::string findUrdfFrame(const UrdfFile& tree, const std::string& link, const SE3& X_LF, bool is_point, double within);

/// What stands there, or a new frame with this name, or with underscores behind it if that is taken.
std::string addUrdfFrame(UrdfFile& tree, std::string name, const std::string& link, const SE3& X_LF);

/// Empty without one.
std::filesystem::path findLoopClosures(const std::filesystem::path& urdf);

/// A file that names no link of the tree is left out with a warning: it is another robot's.
/// \throws InputError naming the entry for names that do not exist and what is no number
void readLoopClosures(const std::string& path, UrdfFile& tree, YamlFile& settings);

}  // namespace bielle
