#include "design/motor_change.h"

#include <fnmatch.h>

#include <algorithm>
#include <cmath>

namespace bielle {

std::vector<int> findMotors(const Model& model, const std::vector<std::string>& names,
                            std::vector<std::string>* unknown) {
  std::vector<bool> found(static_cast<size_t>(model.nu()), false);
  for (const std::string& name : names) {
    bool any = false;
    for (size_t m = 0; m < found.size(); ++m) {
      if (fnmatch(name.c_str(), model.motors()[m].name.c_str(), FNM_NOESCAPE) != 0) continue;
      found[m] = any = true;
    }
    if (!any && unknown) unknown->push_back(name);
  }
  std::vector<int> motors;
  for (size_t m = 0; m < found.size(); ++m)
    if (found[m]) motors.push_back(static_cast<int>(m));
  return motors;
}

void setType(const Motor& type, Motor& motor) {
  const Motor old = motor;
  motor = type;
  motor.name = old.name, motor.joint = old.joint, motor.dof = old.dof;
  if (!old.drive.type.empty()) return;
  motor.drive.efficiency *= old.drive.efficiency;
  motor.drive.back_efficiency *= old.drive.back_efficiency;
}

double setRatio(double ratio, const GearCost& cost, Motor& motor) {
  const double factor = ratio / motor.drive.ratio;
  double mass = 0;
  if (factor > 1 && motor.drive.hasWinding()) {
    const double efficiency = 1 - cost.loss * (1 - 1 / factor);
    const double effort = std::min(motor.effort_limit, motor.drive.efficiency * motor.drive.ratio *
                                                           motor.drive.torque_constant * motor.drive.current);
    if (std::isfinite(effort)) mass = cost.mass_per_effort * (factor - 1) * effort;
    motor.drive.efficiency *= efficiency;
    motor.drive.back_efficiency *= efficiency;
    motor.effort_limit *= efficiency;
  }
  motor.drive.ratio = ratio;
  motor.armature *= factor * factor;
  motor.effort_limit *= factor;
  motor.continuous_effort *= factor;
  motor.velocity_limit /= factor;
  if (motor.torque_loss) *motor.torque_loss /= factor * factor;
  return mass;
}

}  // namespace bielle
