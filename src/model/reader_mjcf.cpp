// Files of MuJoCo (MJCF) as the contents of a robot's two files. Bodies with several joints become chains of links
// without mass, except where the writer (io/mjcf.h) split one joint of ours, which is put together again.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>

#include "bielle/model/error.h"
#include "model/joint.h"
#include "model/mjcf_element.h"
#include "model/robot_files.h"
#include "model/xml_document.h"

namespace bielle {
namespace {

constexpr size_t kMostBytes = 16'000'000, kMostJoints = 3000;
constexpr double kFar = 1e9;  // limits beyond it are none
constexpr const char* kGeomAttributes[] = {"mass", "density", "mesh", "contype", "conaffinity", "rgba", "material"};
constexpr double kCoincident = 1e-10;  // of frames; the writer's loops are closed to 1e-12
constexpr double kSame = 1e-9;         // of axes and places that the writer made equal

// A body of the file: the link that carries it, its frame there and, with all joints at `ref`, in the world.
struct BodyPlace {
  std::string link;
  SE3 X_LB, X_WB;
};

// A joint of the file.
struct Element {
  std::string name, type;
  Vector3d pos = Vector3d::Zero(), axis = Vector3d::UnitZ();  // in the frame of the body
  double ref = 0, armature = 0;
  VectorXd lower, upper;  // empty for none
  JointForce force;
  bool has_force = false, is_driven = false;
  int line = 0;
};

// Where the coordinates of a joint stand in qpos.
struct Slot {
  std::string joint;
  JointKind kind = JointKind::Revolute;
  VectorXd q_ref;                         // its coordinates as the file stands
  Matrix3d R_ref = Matrix3d::Identity();  // that MuJoCo's quaternion is relative to
};

// A shape with mass.
struct Solid {
  Inertia inertia;  // in the frame of the body
  bool is_known = true;
};

struct FixedTendon {
  std::map<std::string, double> coefficients;
  int line = 0;
  bool is_used = false;
};

VectorXd toXyzw(const Matrix3d& R) { return Eigen::Quaterniond(R).coeffs(); }

SE3 translate(const Vector3d& p) { return {Matrix3d::Identity(), p}; }

class Reader {
 public:
  Reader(const std::string& path, const TiXmlElement& root) : root_(root) {
    settings_.path = path;
    tree_.path = yaml_.path = path;
    tree_.root = "world";
    tree_.links["world"] = {"world", {}, {}};
    tree_.has_own_base = true;
    places_["world"] = {"world", {}, {}};
    taken_ = {"world"};
  }

  MjcfFile read() {
    readModel();
    readSettings();
    for (const TiXmlElement* e = root_.FirstChildElement("default"); e; e = e->NextSiblingElement("default"))
      readMjcfDefaults(*e, "", settings_);
    forEach("asset", [this](const TiXmlElement& e) { readAsset(e); });
    forEachSection("actuator", [this](const TiXmlElement& section) { listDriven(section); });
    forEachSection("worldbody", [this](const TiXmlElement& e) { readContents(e, places_.at("world"), ""); });
    forEach("tendon", [this](const TiXmlElement& e) { readTendon(e); });
    forEach("equality", [this](const TiXmlElement& e) { readEquality(e); });
    joinHinges();
    addClosures();
    forEach("actuator", [this](const TiXmlElement& e) { readActuator(e); });
    forEach("keyframe", [this](const TiXmlElement& e) { readKey(e); });
    addStart();
    for (const TiXmlElement* e = root_.FirstChildElement(); e; e = e->NextSiblingElement()) noteSection(*e);
    for (const auto& [name, tendon] : tendons_)
      if (!tendon.is_used) settings_.notes.add("<fixed>", tendon.line, "the tendon is left out");
    tree_.warnings = settings_.notes.format(settings_.path);
    return {std::move(tree_), std::move(yaml_)};
  }

 private:
  template <typename F>
  void forEachSection(const char* tag, const F& f) {
    for (const TiXmlElement* e = root_.FirstChildElement(tag); e; e = e->NextSiblingElement(tag)) f(*e);
  }
  template <typename F>
  void forEach(const char* tag, const F& f) {
    forEachSection(tag, [&](const TiXmlElement& section) {
      for (const TiXmlElement* e = section.FirstChildElement(); e; e = e->NextSiblingElement()) f(*e);
    });
  }

  void noteElement(const TiXmlElement& e, const std::string& problem = "left out") {
    settings_.notes.add("<" + e.ValueStr() + ">", e.Row(), problem);
  }

  [[noreturn]] void refuse(const TiXmlElement& e, const std::string& problem, const std::string& remedy) const {
    throw ModelError(settings_.path, "<" + e.ValueStr() + "> (line " + std::to_string(e.Row()) + ")", problem, remedy);
  }

  // A name that nothing else has: that of the file, or one made from `made`.
  std::string makeName(const std::string& made) {
    std::string name = made;
    for (int i = 2; !taken_.insert(name).second; ++i) name = made + "_" + std::to_string(i);
    return name;
  }

  // ---- what holds for the whole file

  void readModel() {
    tree_.name = getAttribute(&root_, "model");
    if (tree_.name.empty()) tree_.name = std::filesystem::path(settings_.path).stem().string();
    if (tree_.name.empty()) tree_.name = "robot";
  }

  void readSettings() {
    forEachSection("compiler", [this](const TiXmlElement& e) { readCompiler(e); });
    forEachSection("option", [this](const TiXmlElement& e) {
      MjcfElement option(e, "", settings_);
      yaml_.gravity = option.getVector("gravity", yaml_.gravity.value_or(Vector3d(0, 0, -9.81)));
      for (const TiXmlElement* flag = e.FirstChildElement(); flag; flag = flag->NextSiblingElement())
        MjcfElement(*flag, "", settings_);
    });
    if (!yaml_.gravity) yaml_.gravity = Vector3d(0, 0, -9.81);
  }

