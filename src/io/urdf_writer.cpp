#include "io/urdf_writer.h"

#include <cmath>
#include <map>
#include <set>
#include <sstream>

#include "bielle/io/robot_writer.h"
#include "io/robot_text.h"
#include "io/xml_text.h"

namespace bielle {
namespace {

// R = Rz(yaw) Ry(pitch) Rx(roll)
Vector3d calcRollPitchYaw(const Matrix3d& R) {
  const double pitch = std::atan2(-R(2, 0), std::hypot(R(0, 0), R(1, 0)));
  if (std::hypot(R(0, 0), R(1, 0)) < 1e-9)  // roll and yaw turn about one axis: no yaw
    return {std::atan2(-R(1, 2), R(1, 1)), pitch, 0};
  return {std::atan2(R(2, 1), R(2, 2)), pitch, std::atan2(R(1, 0), R(0, 0))};
}

std::string formatOrigin(const SE3& X) {
  std::string text = "<origin xyz=\"" + formatRounded(X.p) + "\"";
  if (!X.R.isIdentity(1e-15)) text += " rpy=\"" + formatRounded(calcRollPitchYaw(X.R)) + "\"";
  return text + "/>";
}

class UrdfWriter {
 public:
  explicit UrdfWriter(const Model& model) : model_(model), free_root_(hasImpliedFreeFlyer(model)) {
    for (const Body& body : model.bodies()) bodies_.insert(body.name);
  }

  /// A URDF that must do without a YAML file; what it cannot say of its tree goes to `warnings`.
  std::string formatUrdfAlone(const UrdfDialect& dialect, FormatWarnings& warnings) {
    dialect_ = &dialect;
    warnings_ = &warnings;
    for (int i = 1; i < model_.numBodies(); ++i) {
      const JointKind kind = model_.joints()[i].kind;
      if (!dialect.for_drake && (kind == JointKind::Spherical || kind == JointKind::Universal))
        refuseToWrite(model_, std::string(getName(kind)) + " joint '" + model_.joints()[i].name + "'",
                      "URDF does not support such joints");
    }
    for (const Closure& c : model_.closures()) {
      if (dialect.for_drake && c.kind != ClosureKind::Coupler) continue;
      // The joint that mimics: the later one, or the other one if that mimics already.
      int y = 1;
      if (c.terms.size() == 2 && mimics_.count(c.terms[1].joint)) y = 0;
      if (c.terms.size() != 2 || mimics_.count(c.terms[y].joint))
        warn("closure '" + c.name + "'", dialect.for_drake ? "it is left out: <mimic> couples a joint to one other"
                                                           : "it is left out because a URDF is a tree");
      else
        mimics_[c.terms[y].joint] = {c.terms[1 - y].joint, -c.terms[1 - y].coefficient / c.terms[y].coefficient,
                                     c.offset / c.terms[y].coefficient};
    }
    return formatUrdf("");
  }

  std::string formatUrdf(const std::string& remark) {
    std::ostringstream links;
    for (int i = free_root_ ? 1 : 0; i < model_.numBodies(); ++i) {
      writeLink(i, links);
      if (i > (free_root_ ? 1 : 0)) writeJoint(i, links);
      for (const Frame& frame : model_.frames())
        if (frame.body == i && !bodies_.count(frame.name)) writeFrame(frame.name, i, frame.X_BF, links);
      writeMadeFrames(i, links);
    }
    std::ostringstream out;
    out << "<?xml version=\"1.0\"?>\n";
    if (!remark.empty()) out << "<!-- " << remark << " -->\n";
    out << "<robot name=\"" << escapeXml(model_.name()) << "\"" << (dialect_ ? dialect_->attributes : "") << ">\n";
    for (const auto& [color, name] : colors_)
      out << "  <material name=\"" << name << "\"><color rgba=\"" << color << "\"/></material>\n";
    out << links.str() << (dialect_ ? dialect_->elements : "") << "</robot>\n";
    return out.str();
  }

 private:
  std::string getMaterial(const Eigen::Vector4d& rgba) {
    std::string color;
    for (int i = 0; i < 4; ++i) color += (i ? " " : "") + formatRounded(rgba[i]);
    const auto it = colors_.emplace(color, "color_" + std::to_string(colors_.size() + 1)).first;
    return it->second;
  }

  void writeLink(int i, std::ostream& out) {
    const Body& body = model_.bodies()[i];
    out << "\n  <link name=\"" << escapeXml(body.name) << "\">\n";
    if (body.inertia.mass > 0) {
      const Matrix3d& I = body.inertia.I_com;
      out << "    <inertial>\n      <origin xyz=\"" << formatRounded(body.inertia.com) << "\"/>\n      <mass value=\""
          << formatRobotNumber(body.inertia.mass) << "\"/>\n      <inertia";
      const double least = 1e-12 * I.diagonal().maxCoeff();  // products below it are rounding
      const auto write = [&](const char* name, double value) {
        out << " " << name << "=\"" << formatRobotNumber(std::abs(value) < least ? 0 : value) << "\"";
      };
      write("ixx", I(0, 0)), write("iyy", I(1, 1)), write("izz", I(2, 2));
      write("ixy", I(0, 1)), write("ixz", I(0, 2)), write("iyz", I(1, 2));
      out << "/>\n    </inertial>\n";
    }
    for (const Visual& visual : model_.visuals())
      if (visual.body == i) writeVisual(visual, out);
    for (const Shape& shape : model_.shapes())
      if (shape.body == i && !shape.fitted) writeShape(shape, out);
    out << "  </link>\n";
  }

