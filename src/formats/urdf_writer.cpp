#include "formats/urdf_writer.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "bielle/formats/robot_writer.h"
#include "bielle/model/error.h"
#include "formats/robot_text.h"
#include "math/direction.h"
#include "math/settled.h"
#include "model/number_text.h"

namespace bielle {
namespace {

// Of links for those who read a URDF alone: libsdformat 12.3 leaves out one of at most 1e-6 kg (crosses of universal joints), and
// all that hangs on it, without an error; DART 6.12 takes 1 kg for one without mass.
constexpr double kLeastMass = 2e-6, kLeastInertia = 1e-12;  // kg, kg m^2
// What libsdformat has for a limit that there is not. Of zeros, or of nothing, some make a joint that is locked
// (findings/urdf-zero-limits.sh).
constexpr double kNone = 1e16;

void addOrigin(XMLElement& e, const SE3& X) {
  XMLElement& origin = addElement(e, "origin", {{"xyz", formatExact(X.p)}});
  if (!X.R.isIdentity(1e-15)) setAttributes(origin, {{"rpy", formatExact(calcRollPitchYaw(settleRotation(X.R)))}});
}

class UrdfWriter {
 public:
  UrdfWriter(const Model& model, XMLDocument& document)
      : model_(model), free_root_(hasImpliedFreeFlyer(model)), document_(document) {
    for (const Body& body : model.bodies()) bodies_.insert(body.name);
  }

  /// A URDF that must do without a YAML file; what it cannot say of its tree goes to `warnings`.
  void writeAlone(bool for_drake, FormatWarnings& warnings) {
    for_drake_ = for_drake;
    warnings_ = &warnings;
    for (int i = 1; i < model_.numBodies(); ++i) {
      const JointKind kind = model_.joints()[i].kind;
      if (!for_drake && (kind == JointKind::Spherical || kind == JointKind::Universal))
        throw InputError(
            model_.name(), std::string(getName(kind)) + " joint '" + model_.joints()[i].name + "'",
            "URDF has no such joints",
            "write another format: a URDF with a YAML file (--to bielle), MJCF (--to mjcf), SDF or Drake's");
    }
    for (const Closure& c : model_.closures()) {
      if (for_drake && c.kind != ClosureKind::Coupler) continue;
      // The joint that mimics: the later one, or the other one if that mimics already.
      int y = 1;
      if (c.terms.size() == 2 && mimics_.count(c.terms[1].joint)) y = 0;
      const bool is_linear =
          std::all_of(c.terms.begin(), c.terms.end(), [](const CouplerTerm& term) { return term.isLinear(); });
      if (c.terms.size() == 2 && !is_linear)
        warn("closure '" + c.name + "'", "it is left out: <mimic> is linear; `--to bielle` and `--to mjcf` keep it");
      else if (c.terms.size() != 2 || mimics_.count(c.terms[y].joint))
        warn("closure '" + c.name + "'", for_drake ? "it is left out: <mimic> couples a joint to one other"
                                                   : "it is left out because a URDF is a tree");
      else
        mimics_[c.terms[y].joint] = {c.terms[1 - y].joint, -c.terms[1 - y].coefficient / c.terms[y].coefficient,
                                     c.offset / c.terms[y].coefficient};
    }
    write("");
  }

  void write(const std::string& remark) {
    document_.InsertEndChild(document_.NewDeclaration("xml version=\"1.0\""));
    if (!remark.empty()) document_.InsertEndChild(document_.NewComment((" " + remark + " ").c_str()));
    robot_ = &addElement(document_, "robot", {{"name", model_.name()}});
    for (int i = free_root_ ? 1 : 0; i < model_.numBodies(); ++i) {
      writeLink(i);
      if (i > (free_root_ ? 1 : 0)) writeJoint(i);
      for (const Frame* frame : frames_[i])
        if (!bodies_.count(frame->name)) writeFrame(frame->name, i, frame->X_BF);
      writeMadeFrames(i);
    }
    for (auto color = colors_.rbegin(); color != colors_.rend(); ++color) {
      XMLElement& material = addElement(*robot_, "material", {{"name", color->second}});
      addElement(material, "color", {{"rgba", color->first}});
      robot_->InsertFirstChild(&material);
    }
  }