  void readCompiler(const TiXmlElement& e) {
    MjcfElement compiler(e, "", settings_);
    const std::string angle = compiler.getText("angle"), euler = compiler.getText("eulerseq", settings_.euler);
    if (!angle.empty() && angle != "degree" && angle != "radian")
      compiler.fail("its angle is '" + angle + "'", "use degree or radian");
    if (!angle.empty()) settings_.angle = angle == "degree" ? EIGEN_PI / 180 : 1;
    if (euler.size() != 3 || euler.find_first_not_of("xyzXYZ") != std::string::npos)
      compiler.fail("its eulerseq is '" + euler + "'", "give three of x, y, z, X, Y and Z");
    settings_.euler = euler;
    if (compiler.getText("coordinate", "local") != "local")
      compiler.fail("its coordinates are global", "save the model by a version of MuJoCo before 2.3.4, in local ones");
    settings_.auto_limits = compiler.getFlag("autolimits", settings_.auto_limits);
    inertia_from_geom_ = compiler.getText("inertiafromgeom", inertia_from_geom_);
    if (inertia_from_geom_ != "true" && inertia_from_geom_ != "false" && inertia_from_geom_ != "auto")
      compiler.fail("its inertiafromgeom is '" + inertia_from_geom_ + "'", "use true, false or auto");
    mesh_directory_ = compiler.getText("meshdir", compiler.getText("assetdir", mesh_directory_));
  }

