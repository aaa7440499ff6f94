#include "bielle/io/robot_writer.h"

#include <cmath>
#include <filesystem>
#include <map>
#include <set>
#include <sstream>

#include "bielle/model/error.h"
#include "io/format_warnings.h"
#include "io/text_file.h"
#include "io/urdf_dialect.h"
#include "io/xml_text.h"

namespace bielle {
namespace {

std::string formatNumber(double value, const char* format = "%.12g") {
  char text[40];
  std::snprintf(text, sizeof text, format, value);
  return std::string(text) == "-0" ? "0" : text;
}

// Rounds a length, an angle or a direction to 1e-12.
std::string formatRounded(double value) {
  constexpr double kWhole = 1e4;  // whose last digit is over 1e-12
  return formatNumber(std::abs(value) < kWhole ? std::round(value * 1e12) / 1e12 : value, "%.15g");
}

std::string formatVector(const Vector3d& v, const char* separator = " ") {
  return formatRounded(v.x()) + separator + formatRounded(v.y()) + separator + formatRounded(v.z());
}

// A name in YAML syntax.
std::string quote(const std::string& name) {
  const bool plain =
      !name.empty() && std::isalpha(static_cast<unsigned char>(name[0])) &&
      name.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_") == std::string::npos;
  if (plain) return name;
  std::string out = "\"";
  for (char c : name) out += (c == '"' || c == '\\') ? std::string("\\") + c : std::string(1, c);
  return out + "\"";
}

std::string formatList(const std::vector<double>& values) {
  std::string text;
  for (double value : values) text += (text.empty() ? "" : ", ") + formatRounded(value);
  return "[" + text + "]";
}

// R = Rz(yaw) Ry(pitch) Rx(roll)
Vector3d calcRollPitchYaw(const Matrix3d& R) {
  const double pitch = std::atan2(-R(2, 0), std::hypot(R(0, 0), R(1, 0)));
  if (std::hypot(R(0, 0), R(1, 0)) < 1e-9)  // roll and yaw turn about one axis: no yaw
    return {std::atan2(-R(1, 2), R(1, 1)), pitch, 0};
  return {std::atan2(R(2, 1), R(2, 2)), pitch, std::atan2(R(1, 0), R(0, 0))};
}

std::string formatOrigin(const SE3& X) {
  std::string text = "<origin xyz=\"" + formatVector(X.p) + "\"";
  if (!X.R.isIdentity(1e-15)) text += " rpy=\"" + formatVector(calcRollPitchYaw(X.R)) + "\"";
  return text + "/>";
}

// The letter of a direction that is an axis of its frame, or 0.
char getAxisLetter(const Vector3d& axis) {
  for (int i = 0; i < 3; ++i)
    if (axis.isApprox(Vector3d::Unit(i), 1e-12)) return static_cast<char>('X' + i);
  return 0;
}

[[noreturn]] void refuse(const Model& model, const std::string& element, const std::string& problem) {
  throw ModelError(model.name(), element, problem + ": its files cannot say that", "change the model");
}

class Writer {
 public:
  explicit Writer(const Model& model) : model_(model) {
    for (const Body& body : model.bodies()) bodies_.insert(body.name);
    const Joint& first = model.joints()[1];
    bool ground = false;  // any other element on the ground requires a separate link
    for (const Frame& frame : model.frames()) ground |= frame.body == 0 && frame.name != "world";
    for (const Visual& visual : model.visuals()) ground |= visual.body == 0;
    for (const Shape& shape : model.shapes()) ground |= shape.body == 0 && !shape.fitted;
    for (int i = 2; i < model.numBodies(); ++i) ground |= model.joints()[i].parent == 0;
    free_root_ = !ground && model.hasFreeFlyer() && first.name == "root_joint" && first.X_PJ.p.isZero(0) &&
                 first.X_PJ.R.isIdentity(0);
  }

