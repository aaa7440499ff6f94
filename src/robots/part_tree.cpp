#include "robots/part_tree.h"

namespace bielle {

void addSolidsTo(UrdfLink& link, const std::vector<Solid>& solids) {
  for (const Solid& solid : solids) {
    link.inertia = link.inertia + calcInertia(solid);
    Visual visual;
    visual.shape = solid.shape;
    visual.X_BV = solid.X_LS;
    visual.size = solid.size;
    visual.rgba = solid.rgba;
    link.visuals.push_back(visual);
  }
}

UrdfLink& findLinkOf(UrdfFile& urdf, const std::string& link, const YamlEntry& entry) {
  const auto it = urdf.links.find(link);
  if (it == urdf.links.end()) entry.fail("there is no link '" + link + "'", "correct the name");
  return it->second;
}

void addJointTo(UrdfFile& urdf, const UrdfJoint& joint, const YamlEntry& entry) {
  if (joint.parent == "world" && (urdf.root.empty() || urdf.root == "world")) {
    urdf.root = "world";
    urdf.links.emplace("world", UrdfLink{"world", {}, {}, {}});
  }
  if (!urdf.links.count(joint.parent))
    entry.fail("there is no link '" + joint.parent + "' before it", "correct the name, or put it after its parent");
  if (!urdf.links.emplace(joint.child, UrdfLink{joint.child, {}, {}, {}}).second)
    entry.fail("there is a link '" + joint.child + "' already",
               "rename one of them; {part} in a name is that of its part");
  for (const UrdfJoint& other : urdf.joints)
    if (other.joint.name == joint.joint.name)
      entry.fail("there is a joint '" + joint.joint.name + "' already", "rename one of them");
  urdf.joints.push_back(joint);
}

void addFrameTo(UrdfFile& urdf, const std::string& name, const std::string& link, const SE3& X,
                const YamlEntry& entry) {
  UrdfJoint joint;
  joint.joint.kind = JointKind::Fixed;
  joint.joint.name = name + "_joint";
  joint.joint.X_PJ = X;
  joint.child = name;
  joint.parent = link;
  addJointTo(urdf, joint, entry);
}

}  // namespace bielle