  void readAsset(const TiXmlElement& e) {
    if (e.ValueStr() != "mesh") return noteElement(e);
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
  void noteSection(const TiXmlElement& e) {
    static const std::set<std::string> read = {"compiler", "option",   "default",  "asset",   "worldbody",
                                               "tendon",   "equality", "actuator", "keyframe"};
    static const std::set<std::string> unable = {"include", "deformable", "extension"};
    const std::string& tag = e.ValueStr();
    if (read.count(tag)) return;
    if (unable.count(tag))
      refuse(e, "such elements are not read", "save the model by MuJoCo as one file (mj_saveLastXML), or remove it");
    if (!e.FirstChildElement()) return noteElement(e);
    for (const TiXmlElement* c = e.FirstChildElement(); c; c = c->NextSiblingElement())
      settings_.notes.add("<" + tag + "> <" + c->ValueStr() + ">", c->Row(), "left out");
  }

  // ---- bodies

  struct Child {
    const TiXmlElement* element;
    SE3 X_BF;  // of the frames around it
    std::string childclass;
  };

  // The children of a body, also those in <frame>.
  void flatten(const TiXmlElement& body, const SE3& X_BF, const std::string& childclass, std::vector<Child>& out) {
    for (const TiXmlElement* e = body.FirstChildElement(); e; e = e->NextSiblingElement()) {
      if (e->ValueStr() != "frame") {
        out.push_back({e, X_BF, childclass});
        continue;
      }
      MjcfElement frame(*e, "", settings_);
      const SE3 X = X_BF * frame.getPose();
      flatten(*e, X, frame.getText("childclass", childclass), out);
    }
  }

  void readContents(const TiXmlElement& e, const BodyPlace& place, const std::string& childclass) {
    std::vector<Child> children;
    flatten(e, {}, childclass, children);
    readContents(children, place);
  }

  void readContents(const std::vector<Child>& children, const BodyPlace& place) {
    readShapes(children, place);
    for (const Child& child : children) {
      const std::string& tag = child.element->ValueStr();
      static const std::set<std::string> read = {"geom", "site", "joint", "freejoint", "inertial"};
      static const std::set<std::string> unable = {"include", "attach", "replicate", "composite", "flexcomp", "plugin"};
      if (unable.count(tag))
        refuse(*child.element, "such elements are not read",
               "save the model by MuJoCo as one file (mj_saveLastXML), or remove it");
      if (tag == "body")
        readBody(child, place);
      else if (!read.count(tag))
        noteElement(*child.element);
    }
  }

  void readBody(const Child& child, const BodyPlace& parent) {
    const TiXmlElement& e = *child.element;
    MjcfElement body(e, "", settings_);
    if (body.getFlag("mocap", false)) body.note("it is not moved from outside here");
    std::string file_name = getAttribute(&e, "name");
    const std::string name = makeName(file_name.empty() ? "body_" + std::to_string(e.Row()) : file_name);
    if (!file_name.empty() && name != file_name) body.fail("its name is taken", "rename it");
    const SE3 X_PB = child.X_BF * body.getPose();
    std::vector<Child> children;
    flatten(e, {}, body.getText("childclass", child.childclass), children);
    BodyPlace place = {name, {}, parent.X_WB * X_PB};
    place.X_LB = addJoints(body, name, children, parent, X_PB);
    tree_.links[name].inertia = readInertia(body, children).transformed(place.X_LB);
    places_[name] = place;
    readContents(children, place);
  }

  // Adds the links from the parent to the body; returns the frame of the body in its link.
  SE3 addJoints(const MjcfElement& body, const std::string& link, const std::vector<Child>& children,
                const BodyPlace& parent, const SE3& X_PB) {
    std::vector<Element> elements;
    for (const Child& child : children)
      if (child.element->ValueStr() == "joint" || child.element->ValueStr() == "freejoint")
        elements.push_back(readJoint(child, link));
    const SE3 X_LP = parent.X_LB;
    if (elements.empty()) {
      addLink(link, parent.link, JointKind::Fixed, link + "_fixed", X_LP * X_PB);
      return {};
    }
    if (elements.front().type == "free") {
      if (elements.size() > 1 || parent.link != "world")
        body.fail("it has a free joint beside another joint, or on a moving body", "only bodies of the world are free");
      addFree(elements.front(), link, X_PB);
      return {};
    }
    if (addCompound(elements, link, parent.link, X_LP * X_PB)) return {};
    SE3 X = X_LP * X_PB;
    std::string above = parent.link;
    for (size_t i = 0; i < elements.size(); ++i) {
      const Element& element = elements[i];
      if (element.type == "free") body.fail("it has a free joint beside another joint", "remove one");
      const std::string below = i + 1 < elements.size() ? makeName(link + "/" + element.name) : link;
      addSingle(element, below, above, X * translate(element.pos));
      X = translate(-element.pos);
      above = below;
    }
    return X;
  }

  UrdfJoint& addLink(const std::string& link, const std::string& parent, JointKind kind, const std::string& name,
                     const SE3& X_PJ) {
    tree_.links[link].name = link;
    UrdfJoint joint;
    joint.parent = parent;
    joint.child = link;
    joint.joint.name = name;
    joint.joint.kind = kind;
    joint.joint.X_PJ = X_PJ;
    tree_.joints.push_back(std::move(joint));
    if (tree_.joints.size() > kMostJoints)
      throw ModelError(settings_.path, "document",
                       "it has more than " + std::to_string(kMostJoints) + " bodies or sites",
                       "no robot needs so many");
    return tree_.joints.back();
  }

  // The link itself or a site that stands there, else a new frame. A ball has no axes to care for.
  std::string findFrame(const std::string& link, const SE3& X, bool is_ball, const std::string& made) {
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
  void addSingle(const Element& element, const std::string& link, const std::string& parent, const SE3& X_PB) {
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

  void addFree(const Element& element, const std::string& link, const SE3& X_WB) {
    addLink(link, "world", JointKind::FreeFlyer, element.name, {});
    VectorXd q(7);
    q << X_WB.p, toXyzw(X_WB.R);
    slots_.push_back({element.name, JointKind::FreeFlyer, q, Matrix3d::Identity()});
    if (element.armature != 0) yaml_.armature[element.name] = element.armature;
  }

  // One joint of ours in several elements (io/mjcf_coordinates.h), recognised by names and geometry.
  bool addCompound(const std::vector<Element>& elements, const std::string& link, const std::string& parent,
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
        if (!(R * elements[k].axis).isApprox(plane.col(k), kSame)) return false;
    } else if (types == "slide slide slide ball " && suffixes == ".x .y .z  ") {
      joint.kind = JointKind::FreeFlyer;
      for (int k = 0; k < 3; ++k) slot.R_ref.row(k) = elements[k].axis;
      if (!slot.R_ref.isUnitary(kSame) || slot.R_ref.determinant() < 0) return false;
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

  static void setLimits(const std::vector<Element>& elements, UrdfJoint& joint) {
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

  Element readJoint(const Child& child, const std::string& body) {
    MjcfElement e(*child.element, child.childclass, settings_);
    Element out;
    out.line = e.line();
    const std::string given = getAttribute(child.element, "name");
    const bool is_free = child.element->ValueStr() == "freejoint";
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

  void readRange(MjcfElement& e, bool has_one, double unit, Element& out) {
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

  void readForce(MjcfElement& e, bool has_one, double unit, Element& out) {
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
  void readJointClamp(MjcfElement& e, const Element& joint) {
    if (!e.isLimited("actuatorfrclimited", "actuatorfrcrange")) return;
    const std::vector<double> range = e.getNumbers("actuatorfrcrange", 2, 2);
    clamps_[joint.name] = std::min(std::abs(range[0]), std::abs(range[1]));
    if (range[0] != -range[1]) e.note("its actuatorfrcrange is not symmetric: the smaller side counts for both");
  }

  // ---- inertia and shapes

  Inertia readInertia(const MjcfElement& body, const std::vector<Child>& children) {
    const TiXmlElement* given = nullptr;
    SE3 X;
    for (const Child& child : children) {
      if (child.element->ValueStr() != "inertial") continue;
      if (given) refuse(*child.element, "the body has two inertias", "keep one");
      given = child.element;
      X = child.X_BF;
    }
    Inertia sum;
    if (!given || inertia_from_geom_ == "true") {
      if (given) noteElement(*given, "left out, because inertiafromgeom is true");
      if (inertia_from_geom_ == "false") return {};
      for (const Child& child : children)
        if (child.element->ValueStr() == "geom") sum = sum + readSolid(child);
      return sum;
    }
    MjcfElement e(*given, "", settings_);
    if (!e.find("mass")) e.fail("it has no mass", "give one");
    const double mass = e.getNumber("mass", 0);
    if (!(mass >= 0)) e.fail("its mass is negative", "give 0 or more");
    if (!e.find("pos")) e.fail("it has no pos", "give the centre of mass");
    Matrix3d I = Matrix3d::Zero();
    const std::vector<double> diagonal = e.getNumbers("diaginertia", 3, 3), full = e.getNumbers("fullinertia", 6, 6);
    const SE3 X_BI = e.getPose();
    if (diagonal.empty() == full.empty())
      e.fail(full.empty() ? "it has no diaginertia or fullinertia" : "it has both diaginertia and fullinertia",
             "give one of them");
    if (!diagonal.empty()) I.diagonal() << diagonal[0], diagonal[1], diagonal[2];
    if (!full.empty()) {
      if (e.find("quat") || e.find("euler") || e.find("axisangle") || e.find("xyaxes") || e.find("zaxis"))
        e.fail("it has a fullinertia and an orientation", "keep one: fullinertia is in the axes of the body");
      I << full[0], full[3], full[4], full[3], full[1], full[5], full[4], full[5], full[2];
    }
    (void)body;
    return Inertia{mass, Vector3d::Zero(), I}.transformed(X * X_BI);
  }

  // Size (half edges; radius and half length; radius) and place of a geom; `fromto` gives both ends.
  struct Shape {
    std::string type;
    Vector3d size = Vector3d::Zero();
    SE3 X_BG;
  };
  Shape readShape(MjcfElement& e, const SE3& X_BF) {
    Shape out;
    out.type = e.getText("type", e.find("mesh") ? "mesh" : "sphere");
    const std::vector<double> size = e.getNumbers("size", 1, 3), ends = e.getNumbers("fromto", 6, 6);
    for (size_t i = 0; i < size.size(); ++i) out.size[static_cast<Eigen::Index>(i)] = size[i];
    SE3 X = e.getPose();
    const bool is_long =
        out.type == "capsule" || out.type == "cylinder" || out.type == "box" || out.type == "ellipsoid";
    if (!ends.empty() && is_long) {
      const Vector3d from(ends[0], ends[1], ends[2]), to(ends[3], ends[4], ends[5]), along = from - to;
      const double length = along.stableNorm();
      if (!(length > 1e-12) || !std::isfinite(length)) e.fail("the two points of its fromto are one", "move one");
      X.p = (from + to) / 2;
      X.R = Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), along / length).toRotationMatrix();
      const bool is_round = out.type == "capsule" || out.type == "cylinder";
      if (!is_round) out.size[1] = out.size[0];
      out.size[is_round ? 1 : 2] = length / 2;
    }
    if ((out.size.array() < 0).any()) e.fail("its size is negative", "give positive numbers");
    out.X_BG = X_BF * X;
    return out;
  }

  Inertia readSolid(const Child& child) {
    MjcfElement e(*child.element, child.childclass, settings_);
    const Shape shape = readShape(e, child.X_BF);
    for (const char* read : kGeomAttributes) e.find(read);
    const double density = e.getNumber("density", 1000), *given = nullptr;
    const double mass_given = e.getNumber("mass", -1);
    if (e.find("mass")) given = &mass_given;
    if ((given && !(*given >= 0)) || !(density >= 0)) e.fail("its mass or density is negative", "give 0 or more");
    if ((given ? *given : density) == 0 || shape.type == "plane" || shape.type == "hfield") return {};
    if (shape.type == "mesh" || shape.type == "sdf")
      e.fail("the mass of the body comes from this " + shape.type + ", which is not read",
             "give the body an <inertial>, as MuJoCo writes when it saves the model");
    const double a = shape.size[0], b = shape.size[1], c = shape.size[2];
    double volume = 0;
    Vector3d moments = Vector3d::Zero();  // per mass
    const auto fromSquares = [](double xx, double yy, double zz) { return Vector3d(yy + zz, xx + zz, xx + yy); };
    if (shape.type == "sphere" || shape.type == "ellipsoid") {
      const double y = shape.type == "sphere" ? a : b, z = shape.type == "sphere" ? a : c;
      volume = 4 * EIGEN_PI / 3 * a * y * z;
      moments = fromSquares(a * a / 5, y * y / 5, z * z / 5);
    } else if (shape.type == "box") {
      volume = 8 * a * b * c;
      moments = fromSquares(a * a / 3, b * b / 3, c * c / 3);
    } else if (shape.type == "cylinder") {
      volume = 2 * EIGEN_PI * a * a * b;
      moments = fromSquares(a * a / 4, a * a / 4, b * b / 3);
    } else if (shape.type == "capsule") {
      // A cylinder and two half balls, whose centres of mass are 3/8 of the radius beyond its ends.
      const double tube = 2 * EIGEN_PI * a * a * b, ball = 4 * EIGEN_PI / 3 * a * a * a, far = b + 3 * a / 8;
      volume = tube + ball;
      if (!(volume > 0)) return {};
      const double xx = (tube * a * a / 4 + ball * a * a / 5) / volume,
                   zz = (tube * b * b / 3 + ball * (a * a / 5 - 9 * a * a / 64 + far * far)) / volume;
      moments = fromSquares(xx, xx, zz);
    } else {
      e.fail("its type '" + shape.type + "' is unknown",
             "use sphere, capsule, ellipsoid, cylinder, box, mesh or plane");
    }
    const double mass = given ? *given : density * volume;
    return Inertia{mass, Vector3d::Zero(), Matrix3d((mass * moments).asDiagonal())}.transformed(shape.X_BG);
  }

  struct Sphere {
    Vector3d centre;
    double radius;
  };

  // Sites become frames. Spheres NAME.1 .. NAME.4, or NAME.1 alone, at a site NAME are the soles that the writer writes;
  // all other geoms are drawn.
  void readShapes(const std::vector<Child>& children, const BodyPlace& place) {
    std::map<std::string, Sphere> spheres;
    std::set<std::string> soles;
    for (const Child& child : children) {
      const std::string name = getAttribute(child.element, "name");
      if (child.element->ValueStr() != "geom" || name.empty()) continue;
      MjcfElement e(*child.element, child.childclass, settings_);
      for (const char* read : kGeomAttributes) e.find(read);
      const Shape shape = readShape(e, child.X_BF);
      if (shape.type == "sphere") spheres[name] = {shape.X_BG.p, shape.size[0]};
    }
    for (const Child& child : children)
      if (child.element->ValueStr() == "site") readSite(child, place, spheres, soles);
    for (const Child& child : children)
      if (child.element->ValueStr() == "geom" && !soles.count(getAttribute(child.element, "name")))
        readVisual(child, place);
  }

  void readSite(const Child& child, const BodyPlace& place, const std::map<std::string, Sphere>& spheres,
                std::set<std::string>& soles) {
    MjcfElement e(*child.element, child.childclass, settings_);
    for (const char* drawn : {"type", "size", "rgba", "material"}) e.find(drawn);
    if (e.find("fromto")) e.fail("sites by fromto are not read", "give its pos and quat");
    const SE3 X_BS = child.X_BF * e.getPose();
    const std::string site = getAttribute(child.element, "name");
    const std::string name = makeName(site.empty() ? "site_" + std::to_string(e.line()) : site);
    if (!site.empty()) {
      if (sites_.count(site)) e.fail("two sites have this name", "rename one of them");
      sites_[site] = {place.link, place.X_LB * X_BS, place.X_WB * X_BS};
      if (name != site) e.note("its frame is named '" + name + "': another element is named '" + site + "'");
    }
    addLink(name, place.link, JointKind::Fixed, name + "_frame", place.X_LB * X_BS);
    std::vector<Vector3d> corners;
    for (int i = 1; i <= 4; ++i)
      if (const auto it = spheres.find(site + "." + std::to_string(i)); it != spheres.end())
        corners.push_back(X_BS.inverse().act(it->second.centre) - Vector3d(0, 0, it->second.radius));
    ContactSpec contact;
    contact.name = site;
    contact.frame = name;
    if (site.empty()) return;
    if (corners.size() == 1 && corners[0].isZero(kSame)) {
      contact.kind = ContactKind::Point3D;
    } else if (corners.size() == 4) {
      const double length = corners[0].x(), width = corners[0].y();
      for (int i = 0; i < 4; ++i)
        if (!(corners[i] - Vector3d((i < 2 ? 1 : -1) * length, (i % 2 == 0 ? 1 : -1) * width, 0)).isZero(kSame)) return;
      contact.half_length = round(length);
      contact.half_width = round(width);
    } else {
      return;
    }
    yaml_.contacts.push_back(contact);
    for (int i = 1; i <= 4; ++i) soles.insert(site + "." + std::to_string(i));
  }

  // Sizes of soles are differences of places: their rounding is removed.
  static double round(double length) { return std::round(std::abs(length) * 1e12) / 1e12; }

  void readVisual(const Child& child, const BodyPlace& place) {
    MjcfElement e(*child.element, child.childclass, settings_);
    const Shape shape = readShape(e, child.X_BF);
    for (const char* read : kGeomAttributes) e.find(read);
    const bool touches = e.getNumber("contype", 1) != 0 || e.getNumber("conaffinity", 1) != 0;
    Visual visual;
    visual.X_BV = place.X_LB * shape.X_BG;
    const std::vector<double> rgba = e.getNumbers("rgba", 4, 4);
    for (size_t i = 0; i < rgba.size(); ++i) visual.rgba[static_cast<Eigen::Index>(i)] = rgba[i];
    const Vector3d& size = shape.size;
    if (shape.type == "box") {
      visual.shape = Visual::Shape::Box;
      visual.size = 2 * size;
    } else if (shape.type == "sphere") {
      visual.shape = Visual::Shape::Sphere;
      visual.size = {size[0], 0, 0};
    } else if (shape.type == "cylinder" || shape.type == "capsule") {
      visual.shape = Visual::Shape::Cylinder;
      visual.size = {size[0], 2 * size[1], 0};
    } else if (const auto mesh = meshes_.find(e.getText("mesh")); shape.type == "mesh" && mesh != meshes_.end()) {
      visual.shape = Visual::Shape::Mesh;
      visual.size = mesh->second.size;
      visual.mesh = mesh->second.mesh;
    } else {
      return e.leaveOut("a geom of type '" + shape.type + "' is left out");
    }
    if (shape.type == "capsule") e.note("a capsule is drawn as a cylinder");
    if (touches) e.note("it is drawn; it touches nothing here (feet: the key contacts of a YAML file)");
    tree_.links[place.link].visuals.push_back(visual);
  }

  // ---- equalities

  struct Tie {
    ClosureKind kind;
    std::string name, body1, body2;  // links
    SE3 X_L1, X_L2;
    Vector3d axis = Vector3d::UnitZ();
    std::string coupler;  // a coupler is a ClosureSpec already
    int line = 0;
  };

  const BodyPlace& findBody(MjcfElement& e, const char* attribute) {
    const std::string name = e.getText(attribute, "world");
    const auto it = places_.find(name);
    if (it == places_.end()) e.fail("there is no body '" + name + "'", "correct the name");
    return it->second;
  }

  const BodyPlace& findSite(MjcfElement& e, const char* attribute) {
    const std::string name = e.getText(attribute);
    const auto it = sites_.find(name);
    if (it == sites_.end()) e.fail("there is no site '" + name + "'", "correct the name");
    return it->second;
  }

  void readEquality(const TiXmlElement& element) {
    MjcfElement e(element, "", settings_, "equality");
    if (!e.getFlag("active", true)) return e.leaveOut("it is not active, and left out");
    std::string name = getAttribute(&element, "name");
    if (name.empty()) name = e.tag() + "_" + std::to_string(e.line());
    if (e.tag() == "connect" || e.tag() == "weld") return readTie(e, name);
    if (e.tag() == "joint") return readJointEquality(e, name);
    if (e.tag() == "tendon") return readTendonEquality(e, name);
    e.fail("such equalities are not read", "use connect, weld, joint or a tendon of joints, or remove it");
  }

  void readTie(MjcfElement& e, const std::string& name) {
    Tie tie;
    tie.name = name;
    tie.line = e.line();
    tie.kind = e.tag() == "weld" ? ClosureKind::Weld6D : ClosureKind::Ball3D;
    if (e.find("site1") || e.find("site2")) {
      // Two sites are brought together, wherever the bodies stand.
      const BodyPlace &one = findSite(e, "site1"), &two = findSite(e, "site2");
      tie.body1 = one.link, tie.body2 = two.link;
      tie.X_L1 = one.X_LB, tie.X_L2 = two.X_LB;
    } else {
      if (!e.find("body1")) e.fail("it has no body1", "name the first body");
      const BodyPlace &one = findBody(e, "body1"), &two = findBody(e, "body2");
      const SE3 X_12 = one.X_WB.inverse() * two.X_WB;
      const Vector3d anchor = e.getVector("anchor", Vector3d::Zero());
      tie.body1 = one.link, tie.body2 = two.link;
      if (tie.kind == ClosureKind::Weld6D) {
        e.find("torquescale");
        tie.X_L1 = one.X_LB * X_12 * translate(anchor);
        tie.X_L2 = two.X_LB * translate(anchor);
        const std::vector<double> relative = e.getNumbers("relpose", 7, 7);
        if (!relative.empty()) {
          const Eigen::Vector4d q(relative[4], relative[5], relative[6], relative[3]);
          const double norm = q.stableNorm();
          // The anchor belongs to body 2 alone. A quaternion of zeros: as the bodies stand.
          if (norm > 1e-12 && std::isfinite(norm))
            tie.X_L1 = one.X_LB *
                       SE3(Eigen::Quaterniond(q / norm).toRotationMatrix(), {relative[0], relative[1], relative[2]});
        }
      } else {
        if (!e.find("anchor"))
          e.fail("it has no anchor", "give the point that the bodies share, in the frame of body1");
        tie.X_L1 = one.X_LB * translate(anchor);
        tie.X_L2 = two.X_LB * X_12.inverse() * translate(anchor);
      }
    }
    ties_.push_back(tie);
  }

  // Two points NAME.1 and NAME.2 that tie the same bodies make the hinge that the writer wrote.
  void joinHinges() {
    for (size_t i = 0; i + 1 < ties_.size(); ++i) {
      Tie &a = ties_[i], &b = ties_[i + 1];
      if (a.kind != ClosureKind::Ball3D || b.kind != ClosureKind::Ball3D || a.body1 != b.body1 || a.body2 != b.body2 ||
          a.name.size() < 3)
        continue;
      const std::string stem = a.name.substr(0, a.name.size() - 2);
      const Vector3d along = a.X_L1.p - b.X_L1.p, along2 = a.X_L1.R * a.X_L2.R.transpose() * (a.X_L2.p - b.X_L2.p);
      if (a.name != stem + ".1" || b.name != stem + ".2" || !(along.norm() > 1e-6) || !along.isApprox(along2, 1e-6))
        continue;
      a.kind = ClosureKind::Hinge5D;
      a.name = stem;
      a.axis = a.X_L1.R.transpose() * along.normalized();
      a.X_L1.p = (a.X_L1.p + b.X_L1.p) / 2;
      a.X_L2.p = (a.X_L2.p + b.X_L2.p) / 2;
      ties_.erase(ties_.begin() + static_cast<std::ptrdiff_t>(i) + 1);
    }
  }

  void addClosures() {
    for (const Tie& tie : ties_) {
      ClosureSpec closure;
      closure.name = tie.name;
      closure.kind = tie.kind;
      if (!tie.coupler.empty()) {
        closure = couplers_.at(tie.coupler);
      } else {
        const bool is_ball = tie.kind == ClosureKind::Ball3D;
        closure.axis = tie.axis;
        closure.frame1 = findFrame(tie.body1, tie.X_L1, is_ball, tie.name + "_frame1");
        closure.frame2 = findFrame(tie.body2, tie.X_L2, is_ball, tie.name + "_frame2");
      }
      yaml_.closures.push_back(closure);
    }
  }

  void addCoupler(const std::string& name, ClosureSpec coupler, const MjcfElement& e) {
    coupler.name = name;
    coupler.kind = ClosureKind::Coupler;
    if (!couplers_.emplace(name, coupler).second) e.fail("two equalities have this name", "rename one of them");
    Tie tie;
    tie.kind = ClosureKind::Coupler;
    tie.name = tie.coupler = name;
    ties_.push_back(tie);
  }

  const Slot& findSlot(const MjcfElement& e, const std::string& joint) const {
    for (const Slot& slot : slots_)
      if (slot.joint == joint) {
        if (slot.q_ref.size() != 1) e.fail("joint '" + joint + "' has several coordinates", "name a hinge or a slide");
        return slot;
      }
    e.fail("there is no joint '" + joint + "'", "correct the name");
  }

  // Coefficients 0 and 1 of a polynomial without others.
  std::array<double, 2> readLine(MjcfElement& e) {
    std::vector<double> p = e.getNumbers("polycoef", 1, 5);
    if (p.empty()) p = {0, 1};
    p.resize(5);
    if (p[2] != 0 || p[3] != 0 || p[4] != 0)
      e.fail("its polycoef is of degree 2 or more", "only y = a + b x can be said here: linearise it, or remove it");
    return {p[0], p[1]};
  }

  // y - y_ref = a + b (x - x_ref)
  void readJointEquality(MjcfElement& e, const std::string& name) {
    const std::string y = e.getText("joint1"), x = e.getText("joint2");
    const auto [a, b] = readLine(e);
    if (y.empty()) e.fail("it has no joint1", "name one");
    const double y_ref = findSlot(e, y).q_ref[0];
    if (x.empty() || b == 0) e.fail("it holds one joint alone", "remove the joint, so that the body is fixed");
    const double x_ref = findSlot(e, x).q_ref[0];
    if (x == y) e.fail("it couples a joint with itself", "name two joints");
    ClosureSpec coupler;
    coupler.coefficients = {{y, 1}, {x, -b}};
    coupler.offset = y_ref + a - b * x_ref;
    addCoupler(name, coupler, e);
  }

  void readTendon(const TiXmlElement& element) {
    if (element.ValueStr() == "spatial") return readSpatialTendon(element);
    if (element.ValueStr() != "fixed") return noteElement(element, "the tendon is left out");
    MjcfElement e(element, "", settings_, "tendon");
    FixedTendon tendon;
    tendon.line = e.line();
    for (const TiXmlElement* j = element.FirstChildElement("joint"); j; j = j->NextSiblingElement("joint")) {
      MjcfElement term(*j, "", settings_, "");
      const std::string joint = term.getText("joint");
      findSlot(term, joint);
      if (!term.find("coef")) term.fail("it has no coef", "give one");
      if (!tendon.coefficients.emplace(joint, term.getNumber("coef", 0)).second)
        term.fail("the tendon has this joint twice", "add the coefficients up");
    }
    const std::string name = getAttribute(&element, "name");
    if (name.empty()) return noteElement(element, "the tendon is left out");
    if (!tendons_.emplace(name, tendon).second) e.fail("two tendons have this name", "rename one of them");
  }

  // A spring or damper between two sites; a tendon that bends or carries only load of its own has no like here.
  void readSpatialTendon(const TiXmlElement& element) {
    MjcfElement e(element, "", settings_, "tendon");
    std::vector<const TiXmlElement*> sites;
    for (const TiXmlElement* s = element.FirstChildElement(); s; s = s->NextSiblingElement()) {
      if (s->ValueStr() != "site") return e.leaveOut("it bends about a <" + s->ValueStr() + ">, and is left out");
      sites.push_back(s);
    }
    if (sites.size() != 2) return e.leaveOut("it does not run between two sites, and is left out");
    const auto find = [&](const TiXmlElement& site) {
      MjcfElement end(site, "", settings_, "");
      return findSite(end, "site");
    };
    const BodyPlace one = find(*sites[0]), two = find(*sites[1]);
    PointSpringSpec spec{one.link, two.link, {}};
    PointSpring& spring = spec.spring;
    spring.point1 = one.X_LB.p;
    spring.point2 = two.X_LB.p;
    spring.stiffness = e.getNumber("stiffness", 0);
    spring.damping = e.getNumber("damping", 0);
    const std::vector<double> lengths = e.getNumbers("springlength", 1, 2);
    // Without one, or with -1, as long as the file stands.
    spring.rest = lengths.empty() || lengths[0] < 0 ? (two.X_WB.p - one.X_WB.p).norm() : lengths[0];
    for (const char* without_meaning : {"width", "material", "rgba", "group", "user"}) e.find(without_meaning);
    if (lengths.size() == 2 && lengths[1] != lengths[0])
      return e.leaveOut("its spring is slack between two lengths, and it is left out");
    if (spring.stiffness == 0 && spring.damping == 0) return e.leaveOut("it has no spring or damper, and is left out");
    if (e.isLimited("limited", "range")) e.note("the limits of its length are left out"), e.find("range");
    if (e.getNumber("frictionloss", 0) != 0) e.note("its frictionloss is left out");
    spring.name = getAttribute(&element, "name");
    if (spring.name.empty()) spring.name = "tendon_" + std::to_string(e.line());
    yaml_.point_springs.push_back(spec);
  }

  // L1 - L1_ref = a + b (L2 - L2_ref) of sums of coordinates
  void readTendonEquality(MjcfElement& e, const std::string& name) {
    const std::string first = e.getText("tendon1"), second = e.getText("tendon2");
    const auto [a, b] = readLine(e);
    ClosureSpec coupler;
    coupler.offset = a;
    const auto add = [&](const std::string& tendon, double factor) {
      const auto it = tendons_.find(tendon);
      if (it == tendons_.end()) e.fail("there is no tendon of joints '" + tendon + "'", "name a <fixed> tendon");
      it->second.is_used = true;
      for (const auto& [joint, coefficient] : it->second.coefficients) {
        coupler.coefficients[joint] += factor * coefficient;
        coupler.offset += factor * coefficient * findSlot(e, joint).q_ref[0];
      }
    };
    add(first, 1);
    if (!second.empty()) add(second, -b);
    for (auto it = coupler.coefficients.begin(); it != coupler.coefficients.end();)
      it = it->second == 0 ? coupler.coefficients.erase(it) : std::next(it);
    addCoupler(name, coupler, e);
  }

  // ---- actuators

  void listDriven(const TiXmlElement& section) {
    for (const TiXmlElement* e = section.FirstChildElement(); e; e = e->NextSiblingElement())
      driven_.insert(getAttribute(e, "joint")), driven_.insert(getAttribute(e, "jointinparent"));
    driven_.erase("");
  }

  void readActuator(const TiXmlElement& element) {
    static const std::set<std::string> servos = {"position", "velocity", "intvelocity", "damper", "general"};
    MjcfElement e(element, "", settings_);
    const std::string joint = e.getText("joint", e.getText("jointinparent"));
    if (joint.empty() || (e.tag() != "motor" && !servos.count(e.tag())))
      return e.leaveOut("the actuator is left out: motors drive joints here");
    const auto slot = std::find_if(slots_.begin(), slots_.end(), [&](const Slot& s) { return s.joint == joint; });
    if (slot == slots_.end()) e.fail("there is no joint '" + joint + "'", "correct the name");
    if (slot->q_ref.size() != 1) return e.leaveOut("the actuator is left out: its joint has several coordinates");
    for (const MotorSpec& other : yaml_.motors)
      if (other.joint == joint) return e.leaveOut("a second actuator of a joint is left out");
    const std::vector<double> gears = e.getNumbers("gear", 1, 6);
    const double gear = gears.empty() ? 1 : gears[0];
    if (gear == 0) return e.leaveOut("an actuator of gear 0 is left out");
    if (gear != 1) e.note("its input is the torque or force of its joint here, not that before the gear");
    const bool is_general = e.tag() == "general";
    const bool is_ideal =
        e.tag() == "motor" || (is_general && e.getText("dyntype", "none") == "none" &&
                               e.getText("biastype", "none") == "none" && e.getText("gaintype", "fixed") == "fixed");
    if (!is_ideal) e.note("its servo is left out: it is a motor of ideal torque here");
    const std::vector<double> gains = is_general ? e.getNumbers("gainprm", 1, 10) : std::vector<double>();
    const double gain = gains.empty() ? 1 : std::abs(gains[0]);

    MotorSpec motor;
    motor.joint = joint;
    double effort = std::numeric_limits<double>::infinity();
    const auto limit = [&](const char* range, double factor) {
      const std::vector<double> values = e.getNumbers(range, 2, 2);
      if (values[0] != -values[1]) e.note(std::string("its ") + range + " is not symmetric: the smaller side counts");
      effort = std::min(effort, factor * std::min(std::abs(values[0]), std::abs(values[1])));
    };
    if (e.isLimited("forcelimited", "forcerange")) limit("forcerange", std::abs(gear));
    if (e.isLimited("ctrllimited", "ctrlrange")) {
      if (is_ideal)
        limit("ctrlrange", std::abs(gear) * gain);
      else
        e.find("ctrlrange");
    }
    if (const auto clamp = clamps_.find(joint); clamp != clamps_.end()) effort = std::min(effort, clamp->second);
    if (!(effort > 0)) {
      e.note("its limits leave it no torque on one side; they are left out");
    } else if (std::isfinite(effort)) {
      motor.effort = effort;
    }
    yaml_.motors.push_back(motor);
    const std::string name = getAttribute(&element, "name");
    if (!name.empty() && name != joint) e.note("it is named after its joint here");
  }

  // ---- postures

  void readKey(const TiXmlElement& element) {
    if (element.ValueStr() != "key") return noteElement(element);
    MjcfElement e(element, "", settings_);
    std::string name = getAttribute(&element, "name");
    if (name.empty()) name = "key_" + std::to_string(yaml_.references.size() + 1);
    Eigen::Index nq = 0;
    for (const Slot& slot : slots_) nq += slot.q_ref.size();
    if (!e.find("qpos")) return e.leaveOut("a key without qpos is left out");
    const std::vector<double> qpos = e.getNumbers("qpos", nq, nq);
    Reference reference;
    reference.name = name;
    const double* at = qpos.data();
    for (const Slot& slot : slots_) {
      std::vector<double> q(at, at + slot.q_ref.size());
      at += slot.q_ref.size();
      if (slot.kind == JointKind::Spherical || slot.kind == JointKind::FreeFlyer) {
        const size_t k = q.size() - 4;
        const Eigen::Vector4d xyzw(q[k + 1], q[k + 2], q[k + 3], q[k]);
        const double norm = xyzw.stableNorm();
        if (!(norm > 1e-12) || !std::isfinite(norm))
          e.fail("the quaternion of joint '" + slot.joint + "' has no length", "correct it");
        const Eigen::Vector4d turned =
            (Eigen::Quaterniond(slot.R_ref) * Eigen::Quaterniond(Eigen::Vector4d(xyzw / norm))).normalized().coeffs();
        std::copy(turned.data(), turned.data() + 4, q.begin() + static_cast<std::ptrdiff_t>(k));
      }
      reference.joints[slot.joint] = q;
    }
    yaml_.references.push_back(reference);
  }

  // MuJoCo closes loops where the bodies stand in the file: without a keyframe, this is the posture to start from.
  void addStart() {
    if (!yaml_.references.empty() || yaml_.closures.empty()) return;
    Reference reference;
    reference.name = "qpos0";
    for (const Slot& slot : slots_)
      reference.joints[slot.joint] = std::vector<double>(slot.q_ref.data(), slot.q_ref.data() + slot.q_ref.size());
    yaml_.references.push_back(reference);
  }

  const TiXmlElement& root_;
  MjcfSettings settings_;
  UrdfFile tree_;
  YamlFile yaml_;
  std::string inertia_from_geom_ = "auto", mesh_directory_;
  std::set<std::string> taken_, joint_names_, driven_;  // names of links; of joints; of joints with an actuator
  std::map<std::string, BodyPlace> places_, sites_;     // by name in the file
  std::map<std::string, Visual> meshes_;
  std::vector<Slot> slots_;
  std::vector<Tie> ties_;
  std::map<std::string, ClosureSpec> couplers_;
  std::map<std::string, FixedTendon> tendons_;
  std::map<std::string, double> clamps_;
};

}  // namespace

MjcfFile readMjcf(const std::string& path) {
  const std::string xml = readRobotText(path);
  if (xml.size() > kMostBytes)
    throw ModelError(path, "file", "it is larger than a file of MuJoCo may be (16 MB)", "give one without data");
  TiXmlDocument document;
  parseXml(xml, path, document);
  const TiXmlElement* root = document.RootElement();
  if (!root || root->ValueStr() != "mujoco")
    throw ModelError(path, "document", "its outermost element is not <mujoco>", "give a file of MuJoCo (MJCF)");
  return Reader(path, *root).read();
}

}  // namespace bielle
