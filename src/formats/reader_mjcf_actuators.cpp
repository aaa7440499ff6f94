// Motors, and what MuJoCo cannot say of them.
#include <algorithm>
#include <cmath>
#include <limits>

#include "bielle/model/error.h"
#include "formats/mjcf.h"
#include "formats/motor_catalogue.h"
#include "formats/reader_mjcf.h"

namespace bielle {

// Joints that other elements name stay what they are.
void MjcfReader::listNamed() {
  const auto add = [this](const XMLElement& e) {
    for (const char* attribute : {"joint", "jointinparent", "joint1", "joint2"})
      named_.insert(getAttribute(&e, attribute));
  };
  for (const char* section : {"actuator", "equality"}) forEach(section, add);
  forEach("tendon", [&](const XMLElement& tendon) {
    for (const XMLElement* e : getChildren(tendon)) add(*e);
  });
  named_.erase("");
}

// The joint that an actuator drives, that of a tendon for one on the tendon; empty if it is left out.
std::string MjcfReader::findDriven(MjcfElement& e, double& gear) {
  static const std::set<std::string> servos = {"position", "velocity", "intvelocity", "damper", "general"};
  const auto leaveOut = [&](const std::string& problem) {
    e.leaveOut(problem);
    return std::string();
  };
  const std::vector<double> gears = e.getNumbers("gear", 1, 6);
  gear = gears.empty() ? 1 : gears[0];
  std::string joint = e.getText("joint", e.getText("jointinparent"));
  const auto tendon = tendons_.find(e.getText("tendon"));
  const bool is_motor = e.tag() == "motor" || servos.count(e.tag());
  if (joint.empty() && tendon != tendons_.end() && is_motor) {
    FixedTendon& on = tendon->second;
    if (on.rotor.empty() && on.coefficients.size() > 1) addRotor(on, tendon->first, e);
    if (!on.rotor.empty()) return on.rotor;
    on.is_used = true;
    joint = on.coefficients.begin()->first;
    gear *= on.coefficients.begin()->second;
  }
  if (joint.empty() || !is_motor)
    return leaveOut("the actuator is left out: motors can only drive joints, and fixed tendons of them");
  const auto slot = std::find_if(slots_.begin(), slots_.end(), [&](const Slot& s) { return s.joint == joint; });
  if (slot == slots_.end()) e.fail("there is no joint '" + joint + "'", "correct the name");
  if (slot->q_ref.size() != 1) return leaveOut("the actuator is left out: its joint has several coordinates");
  return joint;
}

void MjcfReader::readActuator(const XMLElement& element) {
  MjcfElement e(element, "", settings_);
  double gear = 1;
  const std::string joint = findDriven(e, gear);
  if (joint.empty()) return;
  for (const MotorSpec& other : yaml_.motors)
    if (other.joint == joint) return e.leaveOut("a second actuator of a joint is left out");
  if (gear == 0) return e.leaveOut("an actuator of gear 0 is left out");
  if (gear != 1) e.note("its input becomes the torque or force at its joint, not that before the gear");
  const bool is_general = e.tag() == "general";
  const bool is_ideal =
      e.tag() == "motor" || (is_general && e.getText("dyntype", "none") == "none" &&
                             e.getText("biastype", "none") == "none" && e.getText("gaintype", "fixed") == "fixed");
  if (!is_ideal) e.note("its servo is left out: it becomes an ideal torque motor");
  const std::vector<double> gains = is_general ? e.getNumbers("gainprm", 1, 10) : std::vector<double>();
  const double gain = gains.empty() ? 1 : std::abs(gains[0]);

  MotorSpec motor;
  motor.joint = joint;
  double effort = std::numeric_limits<double>::infinity();
  const auto limit = [&](const char* range, double factor) {
    const std::vector<double> values = e.getNumbers(range, 2, 2);
    if (values[0] != -values[1]) e.note(std::string("its ") + range + " is not symmetric: the smaller side is used");
    effort = std::min(effort, factor * std::min(std::abs(values[0]), std::abs(values[1])));
  };
  if (e.isLimited("forcelimited", "forcerange")) limit("forcerange", std::abs(gear));
  if (e.isLimited("ctrllimited", "ctrlrange")) {
    if (is_ideal)
      limit("ctrlrange", std::abs(gear) * gain);
    else
      e.find("ctrlrange");
  }
  if (const auto clamp = clamps_.find(joint); clamp != clamps_.end()) effort = std::min(effort, clamp->second);
  if (!(effort > 0)) {
    e.note("its limits allow no torque on one side; they are left out");
  } else if (std::isfinite(effort)) {
    motor.effort = effort;
  }
  yaml_.motors.push_back(motor);
  const std::string name = getAttribute(&element, "name");
  if (!name.empty() && name != joint) e.note("it is renamed after its joint");
}

void MjcfReader::readCustom(const XMLElement& element) {
  const std::string& path = settings_.files.getPath(element);
  const std::string name = getAttribute(&element, "name"),
                    joint = name.substr(std::min(name.size(), kMjcfMotorData.size()));
  if (getTag(element) == "numeric" && name.rfind(kMjcfInertia, 0) == 0)
    return readExactInertia(element, name.substr(kMjcfInertia.size()));
  const auto motor =
      std::find_if(yaml_.motors.begin(), yaml_.motors.end(), [&joint](const MotorSpec& m) { return m.joint == joint; });
  if (getTag(element) != "text" || name != kMjcfMotorData + joint || motor == yaml_.motors.end())
    return settings_.notes.add(path, "<custom> <" + getTag(element) + ">", element.GetLineNum(), "left out");
  const std::string lines_above(std::max(0, element.GetLineNum() - 1),
                                '\n');  // so that errors name the line of the file
  readYamlDocument(path, lines_above + "{'" + kMjcfMotorData + "': {" + getAttribute(&element, "data") + "}}",
                   [&](const YamlEntry& root) {
                     const std::optional<double> effort = motor->effort;
                     *motor = readMotorSpecs(root, path, nullptr).front();
                     motor->joint = joint;
                     motor->effort = effort;
                   });
}

}  // namespace bielle
