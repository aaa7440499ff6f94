#include "io/sdf.h"

#include <cmath>
#include <set>
#include <sstream>

#include "bielle/model/error.h"
#include "io/format_warnings.h"
#include "io/robot_text.h"
#include "io/xml_text.h"
#include "math/so3.h"
#include "model/joint.h"
#include "model/number_text.h"

namespace bielle {
namespace {

// x y z roll pitch yaw, R = Rz(yaw) Ry(pitch) Rx(roll)
std::string formatPose(const SE3& X) {
  const double level = std::hypot(X.R(0, 0), X.R(1, 0)), pitch = std::atan2(-X.R(2, 0), level);
  Vector3d angles(std::atan2(X.R(2, 1), X.R(2, 2)), pitch, std::atan2(X.R(1, 0), X.R(0, 0)));
  if (level < 1e-9) angles = {std::atan2(-X.R(1, 2), X.R(1, 1)), pitch, 0};  // roll and yaw turn about one axis
  return formatExact(X.p) + " " + formatExact(angles);
}

class SdfWriter {
 public:
  SdfWriter(const Model& model, ConstVectorRef q_ref) : model_(model), q_ref_(q_ref) {}

  SdfText write() {
    out_ << "<?xml version=\"1.0\"?>\n<sdf version=\"1.7\">\n  <model name=\"" << escapeXml(model_.name()) << "\">\n";
    for (int i = 1; i < model_.numBodies(); ++i) {
      writeJoint(i);
      writeLink(i);
    }
    for (const Frame& frame : model_.frames())
      if (frame.name != model_.bodies()[frame.body].name) writeFrame(frame);
    for (const Closure& closure : model_.closures()) writeClosure(closure);
    out_ << "  </model>\n</sdf>\n";
    listOmissions();
    return {out_.str(), warnings_.get()};
  }

 private:
  std::string getLink(int body) const { return body == 0 ? "world" : escapeXml(model_.bodies()[body].name); }

  [[noreturn]] void refuse(const Joint& joint, const std::string& problem) const {
    throw ModelError(model_.name(), "joint '" + joint.name + "'", problem + ", which SDF cannot express",
                     "write another format, or change the model");
  }

  // Body i at q_ref in its parent; for the world, in the model, which stands at the origin of the world.
  SE3 calcPlacement(int i) const {
    const Joint& joint = model_.joints()[i];
    return joint.X_PJ * calcJointPlacement(joint, q_ref_.segment(joint.idx_q, joint.nq));
  }

  void writePose(const SE3& X, int relative_to, const char* indent) {
    out_ << indent << "<pose";
    if (relative_to > 0) out_ << " relative_to=\"" << getLink(relative_to) << "\"";
    out_ << ">" << formatPose(X) << "</pose>\n";
  }

  void writeLink(int i) {
    const Inertia& inertia = model_.bodies()[i].inertia;
    out_ << "    <link name=\"" << getLink(i) << "\">\n";
    writePose(calcPlacement(i), model_.joints()[i].parent, "      ");
    const Matrix3d& I = inertia.I_com;
    out_ << "      <inertial>\n        <pose>" << formatExact(inertia.com) << " 0 0 0</pose>\n        <mass>"
         << formatExact(inertia.mass) << "</mass>\n        <inertia>";
    const auto write = [&](const char* name, double value) {
      out_ << "<" << name << ">" << formatExact(value) << "</" << name << ">";
    };
    write("ixx", I(0, 0)), write("ixy", I(0, 1)), write("ixz", I(0, 2));
    write("iyy", I(1, 1)), write("iyz", I(1, 2)), write("izz", I(2, 2));
    out_ << "</inertia>\n      </inertial>\n";
    if (!(inertia.mass > 0))
      warn("link '" + model_.bodies()[i].name + "'", "it has no mass, which SDF requires to be positive");
    int count = 0;
    for (const Visual& visual : model_.visuals())
      if (visual.body == i) writeVisual(visual, ++count);
    count = 0;
    for (const Shape& shape : model_.shapes())
      if (shape.body == i && !shape.fitted) writeShape(shape, ++count);
    out_ << "    </link>\n";
  }

