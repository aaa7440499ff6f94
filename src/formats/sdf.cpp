#include "formats/sdf.h"

#include <cmath>
#include <set>

#include "bielle/model/error.h"
#include "formats/format_warnings.h"
#include "formats/robot_text.h"
#include "formats/xml_document.h"
#include "math/direction.h"
#include "math/settled.h"
#include "math/so3.h"
#include "model/joint.h"
#include "model/number_text.h"

namespace bielle {
namespace {

// x y z roll pitch yaw, R = Rz(yaw) Ry(pitch) Rx(roll)
std::string formatPose(const SE3& X) {
  return formatExact(X.p) + " " + formatExact(calcRollPitchYaw(settleRotation(X.R)));
}

class SdfWriter {
 public:
  SdfWriter(const Model& model, ConstVectorRef q_ref) : model_(model), q_ref_(q_ref) {}

  SdfText write() {
    XMLDocument document;
    document.InsertEndChild(document.NewDeclaration("xml version=\"1.0\""));
    XMLElement& sdf = addElement(document, "sdf", {{"version", "1.7"}});
    XMLElement& robot = addElement(sdf, "model", {{"name", model_.name()}});
    for (int i = 1; i < model_.numBodies(); ++i) {
      writeJoint(i, robot);
      writeLink(i, robot);
    }
    for (const Frame& frame : model_.frames())
      if (frame.name != model_.bodies()[frame.body].name) writeFrame(frame, robot);
    for (const Closure& closure : model_.closures()) writeClosure(closure, robot);
    listOmissions();
    return {formatXml(document), warnings_.get()};
  }

 private:
  std::string getLink(int body) const { return body == 0 ? "world" : model_.bodies()[body].name; }

  [[noreturn]] void refuse(const Joint& joint, const std::string& problem) const {
    throw InputError(model_.name(), "joint '" + joint.name + "'", problem + ", which SDF cannot express",
                     "write another format, or change the model");
  }

  // Body i at q_ref in its parent; for the world, in the model, which stands at the origin of the world.
  SE3 calcPlacement(int i) const {
    const Joint& joint = model_.joints()[i];
    return joint.X_PJ * calcJointPlacement(joint, q_ref_.segment(joint.idx_q, joint.nq));
  }

  void writePose(const SE3& X, int relative_to, XMLElement& e) {
    XMLElement& pose = addElement(e, "pose");
    if (relative_to > 0) setAttributes(pose, {{"relative_to", getLink(relative_to)}});
    pose.SetText(formatPose(X).c_str());
  }

  // libsdformat refuses a link without mass, as crosses of two joints are.
  Inertia makeInertia(int i) {
    constexpr double kLeastMass = 2e-6, kLeastMoment = 1e-12;  // kg, kg m^2, as in URDFs
    Inertia inertia = model_.bodies()[i].inertia;
    if (inertia.mass > 0) return inertia;
    inertia.mass = kLeastMass;
    if (inertia.I_com.isZero(0)) inertia.I_com = kLeastMoment * Matrix3d::Identity();
    warn("link '" + getLink(i) + "'", "it has no mass, which SDF requires to be positive; 2e-06 kg is written");
    return inertia;
  }

  void writeLink(int i, XMLElement& robot) {
    const Inertia inertia = makeInertia(i);
    XMLElement& link = addElement(robot, "link", {{"name", getLink(i)}});
    writePose(calcPlacement(i), model_.joints()[i].parent, link);
    const Matrix3d& I = inertia.I_com;
    XMLElement& inertial = addElement(link, "inertial");
    addText(inertial, "pose", formatExact(inertia.com) + " 0 0 0");
    addText(inertial, "mass", formatExact(inertia.mass));
    XMLElement& moments = addElement(inertial, "inertia");
    for (const auto& [name, value] : {std::pair("ixx", I(0, 0)),
                                      {"ixy", I(0, 1)},
                                      {"ixz", I(0, 2)},
                                      {"iyy", I(1, 1)},
                                      {"iyz", I(1, 2)},
                                      {"izz", I(2, 2)}})
      addText(moments, name, formatExact(value));
    int count = 0;
    for (const Visual* visual : visuals_[i]) writeVisual(*visual, ++count, link);
    count = 0;
    for (const Shape* shape : shapes_[i])
      if (!shape->fitted) writeShape(*shape, ++count, link);
  }

