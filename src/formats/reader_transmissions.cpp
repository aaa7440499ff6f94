// Motors of a URDF by the words of ROS: transmissions of ros_control, and joints of ros2_control.
#include <algorithm>
#include <cmath>
#include <set>

#include "bielle/model/error.h"
#include "formats/reader_dialects.h"
#include "model/number_text.h"

namespace bielle {
namespace {

class TransmissionReader {
 public:
  TransmissionReader(UrdfFile& tree, YamlFile& settings) : tree_(tree), settings_(settings) {}

  void read(const XMLElement& robot) {
    const auto controls = getChildren(robot, "ros2_control");
    for (const XMLElement* e : getChildren(robot, "transmission")) readTransmission(*e);
    for (const XMLElement* control : controls)
      for (const XMLElement* e : getChildren(*control, "transmission")) readTransmission(*e);
    for (const XMLElement* control : controls)
      for (const XMLElement* e : getChildren(*control, "joint")) readControlled(*e);
  }

 private:
  [[noreturn]] void fail(const XMLElement& e, const std::string& problem, const std::string& remedy) const {
    throw InputError(tree_.path, describe(e), problem, remedy);
  }
  void warn(const XMLElement& e, const std::string& problem) {
    tree_.warnings.push_back(tree_.path + ": " + describe(e) + ": " + problem);
  }
  double parse(const XMLElement& e) const {
    std::vector<double> v;
    if (!parseNumbers(getText(e), v) || v.size() != 1) fail(e, "it is not made of 1 finite number", "correct it");
    return v[0];
  }

  // One end of a transmission.
  struct Port {
    const XMLElement* element = nullptr;
    std::string name, role;
    double reduction = 1, offset = 0;
  };
  double getNumber(const XMLElement& e, const char* tag, const char* tag2, double otherwise) const {
    const XMLElement* child = e.FirstChildElement(tag);
    if (!child && tag2) child = e.FirstChildElement(tag2);
    return child ? parse(*child) : otherwise;
  }
  double getReduction(const XMLElement& e) const {
    const double reduction = getNumber(e, "mechanicalReduction", "mechanical_reduction", 1);
    if (reduction == 0) fail(e, "its mechanical reduction is 0", "give turns of the rotor per turn of the joint");
    return reduction;
  }
  std::vector<Port> listPorts(const XMLElement& e, const char* tag) const {
    std::vector<Port> out;
    for (const XMLElement* child : getChildren(e, tag)) {
      Port port{child, getAttribute(child, "name"), getAttribute(child, "role"), getReduction(*child),
                getNumber(*child, "offset", nullptr, 0)};
      if (const XMLElement* role = child->FirstChildElement("role")) port.role = getText(*role);
      out.push_back(port);
    }
    // In the order of the file unless their roles say otherwise.
    if (out.size() == 2 && out[0].role == std::string(tag) + "2" && out[1].role == std::string(tag) + "1")
      std::swap(out[0], out[1]);
    return out;
  }
  const UrdfJoint& getDriven(const Port& port) const {
    const auto it = std::find_if(tree_.joints.begin(), tree_.joints.end(),
                                 [&](const UrdfJoint& joint) { return joint.joint.name == port.name; });
    if (it == tree_.joints.end()) fail(*port.element, "there is no joint '" + port.name + "'", "correct the name");
    return *it;
  }

  void readTransmission(const XMLElement& e) {
    std::string type = getAttribute(&e, "type");
    for (const char* tag : {"type", "plugin"})
      if (const XMLElement* child = e.FirstChildElement(tag)) type = getText(*child);
    const std::string kind =
        type.substr(type.find_last_of("/:") == std::string::npos ? 0 : type.find_last_of("/:") + 1);
    const std::vector<Port> joints = listPorts(e, "joint"), actuators = listPorts(e, "actuator");
    const bool is_simple = kind == "SimpleTransmission", is_differential = kind == "DifferentialTransmission";
    if (!is_simple && !is_differential && kind != "FourBarLinkageTransmission")
      return warn(e, "it is left out: transmissions '" + type +
                         "' are not known here; give `motors`, and couplers under "
                         "`closures`, in the robot's YAML file");
    const size_t count = is_simple ? 1 : 2;
    if (joints.size() != count || actuators.size() > count || actuators.size() + is_simple < count)
      fail(e, "it does not have " + std::to_string(count) + " <joint> and " + std::to_string(count) + " <actuator>",
           "correct it");
    for (const Port& port : joints) transmitted_.insert(port.name);
    for (const Port& port : joints)
      if (getNv(getDriven(port).joint.kind) != 1)
        return warn(e, "it is left out: joint '" + port.name + "' does not have exactly one coordinate");
    if (is_simple)
      addMotor(e, joints[0].name,
               getReduction(e) * joints[0].reduction * (actuators.empty() ? 1 : actuators[0].reduction));
    else
      addRotors(e, joints, actuators, is_differential);
  }

