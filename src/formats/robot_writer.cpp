#include "bielle/formats/robot_writer.h"

#include <yaml-cpp/yaml.h>

#include <cmath>
#include <filesystem>

#include "bielle/model/error.h"
#include "formats/robot_text.h"
#include "formats/text_file.h"
#include "formats/urdf_writer.h"

namespace bielle {
namespace {

using YAML::BeginMap, YAML::BeginSeq, YAML::EndMap, YAML::EndSeq, YAML::Emitter, YAML::Flow, YAML::Key, YAML::Value;

Emitter& operator<<(Emitter& out, const Vector3d& v) {
  return out << Flow << BeginSeq << formatExact(v.x()) << formatExact(v.y()) << formatExact(v.z()) << EndSeq;
}

// The letter of a direction that is an axis of its frame, or 0.
char getAxisLetter(const Vector3d& axis) {
  for (int i = 0; i < 3; ++i)
    if (axis.isApprox(Vector3d::Unit(i), 1e-12)) return static_cast<char>('X' + i);
  return 0;
}

class YamlWriter {
 public:
  YamlWriter(const Model& model, const Wear& wear) : model_(model), wear_(wear) {}

  std::string format(const std::string& remark) {
    if (!remark.empty()) out_ << YAML::Comment(remark);
    out_ << BeginMap;
    if (!hasImpliedFreeFlyer(model_) && !model_.hasFreeFlyer()) out_ << Key << "base" << Value << "fixed";
    if (model_.gravity() != Vector3d(0, 0, -9.81)) out_ << Key << "gravity" << Value << model_.gravity();
    writeJointTypes();
    writeClosures();
    writeMotors();
    writeJointForces();
    writePointSprings();
    writeContacts();
    writeReferences();
    if (!model_.serialJoints().empty()) {
      begin("serial_joints") << BeginSeq;
      for (int i : model_.serialJoints()) out_ << model_.joints()[i].name;
      out_ << EndSeq;
    }
    writeImportance();
    writeRodFrictions();
    writeMap("play", "rad, m", wear_.plays, [this](const Play& play) { add(play.name, play.size); });
    out_ << EndMap;
    return out_.size() ? out_.c_str() + std::string("\n") : "";
  }

 private:
  // A section after an empty line.
  Emitter& begin(const std::string& key, const std::string& units = "") {
    out_ << YAML::Newline << YAML::Newline << Key << key << Value;
    return units.empty() ? out_ : out_ << YAML::Comment(units);
  }

  // A section that is a map with an entry for each item, unless there is none.
  template <typename Items, typename Write>
  void writeMap(const std::string& key, const std::string& units, const Items& items, const Write& write) {
    if (items.empty()) return;
    begin(key, units) << BeginMap;
    for (const auto& item : items) write(item);
    out_ << EndMap;
  }

  Emitter& add(const std::string& key, const std::string& value) { return out_ << Key << key << Value << value; }
  void add(const std::string& key, double value) { add(key, formatExact(value)); }
  void addUnless(double without, const std::string& key, double value) {
    if (value != without) add(key, value);
  }
  void addNames(const std::string& a, const std::string& b) {
    out_ << Key << "frames" << Value << Flow << BeginSeq << a << b << EndSeq;
  }

  void writeJointTypes() {
    std::vector<std::string> names, types;
    for (int i = 1; i < model_.numBodies(); ++i) {
      const Joint& joint = model_.joints()[i];
      if (joint.kind != JointKind::Spherical && joint.kind != JointKind::Universal) continue;
      names.push_back(joint.name);
      types.emplace_back("SPHERICAL");
      if (joint.kind == JointKind::Spherical) continue;
      const char a = getAxisLetter(joint.axis), b = getAxisLetter(joint.axis2);
      if (!a || !b)
        refuseToWrite(model_, "universal joint '" + joint.name + "'",
                      "its axes are not two of x, y and z of its frame");
      types.back() = std::string("UJOINT_") + a + b;
    }
    if (names.empty()) return;
    begin("joint_name") << names;
    out_ << Key << "joint_type" << Value << types;
  }

