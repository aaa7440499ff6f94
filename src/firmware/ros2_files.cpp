#include "firmware/languages.h"
#include "firmware/printer.h"
#include "model/listing.h"

namespace bielle::firmware {
namespace {

// Keys: LIBRARY, ROBOT and @..@.
constexpr const char* kSourceText =
    R"(// Transmissions of ros2_control for the linkages of ROBOT. Written by `bielle convert --to ros2_control`, where there was no ROS:
// it is tested against stubs of the interfaces of transmission_interface, as published for ROS 2 Humble to Kilted.
//
// Positions, velocities and efforts, from motors to joints and back, by virtual work. What is no number, as commands that
// nobody has given, stays none. Efforts are carried over in the posture that was measured last, velocities in the one that is
// commanded, if there is one.
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

@includes@
namespace LIBRARY {

// What a <transmission> says, in the order of the maps: actuator = reduction * motor; joint of ROS = joint + offset.
template <std::size_t N>
struct Sides {
  std::array<std::string, N> joints, actuators;
  std::array<double, N> offsets, reductions;
};

template <typename Map>
class Linkage : public transmission_interface::Transmission {
 public:
  static constexpr std::size_t N = Map::kSize;
  using Real = typename Map::Real;
  using Values = std::array<Real, N>;

  explicit Linkage(const Sides<N>& sides) : sides_(sides) { Map::reference(&at_); }

  void configure(const std::vector<transmission_interface::JointHandle>& joint_handles,
                 const std::vector<transmission_interface::ActuatorHandle>& actuator_handles) override {
    bool is_used = false;
    for (std::size_t k = 0; k < 3; ++k) {
      find(joint_handles, sides_.joints, k, joint_[k]);
      find(actuator_handles, sides_.actuators, k, actuator_[k]);
      is_used = is_used || has(k);
    }
    if (!is_used)
      throw transmission_interface::Exception("no interface of " + sides_.joints[0] + " is given on both sides");
  }

  void actuator_to_joint() override {
    Values motor, joint;
    if (has(kPosition)) {
      getMotors(kPosition, motor);
      const bool is_known = areNumbers(motor);
      if (is_known) Map::motor_to_joint(motor.data(), &at_, &at_);
      is_measured_ = is_measured_ || is_known;
      for (std::size_t i = 0; i < N; ++i)
        joint_[kPosition][i].set_value(is_known ? at_.joint[i] + sides_.offsets[i] : NAN);
    }
    typename Map::Ratio ratio;
    Map::update_ratio(&at_, &ratio);
    if (has(kVelocity)) {
      getMotors(kVelocity, motor);
      Map::joint_velocity(&ratio, motor.data(), joint.data());
      for (std::size_t i = 0; i < N; ++i) joint_[kVelocity][i].set_value(joint[i]);
    }
    if (has(kEffort)) {
      getMotors(kEffort, motor);
      Map::joint_torque(&ratio, motor.data(), nullptr, joint.data());
      for (std::size_t i = 0; i < N; ++i) joint_[kEffort][i].set_value(joint[i]);
    }
  }

  void joint_to_actuator() override {
    Values motor, joint;
    typename Map::Posture wanted = at_;
    if (has(kPosition)) {
      for (std::size_t i = 0; i < N; ++i)
        joint[i] = static_cast<Real>(joint_[kPosition][i].get_value() - sides_.offsets[i]);
      const bool is_known = areNumbers(joint);
      if (is_known) Map::joint_to_motor(joint.data(), &at_, &wanted);
      if (is_known && !is_measured_) at_ = wanted;
      for (std::size_t i = 0; i < N; ++i)
        actuator_[kPosition][i].set_value(is_known ? wanted.motor[i] * sides_.reductions[i] : NAN);
    }
    typename Map::Ratio ratio;
    if (has(kVelocity)) {
      Map::update_ratio(&wanted, &ratio);
      getJoints(kVelocity, joint);
      Map::motor_velocity(&ratio, joint.data(), motor.data());
      for (std::size_t i = 0; i < N; ++i) actuator_[kVelocity][i].set_value(motor[i] * sides_.reductions[i]);
    }
    if (has(kEffort)) {
      Map::update_ratio(&at_, &ratio);
      getJoints(kEffort, joint);
      Map::motor_torque(&ratio, joint.data(), nullptr, motor.data());
      for (std::size_t i = 0; i < N; ++i) actuator_[kEffort][i].set_value(motor[i] / sides_.reductions[i]);
    }
  }