  // A joint in <ros2_control>, which may lack in this file: it has a motor if it takes commands and no transmission drives it, or
  // follows another one.
  void readControlled(const XMLElement& e) {
    const std::string name = getAttribute(&e, "name");
    const auto find = [this](const std::string& sought) {
      return std::find_if(tree_.joints.begin(), tree_.joints.end(), [&](const UrdfJoint& joint) {
        return joint.joint.name == sought && getNv(joint.joint.kind) == 1;
      });
    };
    const auto joint = find(name);
    if (joint == tree_.joints.end()) return;
    std::map<std::string, const XMLElement*> params;
    for (const XMLElement* param : getChildren(e, "param")) params[getAttribute(param, "name")] = param;
    if (params.count("mimic") && joint->mimicked.empty()) {
      const XMLElement& mimic = *params["mimic"];
      if (find(getText(mimic)) == tree_.joints.end())
        fail(mimic, "'" + getText(mimic) + "' is no joint with one coordinate", "name one");
      const auto get = [&](const char* key, double usual) { return params.count(key) ? parse(*params[key]) : usual; };
      joint->mimicked = getText(mimic);
      joint->multiplier = get("multiplier", 1);
      joint->offset = get("offset", 0);
    }
    const bool is_driven = std::any_of(settings_.motors.begin(), settings_.motors.end(),
                                       [&](const MotorSpec& motor) { return motor.joint == name; });
    if (e.FirstChildElement("command_interface") && joint->mimicked.empty() && !is_driven && !transmitted_.count(name))
      addMotor(e, name, 1);
  }

  void addMotor(const XMLElement& e, const std::string& joint, double ratio) {
    for (const MotorSpec& other : settings_.motors)
      if (other.joint == joint) return warn(e, "it is left out: joint '" + joint + "' already has a motor");
    MotorSpec motor;
    motor.joint = joint;
    motor.drive.ratio = std::abs(ratio);
    settings_.motors.push_back(motor);
  }

  void addRotors(const XMLElement& e, const std::vector<Port>& joints, const std::vector<Port>& actuators,
                 bool is_differential) {
    const UrdfJoint first = getDriven(joints[0]);
    const Port &j1 = joints[0], &j2 = joints[1];
    for (int i = 0; i < 2; ++i) {
      const Port& actuator = actuators[i];
      if (actuator.name.empty()) fail(*actuator.element, "it has no name", "give it one");
      UrdfJoint rotor;
      rotor.parent = first.parent;
      rotor.child = rotor.joint.name = actuator.name;
      rotor.joint.kind = JointKind::Continuous;
      rotor.joint.X_PJ = first.joint.X_PJ;
      rotor.joint.axis = first.joint.axis;
      const auto is_taken = [&](const UrdfJoint& joint) { return joint.joint.name == actuator.name; };
      if (std::any_of(tree_.joints.begin(), tree_.joints.end(), is_taken) ||
          !tree_.links.emplace(actuator.name, makeRotor(actuator.name)).second)
        fail(*actuator.element, "there is a link or joint of this name already", "rename it");
      tree_.joints.push_back(rotor);
      ClosureSpec coupler;
      coupler.kind = ClosureKind::Coupler;
      coupler.name = actuator.name + "_transmission";
      const double n = actuator.reduction;
      double c1 = n * j1.reduction, c2 = 0;
      if (is_differential)
        c2 = (i == 0 ? 1 : -1) * n * j2.reduction;
      else if (i == 1)
        c1 = n, c2 = n * j2.reduction;
      coupler.coefficients = {{actuator.name, 1}, {j1.name, -c1}};
      if (c2 != 0) coupler.coefficients[j2.name] = -c2;
      coupler.offset = 0.0 - c1 * j1.offset - c2 * j2.offset;
      settings_.closures.push_back(coupler);
      addMotor(e, actuator.name, 1);
    }
    warn(e, "its actuators '" + actuators[0].name + "' and '" + actuators[1].name +
                "' are rotors without inertia and without limits, since limits of the file are those of joints; "
                "`motors` in the "
                "robot's YAML file gives effort, velocity and armature");
  }

  UrdfFile& tree_;
  YamlFile& settings_;
  std::set<std::string> transmitted_;  // joints
};

}  // namespace

UrdfLink makeRotor(const std::string& name) {
  constexpr double kMass = 1e-9, kInertia = 1e-9;  // kg, kg m^2
  return {name, {kMass, Vector3d::Zero(), kInertia * Matrix3d::Identity()}, {}, {}};
}

void readTransmissions(const XMLElement& robot, UrdfFile& tree, YamlFile& settings) {
  TransmissionReader(tree, settings).read(robot);
}

}  // namespace bielle