  void writeClosures() {
    if (model_.closures().empty()) return;
    begin("closures") << BeginSeq;
    for (const Closure& c : model_.closures()) {
      out_ << Flow << BeginMap;
      add("name", c.name);
      if (c.kind == ClosureKind::Coupler)
        writeTerms(c);
      else
        addNames(findFrameName(model_, c.body1, c.X_B1, c.name + "_frame1"),
                 findFrameName(model_, c.body2, c.X_B2, c.name + "_frame2"));
      add("type", getName(c.kind));
      if (hasAxis(c.kind)) out_ << Key << "axis" << Value << c.axis;
      if (c.kind == ClosureKind::Distance) add("length", c.length);
      addUnless(0, "kp", c.kp);
      addUnless(0, "kd", c.kd);
      out_ << EndMap;
    }
    out_ << EndSeq;
  }

  void writeTerms(const Closure& c) {
    out_ << Key << "joints" << Value << Flow << BeginMap;
    for (const CouplerTerm& term : c.terms) {
      const std::string& joint = model_.joints()[term.joint].name;
      if (term.isLinear()) {
        add(joint, term.coefficient);
        continue;
      }
      out_ << Key << joint << Value << Flow << BeginSeq << formatExact(term.coefficient);
      for (double c_k : term.higher) out_ << formatExact(c_k);
      out_ << EndSeq;
    }
    out_ << EndMap;
    addUnless(0, "offset", c.offset);
  }

  void writeMotors() {
    const auto write = [this](const Motor& motor) {
      out_ << Key << motor.name << Value << Flow << BeginMap;
      add("armature", motor.armature);
      addUnless(HUGE_VAL, "effort", motor.effort_limit);
      addUnless(HUGE_VAL, "velocity", motor.velocity_limit);
      for (const auto& [key, value] : getMotorData(motor)) add(key, value);
      out_ << EndMap;
    };
    writeMap("motors", "armature in kg m^2 (kg where prismatic), N m and rad/s", model_.motors(), write);
    std::vector<const Joint*> others;
    for (const Joint& joint : model_.joints())
      if (joint.nv > 0 && model_.armature()[joint.idx_v] != 0 && model_.findMotor(joint.name) < 0)
        others.push_back(&joint);
    writeMap("armature", "", others, [this](const Joint* joint) { add(joint->name, model_.armature()[joint->idx_v]); });
  }

  void writeJointForces() {
    writeMap("joint_forces", "N m, rad, s; N, m, s where prismatic", joinJointForces(model_),
             [this](const WholeJointForce& whole) {
               out_ << Key << model_.joints()[whole.force.joint].name << Value << Flow << BeginMap;
               for (const auto& [key, value] : getJointForceData(whole)) add(key, value);
               out_ << EndMap;
             });
  }

  void writeRodFrictions() {
    writeMap("rod_friction", "m, rad/s", wear_.frictions, [this](const RodFriction& friction) {
      out_ << Key << friction.closure << Value << Flow << BeginMap;
      add("coefficient", friction.coefficient);
      add("radius", friction.radius);
      add("friction_speed", friction.friction_speed);
      if (friction.stiction > friction.coefficient) {
        add("stiction", friction.stiction);
        add("stribeck_speed", friction.stribeck_speed);
      }
      if (!friction.joints.empty()) out_ << Key << "joints" << Value << Flow << friction.joints;
      out_ << EndMap;
    });
  }

  void writePointSprings() {
    writeMap("point_springs", "N/m, m, N, N s/m", model_.pointSprings(), [this](const PointSpring& spring) {
      out_ << Key << spring.name << Value << BeginMap;
      addNames(model_.bodies()[spring.body1].name, model_.bodies()[spring.body2].name);
      out_ << Key << "points" << Value << Flow << BeginSeq << spring.point1 << spring.point2 << EndSeq;
      add("stiffness", spring.stiffness);
      add("rest", spring.rest);
      addUnless(0, "preload", spring.preload);
      addUnless(0, "damping", spring.damping);
      out_ << EndMap;
    });
  }