  void writeVisual(const Visual& visual, std::ostream& out) {
    out << "    <visual>\n      " << formatOrigin(visual.X_BV) << "\n      <geometry>";
    const Vector3d& size = visual.size;
    switch (visual.shape) {
      case Visual::Shape::Box:
        out << "<box size=\"" << formatRounded(size) << "\"/>";
        break;
      case Visual::Shape::Cylinder:
        out << "<cylinder radius=\"" << formatRounded(size[0]) << "\" length=\"" << formatRounded(size[1]) << "\"/>";
        break;
      case Visual::Shape::Sphere:
        out << "<sphere radius=\"" << formatRounded(size[0]) << "\"/>";
        break;
      case Visual::Shape::Mesh:
        out << "<mesh filename=\"" << escapeXml(visual.mesh) << "\" scale=\"" << formatRounded(size) << "\"/>";
        break;
    }
    out << "</geometry>\n      <material name=\"" << getMaterial(visual.rgba) << "\"/>\n    </visual>\n";
  }

  // URDF has no capsules: a cylinder that is long enough is read as one (fitShape). What else is rounded is written as the box
  // around it.
  void writeShape(const Shape& shape, std::ostream& out) {
    out << "    <collision>\n      " << formatOrigin(shape.X_BS) << "\n      <geometry>";
    const Vector3d& half = shape.half;
    Visual cylinder;
    cylinder.shape = Visual::Shape::Cylinder;
    cylinder.size = {shape.radius, 2 * half.z(), 0};
    if (half.isZero())
      out << "<sphere radius=\"" << formatRounded(shape.radius) << "\"/>";
    else if (half.head<2>().isZero() && shape.radius > 0 && fitShape(cylinder)->radius > 0)
      out << "<cylinder radius=\"" << formatRounded(shape.radius) << "\" length=\"" << formatRounded(2 * half.z())
          << "\"/>";
    else
      out << "<box size=\"" << formatRounded(2 * (half + Vector3d::Constant(shape.radius))) << "\"/>";
    out << "</geometry>\n    </collision>\n";
  }

  void writeJoint(int i, std::ostream& out) {
    const Joint& joint = model_.joints()[i];
    const char* type = "continuous";  // universal and spherical joints get their kind by the YAML file
    if (joint.kind == JointKind::Prismatic) type = "prismatic";
    if (joint.kind == JointKind::Planar) type = "planar";
    if (joint.kind == JointKind::FreeFlyer) type = "floating";
    if (joint.kind == JointKind::Revolute) type = "revolute";
    const bool is_custom = isForDrake() && (joint.kind == JointKind::Spherical || joint.kind == JointKind::Universal);
    if (is_custom) type = joint.kind == JointKind::Spherical ? "ball" : "universal";
    const std::string tag = is_custom ? "drake:joint" : "joint";
    out << "  <" << tag << " name=\"" << escapeXml(joint.name) << "\" type=\"" << type << "\">\n    "
        << formatOrigin(joint.X_PJ) << "\n    <parent link=\"" << escapeXml(model_.bodies()[joint.parent].name)
        << "\"/>\n    <child link=\"" << escapeXml(model_.bodies()[i].name) << "\"/>\n";
    if (joint.nv == 1 || joint.kind == JointKind::Planar)
      out << "    <axis xyz=\"" << formatRounded(joint.axis) << "\"/>\n";
    writeLimits(joint, out);
    if (dialect_) writeMimicAndDynamics(i, out);
    out << "  </" << tag << ">\n";
  }

  bool isForDrake() const { return dialect_ && dialect_->for_drake; }

  void writeLimits(const Joint& joint, std::ostream& out) {
    const auto lower = model_.lowerLimits().segment(joint.idx_v, joint.nv),
               upper = model_.upperLimits().segment(joint.idx_v, joint.nv),
               velocity = model_.velocityLimits().segment(joint.idx_v, joint.nv);
    if (isForDrake()) return writeDrakeLimits(joint, lower, upper, velocity, out);
    const bool ranged = lower.allFinite() && upper.allFinite();
    const bool open = lower.array().isInf().all() && upper.array().isInf().all();
    const bool slow = velocity.allFinite();
    if ((!ranged && !open) || (joint.nv != 1 && (ranged || slow)))
      refuseToWrite(model_, "joint '" + joint.name + "'",
                    "it has a limit on one side only, or several coordinates with limits");
    const double effort = dialect_ ? getEffortLimit(joint) : HUGE_VAL;
    if (!ranged && !slow && std::isinf(effort) && (joint.kind == JointKind::Continuous || joint.nv != 1)) return;
    out << "    <limit";
    if (ranged) out << " lower=\"" << formatRounded(lower[0]) << "\" upper=\"" << formatRounded(upper[0]) << "\"";
    out << " effort=\"" << formatRobotNumber(std::isfinite(effort) ? effort : 0) << "\" velocity=\""
        << formatRobotNumber(slow ? velocity[0] : 0) << "\"/>\n";
  }