  // A box with rounded edges is written as the box around it.
  void writeShape(const Shape& shape, int count, XMLElement& link) {
    XMLElement& collision = addElement(link, "collision", {{"name", "collision_" + std::to_string(count)}});
    writePose(shape.X_BS, 0, collision);
    XMLElement& geometry = addElement(collision, "geometry");
    if (shape.half.isZero()) {
      addText(addElement(geometry, "sphere"), "radius", formatExact(shape.radius));
    } else if (shape.half.head<2>().isZero() && shape.radius > 0) {
      XMLElement& capsule = addElement(geometry, "capsule");
      addText(capsule, "radius", formatExact(shape.radius));
      addText(capsule, "length", formatExact(2 * shape.half.z()));
    } else {
      addText(addElement(geometry, "box"), "size", formatExact(2 * (shape.half + Vector3d::Constant(shape.radius))));
    }
  }

  void writeVisual(const Visual& visual, int count, XMLElement& link) {
    XMLElement& e = addElement(link, "visual", {{"name", "visual_" + std::to_string(count)}});
    writePose(visual.X_BV, 0, e);
    XMLElement& geometry = addElement(e, "geometry");
    const Vector3d& size = visual.size;
    switch (visual.shape) {
      case Visual::Shape::Box:
        addText(addElement(geometry, "box"), "size", formatExact(size));
        break;
      case Visual::Shape::Cylinder: {
        XMLElement& cylinder = addElement(geometry, "cylinder");
        addText(cylinder, "radius", formatExact(size[0]));
        addText(cylinder, "length", formatExact(size[1]));
        break;
      }
      case Visual::Shape::Sphere:
        addText(addElement(geometry, "sphere"), "radius", formatExact(size[0]));
        break;
      case Visual::Shape::Mesh: {
        XMLElement& mesh = addElement(geometry, "mesh");
        addText(mesh, "uri", visual.mesh);
        addText(mesh, "scale", formatExact(size));
        break;
      }
    }
    XMLElement& material = addElement(e, "material");
    for (const char* light : {"ambient", "diffuse"})
      addText(material, light, formatExact(visual.rgba.head<3>()) + " " + formatExact(visual.rgba[3]));
  }

  void writeJoint(int i, XMLElement& robot) {
    const Joint& joint = model_.joints()[i];
    if (joint.kind == JointKind::Planar) refuse(joint, "it is planar");
    if (joint.kind == JointKind::FreeFlyer) {
      if (joint.parent != 0) refuse(joint, "it is a free-flyer over a body");
      return;
    }
    const char* type = joint.kind == JointKind::Prismatic   ? "prismatic"
                       : joint.kind == JointKind::Spherical ? "ball"
                       : joint.kind == JointKind::Universal ? "universal"
                       : joint.kind == JointKind::Revolute  ? "revolute"
                                                            : "continuous";
    const std::string name = makeName(joint.name, "_joint");
    if (name != joint.name)
      warn("joint '" + joint.name + "'", "it is renamed to '" + name + "' because a link has its name");
    XMLElement& e = addElement(robot, "joint", {{"name", name}, {"type", type}});
    addText(e, "parent", getLink(joint.parent));
    addText(e, "child", getLink(i));
    // The frame of the joint is that of its child, where the axes of ours are given at neutral.
    if (joint.kind == JointKind::Universal) {
      const Matrix3d back = makeAxisRotation(joint.axis2, -q_ref_[joint.idx_q + 1]);
      writeAxis(joint, 0, back * joint.axis, addElement(e, "axis"));
      writeAxis(joint, 1, joint.axis2, addElement(e, "axis2"));
    } else if (joint.nv == 1) {
      writeAxis(joint, 0, joint.axis, addElement(e, "axis"));
    } else {
      reportLimits(joint);
    }
  }

  // Its coordinate counts from q_ref.
  void writeAxis(const Joint& joint, int k, const Vector3d& axis, XMLElement& e) {
    const int dof = joint.idx_v + k, motor = model_.findMotor(joint.name);
    const double q = q_ref_[joint.idx_q + k], lower = model_.lowerLimits()[dof] - q,
                 upper = model_.upperLimits()[dof] - q;
    const double effort = motor < 0 ? HUGE_VAL : model_.motors()[motor].effort_limit;
    addText(e, "xyz", formatExact(settleDirection(axis)));  // which its reader makes of unit length
    if (q != 0) shifted_ += (shifted_.empty() ? "'" : ", '") + joint.name + "' " + formatNumber(q);
    constexpr double kFar = 1e16;  // none, in SDF
    XMLElement& limit = addElement(e, "limit");
    if (std::isfinite(lower) || std::isfinite(upper)) {
      addText(limit, "lower", formatExact(std::max(lower, -kFar)));
      addText(limit, "upper", formatExact(std::min(upper, kFar)));
    }
    if (std::isfinite(effort)) addText(limit, "effort", formatExact(effort));
    if (std::isfinite(model_.velocityLimits()[dof]))
      addText(limit, "velocity", formatExact(model_.velocityLimits()[dof]));
    if (limit.NoChildren()) e.DeleteChild(&limit);
    for (const WholeJointForce& whole : joinJointForces(model_))
      if (whole.force.dof == dof) writeJointForce(joint, whole, q, e);
  }