  // A box with rounded edges is written as the box around it.
  void writeShape(const Shape& shape, int count) {
    out_ << "      <collision name=\"collision_" << count << "\">\n";
    writePose(shape.X_BS, 0, "        ");
    out_ << "        <geometry>";
    const std::string radius = "<radius>" + formatExact(shape.radius) + "</radius>";
    if (shape.half.isZero())
      out_ << "<sphere>" << radius << "</sphere>";
    else if (shape.half.head<2>().isZero() && shape.radius > 0)
      out_ << "<capsule>" << radius << "<length>" << formatExact(2 * shape.half.z()) << "</length></capsule>";
    else
      out_ << "<box><size>" << formatExact(2 * (shape.half + Vector3d::Constant(shape.radius))) << "</size></box>";
    out_ << "</geometry>\n      </collision>\n";
  }

  void writeVisual(const Visual& visual, int count) {
    out_ << "      <visual name=\"visual_" << count << "\">\n";
    writePose(visual.X_BV, 0, "        ");
    out_ << "        <geometry>";
    const Vector3d& size = visual.size;
    switch (visual.shape) {
      case Visual::Shape::Box:
        out_ << "<box><size>" << formatExact(size) << "</size></box>";
        break;
      case Visual::Shape::Cylinder:
        out_ << "<cylinder><radius>" << formatExact(size[0]) << "</radius><length>" << formatExact(size[1])
             << "</length></cylinder>";
        break;
      case Visual::Shape::Sphere:
        out_ << "<sphere><radius>" << formatExact(size[0]) << "</radius></sphere>";
        break;
      case Visual::Shape::Mesh:
        out_ << "<mesh><uri>" << escapeXml(visual.mesh) << "</uri><scale>" << formatExact(size) << "</scale></mesh>";
        break;
    }
    const std::string color = formatExact(visual.rgba.head<3>()) + " " + formatExact(visual.rgba[3]);
    out_ << "</geometry>\n        <material><ambient>" << color << "</ambient><diffuse>" << color
         << "</diffuse></material>\n      </visual>\n";
  }

  void writeJoint(int i) {
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
    out_ << "    <joint name=\"" << escapeXml(name) << "\" type=\"" << type << "\">\n      <parent>"
         << getLink(joint.parent) << "</parent>\n      <child>" << getLink(i) << "</child>\n";
    // The frame of the joint is that of its child, where the axes of ours are given at neutral.
    if (joint.kind == JointKind::Universal) {
      const Matrix3d back = makeAxisRotation(joint.axis2, -q_ref_[joint.idx_q + 1]);
      writeAxis(joint, 0, "axis", back * joint.axis);
      writeAxis(joint, 1, "axis2", joint.axis2);
    } else if (joint.nv == 1) {
      writeAxis(joint, 0, "axis", joint.axis);
    } else {
      reportLimits(joint);
    }
    out_ << "    </joint>\n";
  }