  double getEffortLimit(const Joint& joint) const {
    const int motor = model_.findMotor(joint.name);
    return motor < 0 ? HUGE_VAL : model_.motors()[motor].effort_limit;
  }

  // Each alone, because a 0 would be a limit.
  void writeDrakeLimits(const Joint& joint, ConstVectorRef lower, ConstVectorRef upper, ConstVectorRef velocity,
                        std::ostream& out) {
    if (joint.nv != 1) {
      if (!(lower.array().isInf().all() && upper.array().isInf().all() && velocity.array().isInf().all()))
        warn("joint '" + joint.name + "'", "the limits of its coordinates are left out");
      return;
    }
    std::string text;
    for (const auto& [name, value] : {std::pair("lower", lower[0]),
                                      {"upper", upper[0]},
                                      {"effort", getEffortLimit(joint)},
                                      {"velocity", velocity[0]}})
      if (std::isfinite(value)) text += std::string(" ") + name + "=\"" + formatRobotNumber(value, "%.17g") + "\"";
    if (!text.empty()) out << "    <limit" << text << "/>\n";
  }

  void writeMimicAndDynamics(int i, std::ostream& out) {
    if (const auto it = mimics_.find(i); it != mimics_.end())
      out << "    <mimic joint=\"" << escapeXml(model_.joints()[it->second.joint].name) << "\" multiplier=\""
          << formatRobotNumber(it->second.multiplier, "%.17g") << "\" offset=\""
          << formatRobotNumber(it->second.offset, "%.17g") << "\"/>\n";
    for (const JointForce& force : model_.jointForces()) {
      if (force.joint != i) continue;
      const std::string element = "joint '" + model_.joints()[i].name + "'";
      if (force.damping != 0 || force.friction != 0)
        out << "    <dynamics damping=\"" << formatRobotNumber(force.damping, "%.17g") << "\" friction=\""
            << formatRobotNumber(force.friction, "%.17g") << "\"/>\n";
      if (force.friction != 0 && force.friction_speed != JointForce().friction_speed)
        warn(element, "its friction_speed is left out");
      if (force.friction != 0 && isForDrake()) warn(element, "its friction is written, but Drake ignores it");
      if (force.stiffness != 0 || force.preload != 0) warn(element, "its spring is left out");
    }
  }

  void warn(const std::string& element, const std::string& problem) { warnings_->add(element, problem); }

  void writeFrame(const std::string& name, int body, const SE3& X_BF, std::ostream& out) {
    out << "  <link name=\"" << escapeXml(name) << "\"/>\n  <joint name=\"" << escapeXml(name)
        << "_frame\" type=\"fixed\">\n    " << formatOrigin(X_BF) << "\n    <parent link=\""
        << escapeXml(model_.bodies()[body].name) << "\"/>\n    <child link=\"" << escapeXml(name)
        << "\"/>\n  </joint>\n";
  }

  // Frames of closures and contacts that have no name.
  void writeMadeFrames(int body, std::ostream& out) {
    const auto write = [&](int owner, const SE3& X, const std::string& made) {
      if (owner == body && findFrameName(model_, owner, X, made) == made && model_.findFrame(made) < 0)
        writeFrame(made, body, X, out);
    };
    for (const Closure& c : model_.closures()) {
      if (c.kind == ClosureKind::Coupler || isForDrake()) continue;
      write(c.body1, c.X_B1, c.name + "_frame1");
      write(c.body2, c.X_B2, c.name + "_frame2");
    }
    for (const ContactFrame& c : model_.contacts()) write(c.body, c.X_BF, c.name + "_sole");
  }

  const Model& model_;
  const bool free_root_;
  std::set<std::string> bodies_;
  std::map<std::string, std::string> colors_;

  // Of a URDF without a YAML file.
  struct Mimic {
    int joint = 0;
    double multiplier = 1, offset = 0;
  };
  const UrdfDialect* dialect_ = nullptr;
  std::map<int, Mimic> mimics_;
  FormatWarnings* warnings_ = nullptr;
};

}  // namespace

std::string formatUrdfTree(const Model& model, const UrdfDialect& dialect, FormatWarnings& warnings) {
  return UrdfWriter(model).formatUrdfAlone(dialect, warnings);
}

std::string formatUrdfBesideYaml(const Model& model, const std::string& remark) {
  return UrdfWriter(model).formatUrdf(remark);
}

UrdfText formatUrdf(const Model& model) {
  FormatWarnings warnings(model);
  const std::string text = formatUrdfTree(model, {}, warnings);
  warnings.addBeyondTree();
  warnings.addYamlOnly();
  return {text, warnings.get()};
}

}  // namespace bielle
