#include "formats/reader_mjcf.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "bielle/model/error.h"
#include "formats/decimals.h"
#include "formats/reader_loops.h"
#include "formats/xml_document.h"
#include "model/joint.h"

namespace bielle {
namespace {

constexpr size_t kMostJoints = 3000;
constexpr double kCoincident = 1e-10;  // of frames; the writer's loops are closed to 1e-12

// Elements that change no mechanism, and sections of such.
bool isHarmless(const XMLElement& e) {
  static const std::set<std::string> tags = {"camera", "light",  "texture", "material", "hfield",    "skin",
                                             "size",   "visual", "sensor",  "contact",  "statistic", "deformable"};
  return tags.count(getTag(e)) > 0;
}

}  // namespace

MjcfReader::MjcfReader(const std::string& path) : settings_(path) {
  tree_.path = yaml_.path = path;
  tree_.root = "world";
  tree_.links["world"].name = "world";
  tree_.has_own_base = true;
  places_["world"] = {"world", {}, {}, true};
  taken_ = {"world"};
}

RobotFiles MjcfReader::read() {
  readModel();
  readSettings();
  forEachSection("default", [this](const XMLElement& e) { readMjcfDefaults(e, "", settings_); });
  forEach("asset", [this](const XMLElement& e) { getTag(e) == "mesh" ? readMesh(e) : noteElement(e); });
  listNamed();
  forEachSection("worldbody", [this](const XMLElement& e) { reserveNames(e); });
  forEachSection("worldbody", [this](const XMLElement& e) { readContents(e, places_.at("world"), ""); });
  scaleMasses();
  forEach("tendon", [this](const XMLElement& e) { readTendon(e); });
  forEach("equality", [this](const XMLElement& e) { readEquality(e); });
  forEach("actuator", [this](const XMLElement& e) { readActuator(e); });
  readTendonRanges();
  GeometryDecimals decimals;
  for (const XMLElement* root : settings_.files.listRoots()) decimals.add(*root, settings_.angle != 1);
  tree_.rounding = decimals.calcTolerance();
  joinHinges();
  addClosures();
  forEach("custom", [this](const XMLElement& e) { readCustom(e); });
  forEach("keyframe", [this](const XMLElement& e) { readKey(e); });
  addStart();
  for (const Slot& slot : slots_)
    softness_.start[slot.joint] = {slot.q_ref.data(), slot.q_ref.data() + slot.q_ref.size()};
  for (const XMLElement* e : getChildren(settings_.files.root())) noteSection(*e);
  settings_.notes.addTo(tree_);
  for (const Tie& tie : ties_)
    if (tie.kind == ClosureKind::Hinge5D) tree_.rounding.levers[tie.name] = tie.lever;
  return {std::move(tree_), std::move(yaml_)};
}

void MjcfReader::noteElement(const XMLElement& e, const std::string& problem) {
  const std::string &path = settings_.files.getPath(e), element = "<" + getTag(e) + ">";
  if (isHarmless(e))
    settings_.notes.addHarmless(path, element, e.GetLineNum());
  else
    settings_.notes.add(path, element, e.GetLineNum(), problem);
}

void MjcfReader::refuse(const XMLElement& e, const std::string& problem, const std::string& remedy) const {
  throw InputError(settings_.files.getPath(e), describe(e), problem, remedy);
}

// A name that nothing else has: that of the file, or one made from `made`.
std::string MjcfReader::makeName(const std::string& made) {
  std::string name = made;
  for (int i = 2; !taken_.insert(name).second; ++i) name = made + "_" + std::to_string(i);
  return name;
}

void MjcfReader::readModel() {
  tree_.name = getAttribute(&settings_.files.root(), "model");
  if (tree_.name.empty()) tree_.name = std::filesystem::path(settings_.path).stem().string();
  if (tree_.name.empty()) tree_.name = "robot";
}

void MjcfReader::readSettings() {
  forEachSection("compiler", [this](const XMLElement& e) { readCompiler(e); });
  forEachSection("option", [this](const XMLElement& e) {
    MjcfElement option(e, "", settings_);
    yaml_.gravity = option.getVector("gravity", yaml_.gravity.value_or(Vector3d(0, 0, -9.81)));
    SoftStep& step = softness_.step;
    step.duration = option.getNumber("timestep", step.duration);
    const std::string integrator = option.getText("integrator");
    if (integrator == "Euler") step.integrator = SoftIntegrator::Euler;
    if (integrator == "RK4") step.integrator = SoftIntegrator::RungeKutta;
    if (integrator == "implicit" || integrator == "implicitfast") step.integrator = SoftIntegrator::Implicit;
    for (const XMLElement* f : getChildren(e)) {
      MjcfElement flag(*f, "", settings_);
      if (flag.getText("refsafe", "enable") == "disable") step.is_safe = false;
      if (flag.getText("gravity", "enable") == "disable") has_gravity_ = false;
      if (flag.getText("equality", "enable") == "disable") has_equalities_ = false;
    }
  });
  if (!yaml_.gravity) yaml_.gravity = Vector3d(0, 0, -9.81);
  if (!has_gravity_) yaml_.gravity->setZero();
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
  mesh_directory_ = compiler.getText("meshdir", compiler.getText("assetdir", mesh_directory_));
  strips_path_ = compiler.getFlag("strippath", strips_path_);
  readInertiaSettings(compiler);
}

// Sections that are not read.
void MjcfReader::noteSection(const XMLElement& e) {
  static const std::set<std::string> read = {"compiler", "option",   "default",  "asset",  "worldbody",
                                             "tendon",   "equality", "actuator", "custom", "keyframe"};
  const std::string& tag = getTag(e);
  if (read.count(tag)) return;
  if (!e.FirstChildElement()) return noteElement(e);
  for (const XMLElement* c : getChildren(e)) {
    if (tag == "deformable" && getTag(*c) != "skin")
      refuse(*c, "bodies that bend are not supported", "remove it, or replace it by rigid bodies");
    const std::string &path = settings_.files.getPath(*c), element = "<" + tag + "> <" + getTag(*c) + ">";
    if (isHarmless(e))
      settings_.notes.addHarmless(path, element, c->GetLineNum());
    else
      settings_.notes.add(path, element, c->GetLineNum(), "left out");
  }
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
    static const std::set<std::string> unable = {"attach", "replicate", "composite", "flexcomp", "plugin"};
    if (unable.count(tag))
      refuse(*child.element, "such elements are not supported",
             tag == "plugin" ? "remove it, or replace its forces by springs of joints or tendons"
                             : "save the model with MuJoCo as one file (mj_saveLastXML), or remove it");
    if (tag == "body")
      readBody(child, place);
    else if (!read.count(tag))
      noteElement(*child.element);
  }
}