  // Its coordinate counts from q_ref.
  void writeAxis(const Joint& joint, int k, const char* tag, const Vector3d& axis) {
    const int dof = joint.idx_v + k, motor = model_.findMotor(joint.name);
    const double q = q_ref_[joint.idx_q + k], lower = model_.lowerLimits()[dof] - q,
                 upper = model_.upperLimits()[dof] - q;
    const double effort = motor < 0 ? HUGE_VAL : model_.motors()[motor].effort_limit;
    out_ << "      <" << tag << ">\n        <xyz>" << formatExact(axis) << "</xyz>\n";
    if (q != 0) shifted_ += (shifted_.empty() ? "'" : ", '") + joint.name + "' " + formatNumber(q);
    constexpr double kFar = 1e16;  // none, in SDF
    std::ostringstream limit;
    const auto write = [](std::ostream& out, const char* name, double value) {
      out << "<" << name << ">" << formatExact(value) << "</" << name << ">";
    };
    if (std::isfinite(lower) || std::isfinite(upper)) {
      write(limit, "lower", std::max(lower, -kFar));
      write(limit, "upper", std::min(upper, kFar));
    }
    if (std::isfinite(effort)) write(limit, "effort", effort);
    if (std::isfinite(model_.velocityLimits()[dof])) write(limit, "velocity", model_.velocityLimits()[dof]);
    if (!limit.str().empty()) out_ << "        <limit>" << limit.str() << "</limit>\n";
    for (const JointForce& force : model_.jointForces())
      if (force.dof == dof) writeJointForce(joint, force, q);
    out_ << "      </" << tag << ">\n";
  }

  void writeJointForce(const Joint& joint, const JointForce& force, double q) {
    out_ << "        <dynamics><damping>" << formatExact(force.damping) << "</damping><friction>"
         << formatExact(force.friction) << "</friction><spring_reference>"
         << formatExact(force.stiffness == 0 ? 0 : force.rest + force.preload / force.stiffness - q)
         << "</spring_reference><spring_stiffness>" << formatExact(force.stiffness)
         << "</spring_stiffness></dynamics>\n";
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

  void writeFrame(const Frame& frame) {
    if (frame.body == 0) return warn("frame '" + frame.name + "'", "it is left out: it is fixed to the world");
    out_ << "    <frame name=\"" << escapeXml(frame.name) << "\" attached_to=\"" << getLink(frame.body)
         << "\">\n      <pose>" << formatPose(frame.X_BF) << "</pose>\n    </frame>\n";
  }

  // In SDF links, joints and frames of a model share their names.
  std::string makeName(std::string name, const char* suffix) {
    while (model_.findFrame(name) >= 0 || !taken_.insert(name).second) name += suffix;
    return name;
  }

  void writeClosure(const Closure& closure) {
    const std::string element = "closure '" + closure.name + "'";
    if (closure.kind == ClosureKind::Coupler) return warn(element, "it is left out: SDF cannot couple joints");
    const std::string name = makeName(closure.name, "_closure");
    if (name != closure.name) warn(element, "it is renamed to '" + name + "' because its name is taken");
    // The child may not be the world.
    const bool swap = closure.body2 == 0;
    const int parent = swap ? closure.body2 : closure.body1, child = swap ? closure.body1 : closure.body2;
    const SE3& X = swap ? closure.X_B1 : closure.X_B2;
    out_ << "    <joint name=\"" << escapeXml(name) << "\" type=\""
         << (closure.kind == ClosureKind::Weld6D   ? "fixed"
             : closure.kind == ClosureKind::Ball3D ? "ball"
                                                   : "continuous")
         << "\">\n";
    writePose(X, 0, "      ");
    out_ << "      <parent>" << getLink(parent) << "</parent>\n      <child>" << getLink(child) << "</child>\n";
    if (closure.kind == ClosureKind::Hinge5D)
      out_ << "      <axis><xyz>" << formatExact(closure.axis) << "</xyz></axis>\n";
    out_ << "    </joint>\n";
    if (closure.kp != 0 || closure.kd != 0) warn(element, "its gains kp and kd are left out");
  }

  void warn(const std::string& element, const std::string& problem) { warnings_.add(element, problem); }

  void listOmissions() {
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
  const VectorXd q_ref_;
  std::ostringstream out_;
  std::set<std::string> taken_;  // names of joints
  std::string shifted_;          // joints with their coordinates at q_ref
  FormatWarnings warnings_{model_};
};

}  // namespace

SdfText formatSdf(const Model& model, ConstVectorRef q_ref) { return SdfWriter(model, q_ref).write(); }

}  // namespace bielle