  /// A URDF that must do without a YAML file; what it cannot say of its tree goes to `warnings`.
  std::string formatUrdfAlone(const UrdfDialect& dialect, FormatWarnings& warnings) {
    dialect_ = &dialect;
    warnings_ = &warnings;
    for (int i = 1; i < model_.numBodies(); ++i) {
      const JointKind kind = model_.joints()[i].kind;
      if (!dialect.for_drake && (kind == JointKind::Spherical || kind == JointKind::Universal))
        refuse(model_, std::string(getName(kind)) + " joint '" + model_.joints()[i].name + "'",
               "a URDF has no such joints");
    }
    for (const Closure& c : model_.closures()) {
      if (dialect.for_drake && c.kind != ClosureKind::Coupler) continue;
      // The joint that mimics: the later one, or the other one if that mimics already.
      int y = 1;
      if (c.terms.size() == 2 && mimics_.count(c.terms[1].joint)) y = 0;
      if (c.terms.size() != 2 || mimics_.count(c.terms[y].joint))
        warn("closure '" + c.name + "'", dialect.for_drake ? "it is left out: <mimic> couples a joint to one other"
                                                           : "it is left out, a URDF is a tree");
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

  std::string formatYaml(const std::string& remark) {
    std::ostringstream out;
    if (!remark.empty()) out << "# " << remark << "\n";
    if (!free_root_ && !model_.hasFreeFlyer()) out << "base: fixed\n";
    if (model_.gravity() != Vector3d(0, 0, -9.81)) out << "gravity: [" << formatVector(model_.gravity(), ", ") << "]\n";
    writeJointTypes(out);
    writeClosures(out);
    writeMotors(out);
    writeJointForces(out);
    writePointSprings(out);
    writeContacts(out);
    writeReferences(out);
    if (!model_.serialJoints().empty()) {
      out << "\nserial_joints:\n";
      for (int i : model_.serialJoints()) out << "  - " << quote(model_.joints()[i].name) << "\n";
    }
    writeImportance(out);
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
      out << "    <inertial>\n      <origin xyz=\"" << formatVector(body.inertia.com) << "\"/>\n      <mass value=\""
          << formatNumber(body.inertia.mass) << "\"/>\n      <inertia";
      const double least = 1e-12 * I.diagonal().maxCoeff();  // products below it are rounding
      const auto write = [&](const char* name, double value) {
        out << " " << name << "=\"" << formatNumber(std::abs(value) < least ? 0 : value) << "\"";
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
        out << "<box size=\"" << formatVector(size) << "\"/>";
        break;
      case Visual::Shape::Cylinder:
        out << "<cylinder radius=\"" << formatRounded(size[0]) << "\" length=\"" << formatRounded(size[1]) << "\"/>";
        break;
      case Visual::Shape::Sphere:
        out << "<sphere radius=\"" << formatRounded(size[0]) << "\"/>";
        break;
      case Visual::Shape::Mesh:
        out << "<mesh filename=\"" << escapeXml(visual.mesh) << "\" scale=\"" << formatVector(size) << "\"/>";
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
      out << "<box size=\"" << formatVector(2 * (half + Vector3d::Constant(shape.radius))) << "\"/>";
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
      out << "    <axis xyz=\"" << formatVector(joint.axis) << "\"/>\n";
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
      refuse(model_, "joint '" + joint.name + "'", "it is limited on one side, or has several coordinates with limits");
    const double effort = dialect_ ? getEffortLimit(joint) : HUGE_VAL;
    if (!ranged && !slow && std::isinf(effort) && (joint.kind == JointKind::Continuous || joint.nv != 1)) return;
    out << "    <limit";
    if (ranged) out << " lower=\"" << formatRounded(lower[0]) << "\" upper=\"" << formatRounded(upper[0]) << "\"";
    out << " effort=\"" << formatNumber(std::isfinite(effort) ? effort : 0) << "\" velocity=\""
        << formatNumber(slow ? velocity[0] : 0) << "\"/>\n";
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
      if (std::isfinite(value)) text += std::string(" ") + name + "=\"" + formatNumber(value, "%.17g") + "\"";
    if (!text.empty()) out << "    <limit" << text << "/>\n";
  }

  void writeMimicAndDynamics(int i, std::ostream& out) {
    if (const auto it = mimics_.find(i); it != mimics_.end())
      out << "    <mimic joint=\"" << escapeXml(model_.joints()[it->second.joint].name) << "\" multiplier=\""
          << formatNumber(it->second.multiplier, "%.17g") << "\" offset=\"" << formatNumber(it->second.offset, "%.17g")
          << "\"/>\n";
    for (const JointForce& force : model_.jointForces()) {
      if (force.joint != i) continue;
      const std::string element = "joint '" + model_.joints()[i].name + "'";
      if (force.damping != 0 || force.friction != 0)
        out << "    <dynamics damping=\"" << formatNumber(force.damping, "%.17g") << "\" friction=\""
            << formatNumber(force.friction, "%.17g") << "\"/>\n";
      if (force.friction != 0 && force.friction_speed != JointForce().friction_speed)
        warn(element, "its friction_speed is left out");
      if (force.friction != 0 && isForDrake()) warn(element, "its friction is written, but Drake leaves it out");
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

  // A frame of the model at this place; if there is none, a generated name.
  std::string findFrame(int body, const SE3& X_BF, const std::string& made) const {
    for (const Frame& frame : model_.frames())
      if (frame.body == body && frame.X_BF.p == X_BF.p && frame.X_BF.R == X_BF.R) return frame.name;
    return made;
  }

  // Frames of closures and contacts that have no name.
  void writeMadeFrames(int body, std::ostream& out) {
    const auto write = [&](int owner, const SE3& X, const std::string& made) {
      if (owner == body && findFrame(owner, X, made) == made && model_.findFrame(made) < 0)
        writeFrame(made, body, X, out);
    };
    for (const Closure& c : model_.closures()) {
      if (c.kind == ClosureKind::Coupler || isForDrake()) continue;
      write(c.body1, c.X_B1, c.name + "_frame1");
      write(c.body2, c.X_B2, c.name + "_frame2");
    }
    for (const ContactFrame& c : model_.contacts()) write(c.body, c.X_BF, c.name + "_sole");
  }

  void writeJointTypes(std::ostream& out) {
    std::string names, types;
    for (int i = 1; i < model_.numBodies(); ++i) {
      const Joint& joint = model_.joints()[i];
      if (joint.kind != JointKind::Spherical && joint.kind != JointKind::Universal) continue;
      names += "  - " + quote(joint.name) + "\n";
      if (joint.kind == JointKind::Spherical) {
        types += "  - SPHERICAL\n";
        continue;
      }
      const char a = getAxisLetter(joint.axis), b = getAxisLetter(joint.axis2);
      if (!a || !b)
        refuse(model_, "universal joint '" + joint.name + "'", "its axes are not among x, y and z of its frame");
      types += std::string("  - UJOINT_") + a + b + "\n";
    }
    if (!names.empty()) out << "\njoint_name:\n" << names << "joint_type:\n" << types;
  }

  void writeClosures(std::ostream& out) {
    if (!model_.closures().empty()) out << "\nclosures:\n";
    for (const Closure& c : model_.closures()) {
      out << "  - {name: " << quote(c.name);
      if (c.kind == ClosureKind::Coupler)
        writeTerms(c, out);
      else
        out << ", frames: [" << quote(findFrame(c.body1, c.X_B1, c.name + "_frame1")) << ", "
            << quote(findFrame(c.body2, c.X_B2, c.name + "_frame2")) << "]";
      out << ", type: " << getName(c.kind);
      if (c.kind == ClosureKind::Hinge5D) out << ", axis: [" << formatVector(c.axis, ", ") << "]";
      if (c.kp != 0) out << ", kp: " << formatNumber(c.kp);
      if (c.kd != 0) out << ", kd: " << formatNumber(c.kd);
      out << "}\n";
    }
  }

  void writeTerms(const Closure& c, std::ostream& out) const {
    const char* separator = ", joints: {";
    for (const CouplerTerm& term : c.terms) {
      out << separator << quote(model_.joints()[term.joint].name) << ": " << formatNumber(term.coefficient);
      separator = ", ";
    }
    out << "}";
    if (c.offset != 0) out << ", offset: " << formatNumber(c.offset);
  }

  void writeMotors(std::ostream& out) {
    if (!model_.motors().empty()) out << "\nmotors:  # armature in kg m^2 (kg where prismatic), N m and rad/s\n";
    for (const Motor& motor : model_.motors()) {
      out << "  " << quote(motor.name) << ": {armature: " << formatNumber(motor.armature);
      if (std::isfinite(motor.effort_limit)) out << ", effort: " << formatNumber(motor.effort_limit);
      if (std::isfinite(motor.velocity_limit)) out << ", velocity: " << formatNumber(motor.velocity_limit);
      out << formatMotorData(motor) << "}\n";
    }
    std::string others;
    for (int i = 1; i < model_.numBodies(); ++i) {
      const Joint& joint = model_.joints()[i];
      const double armature = model_.armature()[joint.idx_v];
      if (armature != 0 && model_.findMotor(joint.name) < 0)
        others += "  " + quote(joint.name) + ": " + formatNumber(armature) + "\n";
    }
    if (!others.empty()) out << "armature:\n" << others;
  }

  void writeJointForces(std::ostream& out) {
    if (!model_.jointForces().empty()) out << "\njoint_forces:  # N m, rad, s; N, m, s where prismatic\n";
    for (const JointForce& force : model_.jointForces()) {
      out << "  " << quote(model_.joints()[force.joint].name) << ": {stiffness: " << formatNumber(force.stiffness);
      if (force.rest != 0) out << ", rest: " << formatNumber(force.rest);
      if (force.preload != 0) out << ", preload: " << formatNumber(force.preload);
      if (force.damping != 0) out << ", damping: " << formatNumber(force.damping);
      if (force.friction != 0)
        out << ", friction: " << formatNumber(force.friction)
            << ", friction_speed: " << formatNumber(force.friction_speed);
      out << "}\n";
    }
  }

  void writePointSprings(std::ostream& out) {
    if (!model_.pointSprings().empty()) out << "\npoint_springs:  # N/m, m, N, N s/m\n";
    for (const PointSpring& spring : model_.pointSprings()) {
      out << "  " << quote(spring.name) << ":\n    frames: [" << quote(model_.bodies()[spring.body1].name) << ", "
          << quote(model_.bodies()[spring.body2].name) << "]\n    points: [[" << formatVector(spring.point1, ", ")
          << "], [" << formatVector(spring.point2, ", ") << "]]\n";
      const auto write = [&out](const char* key, double value) {
        out << "    " << key << ": " << formatNumber(value) << "\n";
      };
      write("stiffness", spring.stiffness);
      write("rest", spring.rest);
      if (spring.preload != 0) write("preload", spring.preload);
      if (spring.damping != 0) write("damping", spring.damping);
    }
  }

  void writeContacts(std::ostream& out) {
    if (!model_.contacts().empty()) out << "\ncontacts:\n";
    for (const ContactFrame& c : model_.contacts()) {
      out << "  " << quote(c.name) << ": {frame: " << quote(findFrame(c.body, c.X_BF, c.name + "_sole")) << ", type: ";
      if (c.kind == ContactKind::Point3D)
        out << "3d";
      else
        out << "6d, sole: [" << formatRounded(2 * c.half_length) << ", " << formatRounded(2 * c.half_width) << "]";
      out << "}\n";
    }
  }

  void writeImportance(std::ostream& out) {
    std::string lines;
    for (const Joint& joint : model_.joints())
      if (joint.position_importance != 1 || joint.velocity_importance != 1)
        lines += "  " + quote(joint.name) + ": [" + formatNumber(joint.position_importance) + ", " +
                 formatNumber(joint.velocity_importance) + "]\n";
    if (!lines.empty()) out << "\nimportance:\n" << lines;
  }

  void writeReferences(std::ostream& out) {
    if (!model_.references().empty()) out << "\nreferences:\n";
    for (const Reference& reference : model_.references()) {
      out << "  " << quote(reference.name) << ":\n";
      if (!reference.joints.empty()) out << "    joints:\n";
      for (const auto& [name, values] : reference.joints)
        out << "      " << quote(name) << ": " << (values.size() == 1 ? formatRounded(values[0]) : formatList(values))
            << "\n";
      if (!reference.height_frame.empty())
        out << "    height: {frame: " << quote(reference.height_frame) << ", value: " << formatRounded(reference.height)
            << "}\n";
      if (!reference.feet.empty()) out << "    feet:\n";
      for (const auto& [name, place] : reference.feet)
        out << "      " << quote(name) << ": [" << formatVector(place, ", ") << "]\n";
    }
  }

  const Model& model_;
  std::set<std::string> bodies_;
  bool free_root_ = false;  // the root link is carried by the free-flyer that the reader makes
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

RobotText formatRobot(const Model& model, const std::string& remark) {
  Writer writer(model);
  return {writer.formatUrdf(remark), writer.formatYaml(remark)};
}

std::string formatMotorData(const Motor& motor) {
  std::string text;
  const auto add = [&text](const char* key, double value, double unless) {
    if (value != unless) text += std::string(", ") + key + ": " + formatNumber(value);
  };
  if (motor.torque_loss) text += ", torque_loss: " + formatNumber(*motor.torque_loss);
  add("continuous_effort", motor.continuous_effort, HUGE_VAL);
  const MotorDrive &drive = motor.drive, ideal;
  add("ratio", drive.ratio, ideal.ratio);
  add("rotor_inertia", drive.rotor_inertia, ideal.rotor_inertia);
  add("torque_constant", drive.torque_constant, ideal.torque_constant);
  add("resistance", drive.resistance, ideal.resistance);
  add("voltage", drive.voltage, ideal.voltage);
  add("current", drive.current, ideal.current);
  add("continuous_current", drive.continuous_current, ideal.continuous_current);
  add("efficiency", drive.efficiency, ideal.efficiency);
  add("back_efficiency", drive.back_efficiency, ideal.back_efficiency);
  add("mass", drive.mass, ideal.mass);
  return text;
}

std::string formatUrdfTree(const Model& model, const UrdfDialect& dialect, FormatWarnings& warnings) {
  return Writer(model).formatUrdfAlone(dialect, warnings);
}

UrdfText formatUrdf(const Model& model) {
  FormatWarnings warnings(model);
  const std::string text = formatUrdfTree(model, {}, warnings);
  warnings.addBeyondTree();
  warnings.addYamlOnly();
  return {text, warnings.get()};
}

void writeRobot(const Model& model, const std::string& directory, const std::string& remark) {
  namespace fs = std::filesystem;
  const fs::path path = fs::absolute(directory).lexically_normal();
  const std::string name = (path.has_filename() ? path : path.parent_path()).filename().string();
  const RobotText text = formatRobot(model, remark);
  std::error_code error;
  fs::create_directories(path, error);
  if (error)
    throw ModelError(directory, "directory", "it cannot be made: " + error.message(), "give another one with -o");
  writeTextFile((path / (name + ".urdf")).string(), text.urdf);
  writeTextFile((path / (name + ".yaml")).string(), text.yaml);
}

}  // namespace bielle
