#include "formats/robot_text.h"

#include <cmath>

#include "bielle/model/error.h"

namespace bielle {

std::string formatExact(const Vector3d& v, const char* separator) {
  return formatExact(v.x()) + separator + formatExact(v.y()) + separator + formatExact(v.z());
}

bool hasImpliedFreeFlyer(const Model& model) {
  const Joint& first = model.joints()[1];
  bool ground = false;  // any other element on the ground requires a separate link
  for (const Frame& frame : model.frames()) ground |= frame.body == 0 && frame.name != "world";
  for (const Visual& visual : model.visuals()) ground |= visual.body == 0;
  for (const Shape& shape : model.shapes()) ground |= shape.body == 0 && !shape.fitted;
  for (int i = 2; i < model.numBodies(); ++i) ground |= model.joints()[i].parent == 0;
  return !ground && model.hasFreeFlyer() && first.name == "root_joint" && first.X_PJ.p.isZero(0) &&
         first.X_PJ.R.isIdentity(0);
}

std::string findFrameName(const Model& model, int body, const SE3& X_BF, const std::string& made) {
  for (const Frame& frame : model.frames())
    if (frame.body == body && frame.X_BF.p == X_BF.p && frame.X_BF.R == X_BF.R) return frame.name;
  return made;
}

std::vector<std::pair<const char*, std::string>> getJointForceData(const WholeJointForce& whole) {
  const JointForce& force = whole.force;
  std::vector<std::pair<const char*, std::string>> data = {{"stiffness", formatExact(force.stiffness)}};
  const auto add = [&data](const char* key, double value) {
    if (value != 0) data.emplace_back(key, formatExact(value));
  };
  add("rest", force.rest);
  add("preload", force.preload);
  add("damping", force.damping);
  add("friction", force.friction);
  if (whole.sticks()) {
    add("stiction", whole.stiction);
    add("stribeck_speed", whole.stribeck_speed);
  }
  if (whole.stiction != 0) add("friction_speed", force.friction_speed);
  return data;
}

void refuseToWrite(const Model& model, const std::string& element, const std::string& problem) {
  throw InputError(model.name(), element, problem + ", which its files cannot express", "change the model");
}

}  // namespace bielle
