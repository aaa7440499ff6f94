// Joints: one by one, and several that are one joint of ours.
#include <algorithm>
#include <cmath>

#include "bielle/model/error.h"
#include "formats/mjcf.h"
#include "formats/reader_mjcf.h"
#include "model/joint.h"

namespace bielle {
namespace {

constexpr double kFar = 1e9;  // limits beyond it are none

}  // namespace

// Adds the links from the parent to the body; returns the frame of the body in its link.
SE3 MjcfReader::addJoints(const MjcfElement& body, const std::string& link, const std::vector<Child>& children,
                          const BodyPlace& parent, const SE3& X_PB) {
  std::vector<Element> elements;
  for (const Child& child : children)
    if (getTag(*child.element) == "joint" || getTag(*child.element) == "freejoint")
      elements.push_back(readJoint(child, link));
  softness_.bodies[link].slides =
      !elements.empty() && std::all_of(elements.begin(), elements.end(), [](const Element& e) {
        return e.type == "slide" && e.pos.isZero(0) && (e.axis.array() != 0).count() == 1;
      });
  const SE3 X_LP = parent.X_LB;
  if (elements.empty()) {
    addLink(link, parent.link, JointKind::Fixed, link + "_fixed", X_LP * X_PB);
    return {};
  }
  if (elements.front().type == "free") {
    if (elements.size() > 1 || parent.link != "world")
      body.fail("it has a free joint together with another joint, or on a moving body",
                "give free joints only to bodies of the world");
    addFree(elements.front(), link, X_PB);
    return {};
  }
  if (addCompound(elements, link, parent.link, X_LP * X_PB)) return {};
  if (addBase(body, elements, link, parent, parent.X_WB * X_PB)) return {};
  SE3 X = X_LP * X_PB;
  std::string above = parent.link;
  for (size_t i = 0; i < elements.size(); ++i) {
    const Element& element = elements[i];
    if (element.type == "free") body.fail("it has a free joint together with another joint", "remove one");
    const std::string below = i + 1 < elements.size() ? makeName(link + "/" + element.name) : link;
    addSingle(element, below, above, X * translate(element.pos));
    X = translate(-element.pos);
    above = below;
  }
  return X;
}

// The joint of an element by itself, its slot in qpos, armature and forces.
void MjcfReader::addSingle(const Element& element, const std::string& link, const std::string& parent,
                           const SE3& X_PB) {
  const JointKind kind = element.type == "ball"    ? JointKind::Spherical
                         : element.type == "slide" ? JointKind::Prismatic
                         : element.lower.size()    ? JointKind::Revolute
                                                   : JointKind::Continuous;
  Joint joint;
  joint.kind = kind;
  joint.axis = element.axis;
  VectorXd q = VectorXd::Constant(1, element.ref);
  if (kind == JointKind::Spherical) q = Eigen::Vector4d::UnitW();
  UrdfJoint& added = addLink(link, parent, kind, element.name, X_PB * calcJointPlacement(joint, q).inverse());
  added.joint.axis = element.axis;
  added.lower = element.lower;
  added.upper = element.upper;
  slots_.push_back({element.name, kind, q, Matrix3d::Identity(), {}, {}});
  if (element.armature != 0) yaml_.armature[element.name] = element.armature;
  if (element.has_force) yaml_.joint_forces.push_back({element.name, element.force});
}

void MjcfReader::addFree(const Element& element, const std::string& link, const SE3& X_WB) {
  addLink(link, "world", JointKind::FreeFlyer, element.name, {});
  VectorXd q(7);
  q << X_WB.p, Eigen::Quaterniond(X_WB.R).coeffs();
  slots_.push_back({element.name, JointKind::FreeFlyer, q, Matrix3d::Identity(), {}, {}});
  if (element.armature != 0) yaml_.armature[element.name] = element.armature;
}

// One joint of ours in several elements (formats/mjcf_coordinates.h), recognised by names and geometry.
bool MjcfReader::addCompound(const std::vector<Element>& elements, const std::string& link, const std::string& parent,
                             const SE3& X_PB) {
  const std::string& first = elements.front().name;
  const size_t dot = first.rfind('.');
  if (elements.size() < 2 || dot == std::string::npos || dot == 0) return false;
  Joint joint;
  joint.name = first.substr(0, dot);
  std::string types, suffixes;
  for (const Element& element : elements) {
    if (element.has_force || element.is_named || !element.pos.isZero(0) ||
        element.name.compare(0, dot, joint.name) != 0 || element.armature != elements.front().armature)
      return false;
    types += element.type + " ";
    suffixes += element.name.substr(dot) + " ";
  }
  VectorXd q(elements.size());
  for (size_t i = 0; i < elements.size(); ++i) q[i] = elements[i].ref;
  Slot slot;
  if (types == "hinge hinge " && suffixes == ".angle1 .angle2 ") {
    joint.kind = JointKind::Universal;
    joint.axis2 = elements[1].axis;
    joint.axis = Eigen::AngleAxisd(q[1], joint.axis2) * elements[0].axis;
    if (joint.axis.cross(joint.axis2).norm() < 1e-3) return false;
  } else if (types == "slide slide hinge " && suffixes == ".x .y .angle ") {
    joint.kind = JointKind::Planar;
    joint.axis = elements[2].axis;
    const Matrix3d plane = makePlaneBasis(joint.axis), R = Eigen::AngleAxisd(q[2], joint.axis).toRotationMatrix();
    for (int k = 0; k < 2; ++k)
      if (!(R * elements[k].axis).isApprox(plane.col(k), kSamePlace)) return false;
  } else if (types == "slide slide slide ball " && suffixes == ".x .y .z  ") {
    joint.kind = JointKind::FreeFlyer;
    for (int k = 0; k < 3; ++k) slot.R_ref.row(k) = elements[k].axis;
    if (!slot.R_ref.isUnitary(kSamePlace) || slot.R_ref.determinant() < 0) return false;
    q.conservativeResize(7);
    q.tail<4>() = Eigen::Quaterniond(slot.R_ref).coeffs();
  } else {
    return false;
  }
  UrdfJoint& added = addLink(link, parent, joint.kind, joint.name, X_PB * calcJointPlacement(joint, q).inverse());
  added.joint.axis = joint.axis;
  added.joint.axis2 = joint.axis2;
  setLimits(elements, added);
  slot.joint = joint.name;
  slot.kind = joint.kind;
  slot.q_ref = q;
  slots_.push_back(slot);
  if (elements.front().armature != 0) yaml_.armature[joint.name] = elements.front().armature;
  return true;
}

void MjcfReader::setLimits(const std::vector<Element>& elements, UrdfJoint& joint) {
  constexpr double inf = std::numeric_limits<double>::infinity();
  const int nv = getNv(joint.joint.kind);
  VectorXd lower = VectorXd::Constant(nv, -inf), upper = VectorXd::Constant(nv, inf);
  bool has = false;
  for (int k = 0; k < std::min<int>(nv, elements.size()); ++k) {
    if (elements[k].lower.size() == 0) continue;
    has = true;
    lower[k] = elements[k].lower[0];
    upper[k] = elements[k].upper[0];
  }
  if (!has) return;
  joint.lower = lower;
  joint.upper = upper;
}

MjcfReader::Element MjcfReader::readJoint(const Child& child, const std::string& body) {
  MjcfElement e(*child.element, child.childclass, settings_);
  Element out;
  out.line = e.line();
  const std::string given = getAttribute(child.element, "name");
  const bool is_free = getTag(*child.element) == "freejoint";
  out.type = is_free ? "free" : e.getText("type", "hinge");
  if (out.type != "free" && out.type != "ball" && out.type != "slide" && out.type != "hinge")
    e.fail("its type '" + out.type + "' is unknown", "use hinge, slide, ball or free");
  out.name = given.empty() ? (out.type == "free" ? "root_joint" : body + "_joint") : given;
  for (int i = 2; !joint_names_.insert(out.name).second; ++i) {
    if (!given.empty()) e.fail("two joints have this name", "rename one of them");
    out.name = body + "_joint_" + std::to_string(i);
  }
  out.is_named = named_.count(out.name) > 0;
  if (is_free) return e.find("align"), out;
  out.pos = out.type == "slide" || out.type == "free" ? Vector3d::Zero().eval() : e.getVector("pos", out.pos);
  if (out.type == "slide" || out.type == "free") e.find("pos");  // it has no effect
  out.pos = child.X_BF.act(out.pos) * (out.type == "slide" || out.type == "free" ? 0 : 1);
  out.armature = e.getNumber("armature", 0);
  const bool is_angle = out.type == "hinge" || out.type == "ball";
  const bool has_one = out.type == "hinge" || out.type == "slide";
  const double unit = is_angle ? settings_.angle : 1;
  if (has_one) {
    out.axis = child.X_BF.R * e.getVector("axis", out.axis);
    const double norm = out.axis.stableNorm();
    if (!(norm > 1e-12) || !std::isfinite(norm)) e.fail("its axis is not a direction", "give a non-zero vector");
    if (std::abs(out.axis.squaredNorm() - 1) > 1e-15) out.axis /= norm;  // as it was written
    out.ref = unit * e.getNumber("ref", 0);
  } else {
    for (const char* without_meaning : {"axis", "ref"}) e.find(without_meaning);
  }
  readRange(e, has_one, unit, out);
  readForce(e, has_one, unit, out);
  readJointClamp(e, out);
  return out;
}

void MjcfReader::readRange(MjcfElement& e, bool has_one, double unit, Element& out) {
  // As in MuJoCo, a default of joints does not limit a free joint, nor a ball that has no range.
  if (out.type == "free" || (!has_one && !e.find("range"))) {
    for (const char* without_meaning : {"limited", "range"}) e.find(without_meaning);
    return;
  }
  if (!e.isLimited("limited", "range")) {
    if (!has_one || !e.find("limited")) e.find("range");
    return;
  }
  const std::vector<double> range = e.getNumbers("range", 2, 2);
  if (!has_one) return e.note("the range of its " + out.type + " is left out");
  constexpr double inf = std::numeric_limits<double>::infinity();
  const double lower = unit * range[0], upper = unit * range[1];
  if (lower > upper) e.fail("its range is empty", "give the lower limit first");
  if (lower <= -kFar && upper >= kFar) return;
  out.lower = VectorXd::Constant(1, lower <= -kFar ? -inf : lower);
  out.upper = VectorXd::Constant(1, upper >= kFar ? inf : upper);
}

void MjcfReader::readForce(MjcfElement& e, bool has_one, double unit, Element& out) {
  JointForce& force = out.force;
  force.stiffness = e.getNumber("stiffness", 0);
  force.damping = e.getNumber("damping", 0);
  force.friction = e.getNumber("frictionloss", 0);
  if (!has_one) {
    if (force.stiffness != 0 || force.damping != 0 || force.friction != 0)
      e.note("stiffness, damping and frictionloss of a " + out.type + " joint are left out");
    e.find("springref");
    return;
  }
  const double rest = unit * e.getNumber("springref", 0);
  if (force.stiffness == kMjcfPreloadStiffness)
    force.preload = force.stiffness * rest, force.stiffness = 0;
  else if (force.stiffness != 0)
    force.rest = rest;
  out.has_force = force.stiffness != 0 || force.preload != 0 || force.damping != 0 || force.friction != 0;
  if (force.friction != 0) e.note("its frictionloss acts like a damper below 0.01 rad/s (m/s): it does not stick");
}

// Limits of the force of all actuators of the joint.
void MjcfReader::readJointClamp(MjcfElement& e, const Element& joint) {
  if (!e.isLimited("actuatorfrclimited", "actuatorfrcrange")) return;
  const std::vector<double> range = e.getNumbers("actuatorfrcrange", 2, 2);
  clamps_[joint.name] = std::min(std::abs(range[0]), std::abs(range[1]));
  if (range[0] != -range[1]) e.note("its actuatorfrcrange is not symmetric: the smaller side is used for both");
}

}  // namespace bielle