  void writeContacts() {
    writeMap("contacts", "", model_.contacts(), [this](const ContactFrame& c) {
      out_ << Key << c.name << Value << Flow << BeginMap;
      add("frame", findFrameName(model_, c.body, c.X_BF, c.name + "_sole"));
      add("type", getName(c.kind));
      if (c.kind == ContactKind::Edge5D) out_ << Key << "length" << Value << formatExact(2 * c.half_length);
      if (c.kind == ContactKind::Surface6D)
        out_ << Key << "sole" << Value << Flow << BeginSeq << formatExact(2 * c.half_length)
             << formatExact(2 * c.half_width) << EndSeq;
      out_ << EndMap;
    });
  }

  void writeImportance() {
    std::vector<const Joint*> joints;
    for (const Joint& joint : model_.joints())
      if (joint.position_importance != 1 || joint.velocity_importance != 1) joints.push_back(&joint);
    writeMap("importance", "", joints, [this](const Joint* joint) {
      out_ << Key << joint->name << Value << Flow << BeginSeq << formatExact(joint->position_importance)
           << formatExact(joint->velocity_importance) << EndSeq;
    });
  }

  void writeReferences() {
    writeMap("references", "", model_.references(), [this](const Reference& reference) {
      out_ << Key << reference.name << Value << BeginMap;
      if (!reference.joints.empty()) out_ << Key << "joints" << Value << BeginMap;
      for (const auto& [name, values] : reference.joints) {
        out_ << Key << name << Value;
        if (values.size() != 1) out_ << Flow << BeginSeq;
        for (double value : values) out_ << formatExact(value);
        if (values.size() != 1) out_ << EndSeq;
      }
      if (!reference.joints.empty()) out_ << EndMap;
      if (!reference.height_frame.empty()) {
        out_ << Key << "height" << Value << Flow << BeginMap;
        add("frame", reference.height_frame);
        add("value", formatExact(reference.height)) << EndMap;
      }
      if (!reference.feet.empty()) out_ << Key << "feet" << Value << BeginMap;
      for (const auto& [name, place] : reference.feet) {
        const auto yaw = reference.yaws.find(name);
        out_ << Key << name << Value;
        if (yaw == reference.yaws.end()) {
          out_ << place;
          continue;
        }
        out_ << Flow << BeginMap << Key << "place" << Value << place;
        add("yaw", yaw->second);
        out_ << EndMap;
      }
      if (!reference.feet.empty()) out_ << EndMap;
      out_ << EndMap;
    });
  }

  const Model& model_;
  const Wear& wear_;
  Emitter out_;
};

}  // namespace

RobotText formatRobot(const Model& model, const std::string& remark, const Wear& wear) {
  return {formatUrdfBesideYaml(model, remark), YamlWriter(model, wear).format(remark)};
}

std::vector<std::pair<const char*, std::string>> getMotorData(const Motor& motor) {
  const MotorDrive &drive = motor.drive, ideal;
  std::vector<std::pair<const char*, std::string>> data;
  const auto add = [&data](const char* key, double value, double unless) {
    if (value != unless) data.emplace_back(key, formatExact(value));
  };
  if (motor.torque_loss) data.emplace_back("torque_loss", formatExact(*motor.torque_loss));
  add("continuous_effort", motor.continuous_effort, HUGE_VAL);
  if (!drive.type.empty()) data.emplace_back("catalogue_type", drive.type);
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
  return data;
}

void writeRobot(const Model& model, const std::string& directory, const std::string& remark, const Wear& wear) {
  namespace fs = std::filesystem;
  const fs::path path = fs::absolute(directory).lexically_normal();
  const std::string name = (path.has_filename() ? path : path.parent_path()).filename().string();
  const RobotText text = formatRobot(model, remark, wear);
  std::error_code error;
  fs::create_directories(path, error);
  if (error)
    throw InputError(directory, "directory", "it cannot be created: " + error.message(), "give another one with -o");
  writeTextFile((path / (name + ".urdf")).string(), text.urdf);
  writeTextFile((path / (name + ".yaml")).string(), text.yaml);
}

}  // namespace bielle
