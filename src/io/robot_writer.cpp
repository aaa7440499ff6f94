#include "bielle/io/robot_writer.h"

#include <cmath>
#include <filesystem>
#include <sstream>

#include "bielle/model/error.h"
#include "io/robot_text.h"
#include "io/text_file.h"
#include "io/urdf_writer.h"

namespace bielle {
namespace {

// A name in YAML syntax.
std::string quoteName(const std::string& name) {
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

// The letter of a direction that is an axis of its frame, or 0.
char getAxisLetter(const Vector3d& axis) {
  for (int i = 0; i < 3; ++i)
    if (axis.isApprox(Vector3d::Unit(i), 1e-12)) return static_cast<char>('X' + i);
  return 0;
}

class YamlWriter {
 public:
  explicit YamlWriter(const Model& model) : model_(model) {}

  std::string format(const std::string& remark) {
    std::ostringstream out;
    if (!remark.empty()) out << "# " << remark << "\n";
    if (!hasImpliedFreeFlyer(model_) && !model_.hasFreeFlyer()) out << "base: fixed\n";
    if (model_.gravity() != Vector3d(0, 0, -9.81))
      out << "gravity: [" << formatRounded(model_.gravity(), ", ") << "]\n";
    writeJointTypes(out);
    writeClosures(out);
    writeMotors(out);
    writeJointForces(out);
    writePointSprings(out);
    writeContacts(out);
    writeReferences(out);
    if (!model_.serialJoints().empty()) {
      out << "\nserial_joints:\n";
      for (int i : model_.serialJoints()) out << "  - " << quoteName(model_.joints()[i].name) << "\n";
    }
    writeImportance(out);
    return out.str();
  }

 private:
  void writeJointTypes(std::ostream& out) {
    std::string names, types;
    for (int i = 1; i < model_.numBodies(); ++i) {
      const Joint& joint = model_.joints()[i];
      if (joint.kind != JointKind::Spherical && joint.kind != JointKind::Universal) continue;
      names += "  - " + quoteName(joint.name) + "\n";
      if (joint.kind == JointKind::Spherical) {
        types += "  - SPHERICAL\n";
        continue;
      }
      const char a = getAxisLetter(joint.axis), b = getAxisLetter(joint.axis2);
      if (!a || !b)
        refuseToWrite(model_, "universal joint '" + joint.name + "'",
                      "its axes are not two of x, y and z of its frame");
      types += std::string("  - UJOINT_") + a + b + "\n";
    }
    if (!names.empty()) out << "\njoint_name:\n" << names << "joint_type:\n" << types;
  }

  void writeClosures(std::ostream& out) {
    if (!model_.closures().empty()) out << "\nclosures:\n";
    for (const Closure& c : model_.closures()) {
      out << "  - {name: " << quoteName(c.name);
      if (c.kind == ClosureKind::Coupler)
        writeTerms(c, out);
      else
        out << ", frames: [" << quoteName(findFrameName(model_, c.body1, c.X_B1, c.name + "_frame1")) << ", "
            << quoteName(findFrameName(model_, c.body2, c.X_B2, c.name + "_frame2")) << "]";
      out << ", type: " << getName(c.kind);
      if (c.kind == ClosureKind::Hinge5D) out << ", axis: [" << formatRounded(c.axis, ", ") << "]";
      if (c.kp != 0) out << ", kp: " << formatRobotNumber(c.kp);
      if (c.kd != 0) out << ", kd: " << formatRobotNumber(c.kd);
      out << "}\n";
    }
  }

  void writeTerms(const Closure& c, std::ostream& out) const {
    const char* separator = ", joints: {";
    for (const CouplerTerm& term : c.terms) {
      out << separator << quoteName(model_.joints()[term.joint].name) << ": " << formatRobotNumber(term.coefficient);
      separator = ", ";
    }
    out << "}";
    if (c.offset != 0) out << ", offset: " << formatRobotNumber(c.offset);
  }

  void writeMotors(std::ostream& out) {
    if (!model_.motors().empty()) out << "\nmotors:  # armature in kg m^2 (kg where prismatic), N m and rad/s\n";
    for (const Motor& motor : model_.motors()) {
      out << "  " << quoteName(motor.name) << ": {armature: " << formatRobotNumber(motor.armature);
      if (std::isfinite(motor.effort_limit)) out << ", effort: " << formatRobotNumber(motor.effort_limit);
      if (std::isfinite(motor.velocity_limit)) out << ", velocity: " << formatRobotNumber(motor.velocity_limit);
      out << formatMotorData(motor) << "}\n";
    }
    std::string others;
    for (int i = 1; i < model_.numBodies(); ++i) {
      const Joint& joint = model_.joints()[i];
      const double armature = model_.armature()[joint.idx_v];
      if (armature != 0 && model_.findMotor(joint.name) < 0)
        others += "  " + quoteName(joint.name) + ": " + formatRobotNumber(armature) + "\n";
    }
    if (!others.empty()) out << "armature:\n" << others;
  }

  void writeJointForces(std::ostream& out) {
    if (!model_.jointForces().empty()) out << "\njoint_forces:  # N m, rad, s; N, m, s where prismatic\n";
    for (const JointForce& force : model_.jointForces()) {
      out << "  " << quoteName(model_.joints()[force.joint].name)
          << ": {stiffness: " << formatRobotNumber(force.stiffness);
      if (force.rest != 0) out << ", rest: " << formatRobotNumber(force.rest);
      if (force.preload != 0) out << ", preload: " << formatRobotNumber(force.preload);
      if (force.damping != 0) out << ", damping: " << formatRobotNumber(force.damping);
      if (force.friction != 0)
        out << ", friction: " << formatRobotNumber(force.friction)
            << ", friction_speed: " << formatRobotNumber(force.friction_speed);
      out << "}\n";
    }
  }

  void writePointSprings(std::ostream& out) {
    if (!model_.pointSprings().empty()) out << "\npoint_springs:  # N/m, m, N, N s/m\n";
    for (const PointSpring& spring : model_.pointSprings()) {
      out << "  " << quoteName(spring.name) << ":\n    frames: [" << quoteName(model_.bodies()[spring.body1].name)
          << ", " << quoteName(model_.bodies()[spring.body2].name) << "]\n    points: [["
          << formatRounded(spring.point1, ", ") << "], [" << formatRounded(spring.point2, ", ") << "]]\n";
      const auto write = [&out](const char* key, double value) {
        out << "    " << key << ": " << formatRobotNumber(value) << "\n";
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
      out << "  " << quoteName(c.name)
          << ": {frame: " << quoteName(findFrameName(model_, c.body, c.X_BF, c.name + "_sole")) << ", type: ";
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
        lines += "  " + quoteName(joint.name) + ": [" + formatRobotNumber(joint.position_importance) + ", " +
                 formatRobotNumber(joint.velocity_importance) + "]\n";
    if (!lines.empty()) out << "\nimportance:\n" << lines;
  }

  void writeReferences(std::ostream& out) {
    if (!model_.references().empty()) out << "\nreferences:\n";
    for (const Reference& reference : model_.references()) {
      out << "  " << quoteName(reference.name) << ":\n";
      if (!reference.joints.empty()) out << "    joints:\n";
      for (const auto& [name, values] : reference.joints)
        out << "      " << quoteName(name) << ": "
            << (values.size() == 1 ? formatRounded(values[0]) : formatList(values)) << "\n";
      if (!reference.height_frame.empty())
        out << "    height: {frame: " << quoteName(reference.height_frame)
            << ", value: " << formatRounded(reference.height) << "}\n";
      if (!reference.feet.empty()) out << "    feet:\n";
      for (const auto& [name, place] : reference.feet)
        out << "      " << quoteName(name) << ": [" << formatRounded(place, ", ") << "]\n";
    }
  }

  const Model& model_;
};

}  // namespace

RobotText formatRobot(const Model& model, const std::string& remark) {
  return {formatUrdfBesideYaml(model, remark), YamlWriter(model).format(remark)};
}

std::string formatMotorData(const Motor& motor) {
  std::string text;
  const auto add = [&text](const char* key, double value, double unless) {
    if (value != unless) text += std::string(", ") + key + ": " + formatRobotNumber(value);
  };
  if (motor.torque_loss) text += ", torque_loss: " + formatRobotNumber(*motor.torque_loss);
  add("continuous_effort", motor.continuous_effort, HUGE_VAL);
  const MotorDrive &drive = motor.drive, ideal;
  if (!drive.type.empty()) text += ", catalogue_type: " + quoteName(drive.type);
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

void writeRobot(const Model& model, const std::string& directory, const std::string& remark) {
  namespace fs = std::filesystem;
  const fs::path path = fs::absolute(directory).lexically_normal();
  const std::string name = (path.has_filename() ? path : path.parent_path()).filename().string();
  const RobotText text = formatRobot(model, remark);
  std::error_code error;
  fs::create_directories(path, error);
  if (error)
    throw ModelError(directory, "directory", "it cannot be created: " + error.message(), "give another one with -o");
  writeTextFile((path / (name + ".urdf")).string(), text.urdf);
  writeTextFile((path / (name + ".yaml")).string(), text.yaml);
}

}  // namespace bielle