 private:
  std::string getMaterial(const Eigen::Vector4d& rgba) {
    std::string color;
    for (int i = 0; i < 4; ++i) color += (i ? " " : "") + formatExact(rgba[i]);
    const auto it = colors_.emplace(color, "color_" + std::to_string(colors_.size() + 1)).first;
    return it->second;
  }

  void writeLink(int i) {
    const Body& body = model_.bodies()[i];
    XMLElement& link = addElement(*robot_, "link", {{"name", body.name}});
    double mass = body.inertia.mass;
    Matrix3d I = body.inertia.I_com;
    if (warnings_ && !for_drake_ && i > 0 && mass < kLeastMass) {
      warn("link '" + body.name + "'", "its mass, " + formatNumber(mass) + " kg, is written as " +
                                           formatNumber(kLeastMass) +
                                           " kg, because Gazebo drops lighter links with all that they carry");
      mass = kLeastMass;
      if (I.isZero()) I = kLeastInertia * Matrix3d::Identity();
    }
    if (mass > 0) {
      XMLElement& inertial = addElement(link, "inertial");
      addElement(inertial, "origin", {{"xyz", formatExact(body.inertia.com)}});
      addElement(inertial, "mass", {{"value", formatExact(mass)}});
      addElement(inertial, "inertia",
                 {{"ixx", formatExact(I(0, 0))},
                  {"iyy", formatExact(I(1, 1))},
                  {"izz", formatExact(I(2, 2))},
                  {"ixy", formatExact(I(0, 1))},
                  {"ixz", formatExact(I(0, 2))},
                  {"iyz", formatExact(I(1, 2))}});
    }
    for (const Visual* visual : visuals_[i]) writeVisual(*visual, addElement(link, "visual"));
    for (const Shape* shape : shapes_[i])
      if (!shape->fitted) writeShape(*shape, addElement(link, "collision"));
  }

  void writeVisual(const Visual& visual, XMLElement& e) {
    addOrigin(e, visual.X_BV);
    XMLElement& geometry = addElement(e, "geometry");
    const Vector3d& size = visual.size;
    switch (visual.shape) {
      case Visual::Shape::Box:
        addElement(geometry, "box", {{"size", formatExact(size)}});
        break;
      case Visual::Shape::Cylinder:
        addElement(geometry, "cylinder", {{"radius", formatExact(size[0])}, {"length", formatExact(size[1])}});
        break;
      case Visual::Shape::Sphere:
        addElement(geometry, "sphere", {{"radius", formatExact(size[0])}});
        break;
      case Visual::Shape::Mesh:
        addElement(geometry, "mesh", {{"filename", visual.mesh}, {"scale", formatExact(size)}});
        break;
    }
    addElement(e, "material", {{"name", getMaterial(visual.rgba)}});
  }

  // URDF has no capsules: a cylinder that is long enough is read as one (fitShape). What else is rounded is written as the box
  // around it.
  void writeShape(const Shape& shape, XMLElement& e) {
    addOrigin(e, shape.X_BS);
    XMLElement& geometry = addElement(e, "geometry");
    const Vector3d& half = shape.half;
    Visual cylinder;
    cylinder.shape = Visual::Shape::Cylinder;
    cylinder.size = {shape.radius, 2 * half.z(), 0};
    if (half.isZero())
      addElement(geometry, "sphere", {{"radius", formatExact(shape.radius)}});
    else if (half.head<2>().isZero() && shape.radius > 0 && fitShape(cylinder)->radius > 0)
      addElement(geometry, "cylinder", {{"radius", formatExact(shape.radius)}, {"length", formatExact(2 * half.z())}});
    else
      addElement(geometry, "box", {{"size", formatExact(2 * (half + Vector3d::Constant(shape.radius)))}});
  }