  std::size_t num_actuators() const override { return N; }
  std::size_t num_joints() const override { return N; }

 private:
  enum : std::size_t { kPosition, kVelocity, kEffort };

  bool has(std::size_t k) const { return !joint_[k].empty() && !actuator_[k].empty(); }
  static bool areNumbers(const Values& x) {
    return std::all_of(x.begin(), x.end(), [](Real value) { return std::isfinite(value); });
  }
  template <typename Handle>
  static void find(const std::vector<Handle>& handles, const std::array<std::string, N>& names, std::size_t k,
                   std::vector<Handle>& out) {
    const char* const interface[] = {hardware_interface::HW_IF_POSITION, hardware_interface::HW_IF_VELOCITY,
                                     hardware_interface::HW_IF_EFFORT};
    out.clear();
    for (const std::string& name : names)
      for (const Handle& handle : handles)
        if (handle.get_prefix_name() == name && handle.get_interface_name() == interface[k]) {
          out.push_back(handle);
          break;
        }
    if (!out.empty() && out.size() != N)
      throw transmission_interface::Exception("only some of " + names[0] + " and its like have the interface " +
                                              interface[k]);
  }
  void getMotors(std::size_t k, Values& x) const {
    for (std::size_t i = 0; i < N; ++i) {
      const double reduction = sides_.reductions[i], value = actuator_[k][i].get_value();
      x[i] = static_cast<Real>(k == kEffort ? value * reduction : value / reduction);
    }
  }
  void getJoints(std::size_t k, Values& x) const {
    for (std::size_t i = 0; i < N; ++i) x[i] = static_cast<Real>(joint_[k][i].get_value());
  }

  Sides<N> sides_;
  std::array<std::vector<transmission_interface::JointHandle>, 3> joint_;
  std::array<std::vector<transmission_interface::ActuatorHandle>, 3> actuator_;
  typename Map::Posture at_;  // measured last
  bool is_measured_ = false;
};

// Joints go by their names, in any order; actuators, whose names are free, by the order of the motors in the maps.
template <typename Map>
class Loader : public transmission_interface::TransmissionLoader {
 public:
  std::shared_ptr<transmission_interface::Transmission> load(const hardware_interface::TransmissionInfo& info) override {
    constexpr std::size_t N = Map::kSize;
    Sides<N> sides;
    if (info.joints.size() != N || info.actuators.size() != N)
      throw transmission_interface::Exception(info.name + ": this linkage has " + std::to_string(N) + " joints and as many actuators");
    for (std::size_t i = 0; i < N; ++i) {
      const auto fail = [&](const std::string& what) { throw transmission_interface::Exception(info.name + ": " + what); };
      const auto at = std::find_if(info.joints.begin(), info.joints.end(),
                                   [&](const auto& joint) { return joint.name == Map::joints()[i]; });
      if (at == info.joints.end()) fail("joint '" + Map::joints()[i] + "' is missing");
      if (at->mechanical_reduction != 1) fail("joint '" + at->name + "': its reduction is in the linkage; leave it out");
      const auto& actuator = info.actuators[i];
      if (!(std::abs(actuator.mechanical_reduction) > 0)) fail("actuator '" + actuator.name + "': its reduction is zero");
      sides.joints[i] = at->name, sides.offsets[i] = at->offset;
      sides.actuators[i] = actuator.name, sides.reductions[i] = actuator.mechanical_reduction;
    }
    return std::make_shared<Linkage<Map>>(sides);
  }
};

@maps@}  // namespace LIBRARY

@exports@)";

constexpr const char* kHeaders[] = {
    "hardware_interface/hardware_info.hpp",    "hardware_interface/types/hardware_interface_type_values.hpp",
    "pluginlib/class_list_macros.hpp",         "transmission_interface/exception.hpp",
    "transmission_interface/transmission.hpp", "transmission_interface/transmission_loader.hpp"};

// Keys: MAP and @..@.
constexpr const char* kMapText = R"(struct MAP_map {
  static constexpr int kSize = ::MAP::kSize;
  using Real = ::MAP::Real;
  using Posture = ::MAP::Posture;
  using Ratio = ::MAP::Ratio;
  static const std::array<std::string, kSize>& joints() {
    static const std::array<std::string, kSize> names = {@joints@};
    return names;
  }
  static constexpr auto* reference = &::MAP::reference;
  static constexpr auto* motor_to_joint = &::MAP::motor_to_joint;
  static constexpr auto* joint_to_motor = &::MAP::joint_to_motor;
  static constexpr auto* update_ratio = &::MAP::update_ratio;
  static constexpr auto* joint_velocity = &::MAP::joint_velocity;
  static constexpr auto* motor_velocity = &::MAP::motor_velocity;
  static constexpr auto* joint_torque = &::MAP::joint_torque;
  static constexpr auto* motor_torque = &::MAP::motor_torque;
};
using MAP_loader = Loader<MAP_map>;

)";

