#include "robots/part_tree.h"

#include <map>

#include "robots/part_solids.h"

namespace bielle {
namespace {

JointKind readKind(const YamlEntry* type) {
  static const std::map<std::string, JointKind> kinds = {
      {"revolute", JointKind::Revolute},   {"prismatic", JointKind::Prismatic}, {"universal", JointKind::Universal},
      {"spherical", JointKind::Spherical}, {"planar", JointKind::Planar},       {"floating", JointKind::FreeFlyer},
      {"fixed", JointKind::Fixed}};
  if (!type) return JointKind::Revolute;
  if (const auto it = kinds.find(type->getText()); it != kinds.end()) return it->second;
  type->fail("joint type '" + type->getText() + "' is unknown",
             "use revolute, prismatic, universal, spherical, planar, floating or fixed");
}

}  // namespace

UrdfJoint readJoint(const YamlFields& fields, const YamlEntry& owner, double side) {
  UrdfJoint out;
  Joint& joint = out.joint;
  joint.kind = readKind(find(fields, "type"));
  if (const YamlEntry* place = find(fields, "place")) joint.X_PJ.p = readPlace(*place, side);
  if (const YamlEntry* rpy = find(fields, "rpy")) joint.X_PJ.R = readAttitude(*rpy, side);
  const YamlEntry *axis = find(fields, "axis"), *axis2 = find(fields, "axis2");
  const bool has_axis = joint.kind == JointKind::Revolute || joint.kind == JointKind::Prismatic ||
                        joint.kind == JointKind::Planar || joint.kind == JointKind::Universal;
  if (axis && !has_axis) axis->fail("the joint has no axis", "remove it");
  if (has_axis) joint.axis = readAxis(require(fields, "axis", owner), side);
  if (joint.kind == JointKind::Universal)
    joint.axis2 = readAxis(require(fields, "axis2", owner), side);
  else if (axis2)
    axis2->fail("only a universal joint has it", "remove it");
  const YamlEntry* range = find(fields, "range");
  if (!range) return out;
  const std::vector<double> limits = range->getNumbers(2);
  if (getNv(joint.kind) != 1) range->fail("the joint has not one coordinate", "remove it");
  if (!(limits[0] < limits[1])) range->fail("it is empty", "give the smaller number first");
  out.lower = VectorXd::Constant(1, limits[0]);
  out.upper = VectorXd::Constant(1, limits[1]);
  return out;
}

void addSolidsTo(UrdfLink& link, const std::vector<Solid>& solids) {
  for (const Solid& solid : solids) {
    link.inertia = link.inertia + calcInertia(solid);
    link.visuals.push_back(makeVisual(solid));
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
