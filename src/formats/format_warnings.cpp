#include "formats/format_warnings.h"

#include <cmath>

#include "model/number_text.h"

namespace bielle {

void FormatWarnings::add(const std::string& element, const std::string& problem) {
  warnings_.push_back(model_.name() + ": " + element + ": " + problem);
}

void FormatWarnings::addYamlOnly(MotorData written) {
  if (!model_.serialJoints().empty()) add("serial joints", "they are left out");
  for (const Joint& joint : model_.joints())
    if (joint.position_importance != 1 || joint.velocity_importance != 1)
      add("joint '" + joint.name + "'", "its importance is left out");
  if (written == MotorData::All) return;
  const std::string consequence = ", so electrical energies change: without them a loss of " +
                                  formatNumber(kDefaultTorqueLoss) + " W/(N m)^2 is assumed";
  for (const Motor& motor : model_.motors()) {
    MotorDrive drive = motor.drive;
    if (written == MotorData::Gears) drive.ratio = 1, drive.rotor_inertia = 0;
    if (drive.isGiven() || std::isfinite(motor.continuous_effort))
      add("motor '" + motor.name + "'",
          (written == MotorData::Gears ? "its winding and the losses of its gear are left out"
                                       : "its winding and gear are left out") +
              consequence);
    else if (motor.torque_loss)
      add("motor '" + motor.name + "'", "its torque_loss is left out" + consequence);
  }
}

void FormatWarnings::addArmature(bool of_motors) {
  std::string armatures;
  for (int i = 1; i < model_.numBodies(); ++i)
    if (const Joint& joint = model_.joints()[i];
        joint.nv > 0 && model_.armature()[joint.idx_v] != 0 && (of_motors || model_.findMotor(joint.name) < 0))
      armatures += (armatures.empty() ? "'" : ", '") + joint.name + "'";
  if (!armatures.empty()) add("joints " + armatures, "their armature is left out");
}

void FormatWarnings::addBeyondTree() {
  addArmature(true);
  if (!model_.motors().empty()) add("motors", "their assignment to joints is left out");
  for (const PointSpring& spring : model_.pointSprings()) add("point spring '" + spring.name + "'", "it is left out");
  addTargets();
}

void FormatWarnings::addTargets() {
  for (const ContactFrame& contact : model_.contacts()) add("contact '" + contact.name + "'", "it is left out");
  for (const Reference& reference : model_.references()) add("reference '" + reference.name + "'", "it is left out");
  if (model_.gravity() != Vector3d(0, 0, -9.81)) add("gravity", "it is left out");
}

}  // namespace bielle
