#include "formats/reader_mjcf.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "bielle/model/error.h"
#include "formats/xml_document.h"
#include "model/joint.h"

namespace bielle {
namespace {

constexpr size_t kMostBytes = 16'000'000, kMostJoints = 3000;
constexpr double kFar = 1e9;           // limits beyond it are none
constexpr double kCoincident = 1e-10;  // of frames; the writer's loops are closed to 1e-12

VectorXd toXyzw(const Matrix3d& R) { return Eigen::Quaterniond(R).coeffs(); }

}  // namespace

MjcfReader::MjcfReader(const std::string& path, const XMLElement& root) : root_(root) {
  settings_.path = path;
  tree_.path = yaml_.path = path;
  tree_.root = "world";
  tree_.links["world"].name = "world";
  tree_.has_own_base = true;
  places_["world"] = {"world", {}, {}};
  taken_ = {"world"};
}

MjcfFile MjcfReader::read() {
  readModel();
  readSettings();
  for (const XMLElement* e : getChildren(root_, "default")) readMjcfDefaults(*e, "", settings_);
  forEach("asset", [this](const XMLElement& e) { readAsset(e); });
  forEachSection("actuator", [this](const XMLElement& section) { listDriven(section); });
  forEachSection("worldbody", [this](const XMLElement& e) { readContents(e, places_.at("world"), ""); });
  forEach("tendon", [this](const XMLElement& e) { readTendon(e); });
  forEach("equality", [this](const XMLElement& e) { readEquality(e); });
  joinHinges();
  addClosures();
  forEach("actuator", [this](const XMLElement& e) { readActuator(e); });
  forEach("custom", [this](const XMLElement& e) { readCustom(e); });
  forEach("keyframe", [this](const XMLElement& e) { readKey(e); });
  addStart();
  for (const XMLElement* e : getChildren(root_)) noteSection(*e);
  for (const auto& [name, tendon] : tendons_)
    if (!tendon.is_used) settings_.notes.add("<fixed>", tendon.line, "the tendon is left out");
  tree_.warnings = settings_.notes.format(settings_.path);
  return {std::move(tree_), std::move(yaml_)};
}

void MjcfReader::noteElement(const XMLElement& e, const std::string& problem) {
  settings_.notes.add("<" + getTag(e) + ">", e.GetLineNum(), problem);
}

void MjcfReader::refuse(const XMLElement& e, const std::string& problem, const std::string& remedy) const {
  throw InputError(settings_.path, describe(e), problem, remedy);
}

// A name that nothing else has: that of the file, or one made from `made`.
std::string MjcfReader::makeName(const std::string& made) {
  std::string name = made;
  for (int i = 2; !taken_.insert(name).second; ++i) name = made + "_" + std::to_string(i);
  return name;
}

void MjcfReader::readModel() {
  tree_.name = getAttribute(&root_, "model");
  if (tree_.name.empty()) tree_.name = std::filesystem::path(settings_.path).stem().string();
  if (tree_.name.empty()) tree_.name = "robot";
}

void MjcfReader::readSettings() {
  forEachSection("compiler", [this](const XMLElement& e) { readCompiler(e); });
  forEachSection("option", [this](const XMLElement& e) {
    MjcfElement option(e, "", settings_);
    yaml_.gravity = option.getVector("gravity", yaml_.gravity.value_or(Vector3d(0, 0, -9.81)));
    for (const XMLElement* flag : getChildren(e)) MjcfElement(*flag, "", settings_);
  });
  if (!yaml_.gravity) yaml_.gravity = Vector3d(0, 0, -9.81);
}

void MjcfReader::readCompiler(const XMLElement& e) {
  MjcfElement compiler(e, "", settings_);
  const std::string angle = compiler.getText("angle"), euler = compiler.getText("eulerseq", settings_.euler);
  if (!angle.empty() && angle != "degree" && angle != "radian")
    compiler.fail("its angle is '" + angle + "'", "use degree or radian");
  if (!angle.empty()) settings_.angle = angle == "degree" ? EIGEN_PI / 180 : 1;
  if (euler.size() != 3 || euler.find_first_not_of("xyzXYZ") != std::string::npos)
    compiler.fail("its eulerseq is '" + euler + "'", "give three of x, y, z, X, Y and Z");
  settings_.euler = euler;
  if (compiler.getText("coordinate", "local") != "local")
    compiler.fail("its coordinates are global",
                  "save the model in local coordinates with a version of MuJoCo before 2.3.4");
  settings_.auto_limits = compiler.getFlag("autolimits", settings_.auto_limits);
  inertia_from_geom_ = compiler.getText("inertiafromgeom", inertia_from_geom_);
  if (inertia_from_geom_ != "true" && inertia_from_geom_ != "false" && inertia_from_geom_ != "auto")
    compiler.fail("its inertiafromgeom is '" + inertia_from_geom_ + "'", "use true, false or auto");
  mesh_directory_ = compiler.getText("meshdir", compiler.getText("assetdir", mesh_directory_));
}

void MjcfReader::readAsset(const XMLElement& e) {
  if (getTag(e) != "mesh") return noteElement(e);
  MjcfElement mesh(e, "", settings_);
  const std::string file = mesh.getText("file");
  std::string name = getAttribute(&e, "name");
  if (name.empty()) name = std::filesystem::path(file).stem().string();
  Visual visual;
  visual.shape = Visual::Shape::Mesh;
  visual.size = mesh.getVector("scale", Vector3d::Ones());
  visual.mesh = (std::filesystem::path(mesh_directory_) / file).string();
  if (!file.empty()) meshes_[name] = visual;
}

// Sections that are not read.
void MjcfReader::noteSection(const XMLElement& e) {
  static const std::set<std::string> read = {"compiler", "option",   "default",  "asset",  "worldbody",
                                             "tendon",   "equality", "actuator", "custom", "keyframe"};
  static const std::set<std::string> unable = {"include", "deformable", "extension"};
  const std::string& tag = getTag(e);
  if (read.count(tag)) return;
  if (unable.count(tag))
    refuse(e, "such elements are not supported",
           "save the model with MuJoCo as one file (mj_saveLastXML), or remove it");
  if (!e.FirstChildElement()) return noteElement(e);
  for (const XMLElement* c : getChildren(e))
    settings_.notes.add("<" + tag + "> <" + getTag(*c) + ">", c->GetLineNum(), "left out");
}

// The children of a body, also those in <frame>.
void MjcfReader::flatten(const XMLElement& body, const SE3& X_BF, const std::string& childclass,
                         std::vector<Child>& out) {
  for (const XMLElement* e : getChildren(body)) {
    if (getTag(*e) != "frame") {
      out.push_back({e, X_BF, childclass});
      continue;
    }
    MjcfElement frame(*e, "", settings_);
    const SE3 X = X_BF * frame.getPose();
    flatten(*e, X, frame.getText("childclass", childclass), out);
  }
}

void MjcfReader::readContents(const XMLElement& e, const BodyPlace& place, const std::string& childclass) {
  std::vector<Child> children;
  flatten(e, {}, childclass, children);
  readContents(children, place);
}

void MjcfReader::readContents(const std::vector<Child>& children, const BodyPlace& place) {
  readShapes(children, place);
  for (const Child& child : children) {
    const std::string& tag = getTag(*child.element);
    static const std::set<std::string> read = {"geom", "site", "joint", "freejoint", "inertial"};
    static const std::set<std::string> unable = {"include", "attach", "replicate", "composite", "flexcomp", "plugin"};
    if (unable.count(tag))
      refuse(*child.element, "such elements are not supported",
             "save the model with MuJoCo as one file (mj_saveLastXML), or remove it");
    if (tag == "body")
      readBody(child, place);
    else if (!read.count(tag))
      noteElement(*child.element);
  }
}

void MjcfReader::readBody(const Child& child, const BodyPlace& parent) {
  const XMLElement& e = *child.element;
  MjcfElement body(e, "", settings_);
  if (body.getFlag("mocap", false)) body.note("it cannot be moved from outside");
  std::string file_name = getAttribute(&e, "name");
  const std::string name = makeName(file_name.empty() ? "body_" + std::to_string(e.GetLineNum()) : file_name);
  if (!file_name.empty() && name != file_name) body.fail("its name is taken", "rename it");
  const SE3 X_PB = child.X_BF * body.getPose();
  std::vector<Child> children;
  flatten(e, {}, body.getText("childclass", child.childclass), children);
  BodyPlace place = {name, {}, parent.X_WB * X_PB};
  place.X_LB = addJoints(body, name, children, parent, X_PB);
  tree_.links[name].inertia = readInertia(children).transformed(place.X_LB);
  places_[name] = place;
  readContents(children, place);
}

// Adds the links from the parent to the body; returns the frame of the body in its link.
SE3 MjcfReader::addJoints(const MjcfElement& body, const std::string& link, const std::vector<Child>& children,
                          const BodyPlace& parent, const SE3& X_PB) {
  std::vector<Element> elements;
  for (const Child& child : children)
    if (getTag(*child.element) == "joint" || getTag(*child.element) == "freejoint")
      elements.push_back(readJoint(child, link));
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

UrdfJoint& MjcfReader::addLink(const std::string& link, const std::string& parent, JointKind kind,
                               const std::string& name, const SE3& X_PJ) {
  tree_.links[link].name = link;
  UrdfJoint joint;
  joint.parent = parent;
  joint.child = link;
  joint.joint.name = name;
  joint.joint.kind = kind;
  joint.joint.X_PJ = X_PJ;
  tree_.joints.push_back(std::move(joint));
  if (tree_.joints.size() > kMostJoints)
    throw InputError(settings_.path, "document", "it has more than " + std::to_string(kMostJoints) + " bodies or sites",
                     "no robot needs so many");
  return tree_.joints.back();
}

// The link itself or a site that stands there, else a new frame. A ball has no axes to care for.
std::string MjcfReader::findFrame(const std::string& link, const SE3& X, bool is_ball, const std::string& made) {
  const auto stands = [&](const SE3& other) {
    return (X.p - other.p).isZero(kCoincident) && (is_ball || (X.R - other.R).isZero(kCoincident));
  };
  if (stands({})) return link;
  for (const UrdfJoint& j : tree_.joints)
    if (j.joint.kind == JointKind::Fixed && j.parent == link && stands(j.joint.X_PJ)) return j.child;
  const std::string name = makeName(made);
  addLink(name, link, JointKind::Fixed, name + "_frame", X);
  return name;
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
  slots_.push_back({element.name, kind, q, Matrix3d::Identity()});
  if (element.armature != 0) yaml_.armature[element.name] = element.armature;
  if (element.has_force) yaml_.joint_forces.push_back({element.name, element.force});
}

void MjcfReader::addFree(const Element& element, const std::string& link, const SE3& X_WB) {
  addLink(link, "world", JointKind::FreeFlyer, element.name, {});
  VectorXd q(7);
  q << X_WB.p, toXyzw(X_WB.R);
  slots_.push_back({element.name, JointKind::FreeFlyer, q, Matrix3d::Identity()});
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
    if (element.has_force || element.is_driven || !element.pos.isZero(0) ||
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
    q.tail<4>() = toXyzw(slot.R_ref);
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
  out.is_driven = driven_.count(out.name) > 0;
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
    out.axis /= norm;
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
  if (force.stiffness != 0) force.rest = rest;
  out.has_force = force.stiffness != 0 || force.damping != 0 || force.friction != 0;
  if (force.friction != 0) e.note("its frictionloss acts like a damper below 0.01 rad/s (m/s): it does not stick");
}

// Limits of the force of all actuators of the joint.
void MjcfReader::readJointClamp(MjcfElement& e, const Element& joint) {
  if (!e.isLimited("actuatorfrclimited", "actuatorfrcrange")) return;
  const std::vector<double> range = e.getNumbers("actuatorfrcrange", 2, 2);
  clamps_[joint.name] = std::min(std::abs(range[0]), std::abs(range[1]));
  if (range[0] != -range[1]) e.note("its actuatorfrcrange is not symmetric: the smaller side is used for both");
}

MjcfFile readMjcf(const std::string& path) {
  const std::string xml = readRobotText(path);
  if (xml.size() > kMostBytes)
    throw InputError(path, "file", "it exceeds the largest size of a MuJoCo file (16 MB)",
                     "give one without embedded data");
  XMLDocument document;
  return MjcfReader(path, parseXml(xml, path, "mujoco", document)).read();
}

}  // namespace bielle