  void writeJoint(int i) {
    const Joint& joint = model_.joints()[i];
    const char* type = "continuous";  // universal and spherical joints get their kind by the YAML file
    if (joint.kind == JointKind::Prismatic) type = "prismatic";
    if (joint.kind == JointKind::Planar) type = "planar";
    if (joint.kind == JointKind::FreeFlyer) type = "floating";
    if (joint.kind == JointKind::Revolute) type = "revolute";
    const bool is_custom = for_drake_ && (joint.kind == JointKind::Spherical || joint.kind == JointKind::Universal);
    if (is_custom) type = joint.kind == JointKind::Spherical ? "ball" : "universal";
    XMLElement& e = addElement(*robot_, is_custom ? "drake:joint" : "joint", {{"name", joint.name}, {"type", type}});
    addOrigin(e, joint.X_PJ);
    addElement(e, "parent", {{"link", model_.bodies()[joint.parent].name}});
    addElement(e, "child", {{"link", model_.bodies()[i].name}});
    if (joint.nv == 1 || joint.kind == JointKind::Planar) addElement(e, "axis", {{"xyz", formatExact(joint.axis)}});
    writeLimits(joint, e);
    if (warnings_) writeMimicAndDynamics(i, e);
  }

  void writeLimits(const Joint& joint, XMLElement& e) {
    const auto lower = model_.lowerLimits().segment(joint.idx_v, joint.nv),
               upper = model_.upperLimits().segment(joint.idx_v, joint.nv),
               velocity = model_.velocityLimits().segment(joint.idx_v, joint.nv);
    if (for_drake_) return writeDrakeLimits(joint, lower, upper, velocity, e);
    const bool ranged = !(lower.array().isInf().all() && upper.array().isInf().all());
    const bool slow = velocity.allFinite();
    if (joint.nv != 1 && (ranged || slow))
      refuseToWrite(model_, "joint '" + joint.name + "'", "it has several coordinates with limits");
    const double effort = warnings_ ? getEffortLimit(joint) : HUGE_VAL;
    if (!ranged && !slow && std::isinf(effort) && (joint.kind == JointKind::Continuous || joint.nv != 1)) return;
    XMLElement& limit = addElement(e, "limit");
    if (joint.nv == 1 && joint.kind != JointKind::Continuous)
      setAttributes(limit, {{"lower", formatExact(std::max(lower[0], -kNone))},
                            {"upper", formatExact(std::min(upper[0], kNone))}});
    setAttributes(limit, {{"effort", formatExact(std::isfinite(effort) ? effort : kNone)},
                          {"velocity", formatExact(slow ? velocity[0] : kNone)}});
  }

  double getEffortLimit(const Joint& joint) const {
    const int motor = model_.findMotor(joint.name);
    return motor < 0 ? HUGE_VAL : model_.motors()[motor].effort_limit;
  }

  // Each alone, because a 0 would be a limit.
  void writeDrakeLimits(const Joint& joint, ConstVectorRef lower, ConstVectorRef upper, ConstVectorRef velocity,
                        XMLElement& e) {
    if (joint.nv != 1) {
      if (!(lower.array().isInf().all() && upper.array().isInf().all() && velocity.array().isInf().all()))
        warn("joint '" + joint.name + "'", "the limits of its coordinates are left out");
      return;
    }
    XMLElement& limit = addElement(e, "limit");
    for (const auto& [name, value] : {std::pair("lower", lower[0]),
                                      {"upper", upper[0]},
                                      {"effort", getEffortLimit(joint)},
                                      {"velocity", velocity[0]}})
      if (std::isfinite(value)) setAttributes(limit, {{name, formatExact(value)}});
    if (!limit.FirstAttribute()) e.DeleteChild(&limit);
  }