  void writeJointForce(const Joint& joint, const WholeJointForce& whole, double q, XMLElement& axis) {
    const JointForce& force = whole.force;
    if (whole.sticks()) warn("joint '" + joint.name + "'", kStictionLost);
    XMLElement& dynamics = addElement(axis, "dynamics");
    addText(dynamics, "damping", formatExact(force.damping));
    addText(dynamics, "friction", formatExact(force.friction));
    addText(dynamics, "spring_reference",
            formatExact(force.stiffness == 0 ? 0 : force.rest + force.preload / force.stiffness - q));
    addText(dynamics, "spring_stiffness", formatExact(force.stiffness));
    if (force.stiffness == 0 && force.preload != 0)
      warn("joint '" + joint.name + "'", "its preload without a spring is left out");
    if (force.friction != 0) warn("joint '" + joint.name + "'", "its friction becomes that of the simulator");
  }

  void reportLimits(const Joint& joint) {
    const auto lower = model_.lowerLimits().segment(joint.idx_v, joint.nv),
               upper = model_.upperLimits().segment(joint.idx_v, joint.nv);
    if (lower.array().isFinite().any() || upper.array().isFinite().any())
      warn("joint '" + joint.name + "'", "the limits of its coordinates are left out");
  }

  void writeFrame(const Frame& frame, XMLElement& robot) {
    if (frame.body == 0) return warn("frame '" + frame.name + "'", "it is left out: it is fixed to the world");
    writePose(frame.X_BF, 0, addElement(robot, "frame", {{"name", frame.name}, {"attached_to", getLink(frame.body)}}));
  }

  // In SDF links, joints and frames of a model share their names.
  std::string makeName(std::string name, const char* suffix) {
    while (model_.findFrame(name) >= 0 || !taken_.insert(name).second) name += suffix;
    return name;
  }

  void writeClosure(const Closure& closure, XMLElement& robot) {
    const std::string element = "closure '" + closure.name + "'";
    if (closure.kind == ClosureKind::Coupler) return warn(element, "it is left out: SDF cannot couple joints");
    if (closure.kind == ClosureKind::Distance)
      return warn(element, "it is left out: SDF has no rod; a thin link on a universal and a ball joint serves as one");
    const std::string name = makeName(closure.name, "_closure");
    if (name != closure.name) warn(element, "it is renamed to '" + name + "' because its name is taken");
    // The child may not be the world.
    const bool swap = closure.body2 == 0;
    const int parent = swap ? closure.body2 : closure.body1, child = swap ? closure.body1 : closure.body2;
    const SE3& X = swap ? closure.X_B1 : closure.X_B2;
    const char* type = closure.kind == ClosureKind::Weld6D   ? "fixed"
                       : closure.kind == ClosureKind::Ball3D ? "ball"
                       : closure.kind == ClosureKind::Slider ? "prismatic"
                                                             : "continuous";
    XMLElement& e = addElement(robot, "joint", {{"name", name}, {"type", type}});
    loops_ += (loops_.empty() ? "'" : ", '") + name + "'";
    writePose(X, 0, e);
    addText(e, "parent", getLink(parent));
    addText(e, "child", getLink(child));
    if (hasAxis(closure.kind)) addText(addElement(e, "axis"), "xyz", formatExact(settleDirection(closure.axis)));
    if (closure.kp != 0 || closure.kd != 0) warn(element, "its gains kp and kd are left out");
  }

  void warn(const std::string& element, const std::string& problem) { warnings_.add(element, problem); }

  void listOmissions() {
    if (!loops_.empty())
      warn("joints " + loops_,
           "they close loops; Gazebo with DART, its default engine since Ignition, leaves them out");
    if (!shifted_.empty()) warn("joints " + shifted_, "their coordinates are measured from these values, rad or m");
    for (const Visual& visual : model_.visuals())
      if (visual.body == 0) {
        warn("shapes of the ground", "they are left out");
        break;
      }
    warnings_.addBeyondTree();
    warnings_.addYamlOnly();
  }

  const Model& model_;
  const std::vector<std::vector<const Visual*>> visuals_ = sortByBody(model_, model_.visuals());
  const std::vector<std::vector<const Shape*>> shapes_ = sortByBody(model_, model_.shapes());
  const VectorXd q_ref_;
  std::set<std::string> taken_;  // names of joints
  std::string shifted_;          // joints with their coordinates at q_ref
  std::string loops_;            // joints that are closures
  FormatWarnings warnings_{model_};
};

}  // namespace

SdfText formatSdf(const Model& model, ConstVectorRef q_ref) { return SdfWriter(model, q_ref).write(); }

}  // namespace bielle