// Bodies keep their names where sites have the same.
void MjcfReader::reserveNames(const XMLElement& element) {
  for (const XMLElement* e : getChildren(element)) {
    if (getTag(*e) == "body") taken_.insert(getAttribute(e, "name"));
    if (getTag(*e) == "body" || getTag(*e) == "frame") reserveNames(*e);
  }
}

void MjcfReader::readBody(const Child& child, const BodyPlace& parent) {
  const XMLElement& e = *child.element;
  MjcfElement body(e, "", settings_);
  if (body.getFlag("mocap", false)) body.note("it cannot be moved from outside");
  std::string name = getAttribute(&e, "name");
  if (name.empty()) name = makeName("body_" + std::to_string(e.GetLineNum()));
  if (places_.count(name)) body.fail("its name is taken", "rename it");
  const SE3 X_PB = child.X_BF * body.getPose();
  std::vector<Child> children;
  flatten(e, {}, body.getText("childclass", child.childclass), children);
  const size_t num_slots = slots_.size();
  BodyPlace place = {name, {}, parent.X_WB * X_PB};
  place.parent = parent.link;
  place.X_LB = addJoints(body, name, children, parent, X_PB);
  place.is_static = parent.is_static && slots_.size() == num_slots;
  MjcfBody& soft = softness_.bodies[name];
  soft.slides &=
      parent.is_static && (parent.link == "world" || parent.parent == "world") &&
      std::none_of(children.begin(), children.end(), [](const Child& c) { return getTag(*c.element) == "body"; });
  // A body without inertia has its centre of mass, in its own frame, where it is in its parent's (MuJoCo 2.2.2 and 3.14).
  soft.centre = body.getPose().p;
  const Inertia inertia = keepBounds(readInertia(children, soft));
  soft.centre = place.X_LB.act(soft.centre);
  tree_.links[name].inertia = inertia.transformed(place.X_LB);
  places_[name] = place;
  readContents(children, place);
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
  const std::string known = findUrdfFrame(tree_, link, X, is_ball, kCoincident);
  if (!known.empty()) return known;
  const std::string name = makeName(made);
  addLink(name, link, JointKind::Fixed, name + "_frame", X);
  return name;
}

RobotFiles readMjcf(const std::string& path) { return MjcfReader(path).read(); }

MjcfSoftness readMjcfSoftness(const std::string& path) {
  MjcfReader reader(path);
  reader.read();
  return reader.softness();
}

}  // namespace bielle