  void writeMimicAndDynamics(int i, XMLElement& e) {
    if (const auto it = mimics_.find(i); it != mimics_.end())
      addElement(e, "mimic",
                 {{"joint", model_.joints()[it->second.joint].name},
                  {"multiplier", formatExact(it->second.multiplier)},
                  {"offset", formatExact(it->second.offset)}});
    for (const WholeJointForce& whole : joinJointForces(model_)) {
      const JointForce& force = whole.force;
      if (force.joint != i) continue;
      const std::string element = "joint '" + model_.joints()[i].name + "'";
      if (force.damping != 0 || force.friction != 0)
        addElement(e, "dynamics", {{"damping", formatExact(force.damping)}, {"friction", formatExact(force.friction)}});
      if (force.friction != 0 && force.friction_speed != JointForce().friction_speed)
        warn(element, "its friction_speed is left out");
      if (whole.sticks()) warn(element, kStictionLost);
      if (force.friction != 0 && for_drake_) warn(element, "its friction is written, but Drake ignores it");
      if (force.stiffness != 0 || force.preload != 0) warn(element, "its spring is left out");
    }
  }

  void warn(const std::string& element, const std::string& problem) { warnings_->add(element, problem); }

  void writeFrame(const std::string& name, int body, const SE3& X_BF) {
    addElement(*robot_, "link", {{"name", name}});
    XMLElement& joint = addElement(*robot_, "joint", {{"name", name + "_frame"}, {"type", "fixed"}});
    addOrigin(joint, X_BF);
    addElement(joint, "parent", {{"link", model_.bodies()[body].name}});
    addElement(joint, "child", {{"link", name}});
  }

  // Frames of closures and contacts that have no name.
  void writeMadeFrames(int body) {
    const auto write = [&](int owner, const SE3& X, const std::string& made) {
      if (owner == body && findFrameName(model_, owner, X, made) == made && model_.findFrame(made) < 0)
        writeFrame(made, body, X);
    };
    for (const Closure& c : model_.closures()) {
      if (c.kind == ClosureKind::Coupler || for_drake_) continue;
      write(c.body1, c.X_B1, c.name + "_frame1");
      write(c.body2, c.X_B2, c.name + "_frame2");
    }
    for (const ContactFrame& c : model_.contacts()) write(c.body, c.X_BF, c.name + "_sole");
  }

  const Model& model_;
  const std::vector<std::vector<const Visual*>> visuals_ = sortByBody(model_, model_.visuals());
  const std::vector<std::vector<const Shape*>> shapes_ = sortByBody(model_, model_.shapes());
  const std::vector<std::vector<const Frame*>> frames_ = sortByBody(model_, model_.frames());
  const bool free_root_;
  XMLDocument& document_;
  XMLElement* robot_ = nullptr;
  std::set<std::string> bodies_;
  std::map<std::string, std::string> colors_;

  // Of a URDF without a YAML file.
  struct Mimic {
    int joint = 0;
    double multiplier = 1, offset = 0;
  };
  bool for_drake_ = false;
  std::map<int, Mimic> mimics_;
  FormatWarnings* warnings_ = nullptr;
};

}  // namespace

XMLElement& addUrdfTree(const Model& model, bool for_drake, XMLDocument& document, FormatWarnings& warnings) {
  UrdfWriter(model, document).writeAlone(for_drake, warnings);
  return *document.RootElement();
}

std::string formatUrdfBesideYaml(const Model& model, const std::string& remark) {
  XMLDocument document;
  UrdfWriter(model, document).write(remark);
  return formatXml(document);
}

UrdfText formatUrdf(const Model& model) {
  FormatWarnings warnings(model);
  XMLDocument document;
  addUrdfTree(model, false, document, warnings);
  warnings.addBeyondTree();
  warnings.addYamlOnly();
  return {formatXml(document), warnings.get()};
}

}  // namespace bielle
