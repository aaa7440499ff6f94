#pragma once
/// \file Links and joints added to the tree of a robot.
#include "formats/robot_files.h"
#include "robots/solid.h"

namespace bielle {

/// The joint of a link in a tree: its kind, place, axes and range. \param side  -1 in a mirror image   \throws InputError
UrdfJoint readJoint(const YamlFields& fields, const YamlEntry& owner, double side);

void addSolidsTo(UrdfLink& link, const std::vector<Solid>& solids);

/// \param entry  in errors   \throws InputError if there is no such link
UrdfLink& findLinkOf(UrdfFile& urdf, const std::string& link, const YamlEntry& entry);

/// A link with the joint that carries it; a parent "world" is the ground.
/// \throws InputError if there are a link or a joint of these names, or the parent is not there yet
void addJointTo(UrdfFile& urdf, const UrdfJoint& joint, const YamlEntry& entry);

/// A frame: a link without mass, fixed to another one.
void addFrameTo(UrdfFile& urdf, const std::string& name, const std::string& link, const SE3& X, const YamlEntry& entry);

}  // namespace bielle