constexpr const char* kReadmeText = R"(
## As transmissions of ros2_control

`ros2_control.cpp` has a transmission for each linkage. It was not compiled against ROS here. In a package:

```cmake
find_package(pluginlib REQUIRED)
find_package(transmission_interface REQUIRED)
add_library(LIBRARY SHARED ros2_control.cpp@sources@)
ament_target_dependencies(LIBRARY pluginlib transmission_interface)
pluginlib_export_plugin_description_file(transmission_interface ros2_control_plugins.xml)
install(TARGETS LIBRARY DESTINATION lib)
```

In the URDF, with reductions of gears between actuators and the motors of the linkage:

```xml
@example@```

Actuators are listed in the order of `motor[]` above. Give the state and command interfaces of a linkage to one transmission, so that
efforts are carried over in the posture that was measured; weight and springs of the linkage are not added.
)";

std::string quote(const std::vector<std::string>& names) {
  std::vector<std::string> out;
  for (const std::string& name : names) out.push_back("\"" + name + "\"");
  return listItems(out);
}

std::string nameLibrary(const std::string& robot) {
  std::string out = robot + "_linkages";
  for (char& c : out)
    if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
  return std::isdigit(static_cast<unsigned char>(out[0])) ? "robot_" + out : out;
}

}  // namespace

std::map<std::string, std::string> writeRos2(const std::vector<Maps>& all, std::string& readme) {
  const std::string robot = all.front().robot, library = nameLibrary(robot);
  std::string includes, maps, exports, plugins, sources, example;
  for (const char* header : kHeaders) includes += std::string("#include \"") + header + "\"\n";
  includes += "\n";
  for (const Maps& each : all) {
    const std::string name = each.name, loader = library + "::" + name + "_loader";
    includes += "#include \"" + name + ".hpp\"\n";
    sources += " " + name + ".cpp";
    maps += fillIn(kMapText, {{"MAP", name}, {"@joints@", quote(each.joint_names)}});
    exports += "PLUGINLIB_EXPORT_CLASS(" + loader + ", transmission_interface::TransmissionLoader)\n";
    plugins += "  <class name=\"" + library + "/" + name + "\" type=\"" + loader +
               "\" base_class_type=\"transmission_interface::TransmissionLoader\">\n    <description>" +
               listItems(each.joint_names) + " by " + listItems(each.motor_names) + "</description>\n  </class>\n";
    if (!example.empty()) continue;
    example = "<transmission name=\"" + name + "\">\n  <plugin>" + library + "/" + name + "</plugin>\n";
    for (size_t i = 0; i < each.motor_names.size(); ++i)
      example += "  <actuator name=\"" + each.motor_names[i] + "\" role=\"actuator" + std::to_string(i + 1) +
                 "\"><mechanical_reduction>1</mechanical_reduction></actuator>\n";
    for (size_t i = 0; i < each.joint_names.size(); ++i)
      example += "  <joint name=\"" + each.joint_names[i] + "\" role=\"joint" + std::to_string(i + 1) + "\"/>\n";
    example += "</transmission>\n";
  }
  readme += fillIn(kReadmeText, {{"LIBRARY", library}, {"@sources@", sources}, {"@example@", example}});
  return {{"ros2_control.cpp", fillIn(kSourceText, {{"@includes@", includes},
                                                    {"@maps@", maps},
                                                    {"@exports@", exports},
                                                    {"LIBRARY", library},
                                                    {"ROBOT", robot}})},
          {"ros2_control_plugins.xml", "<library path=\"" + library + "\">\n" + plugins + "</library>\n"}};
}

}  // namespace bielle::firmware
