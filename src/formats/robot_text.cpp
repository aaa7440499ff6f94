#include "formats/robot_text.h"

#include <cmath>

#include "bielle/model/error.h"
#include "model/number_text.h"

namespace bielle {

std::string formatRobotNumber(double value, const char* format) {
  const std::string text = formatNumber(value, format);
  return text == "-0" ? "0" : text;
}

std::string formatRounded(double value) {
  constexpr double kWhole = 1e4;  // whose last digit is over 1e-12
  return formatRobotNumber(std::abs(value) < kWhole ? std::round(value * 1e12) / 1e12 : value, "%.15g");
}

std::string formatRounded(const Vector3d& v, const char* separator) {
  return formatRounded(v.x()) + separator + formatRounded(v.y()) + separator + formatRounded(v.z());
}

std::string formatExact(double value) { return formatNumber(value + 0.0, "%.17g"); }  // + 0.0: no negative zero

std::string formatExact(const Vector3d& v) {
  return formatExact(v.x()) + " " + formatExact(v.y()) + " " + formatExact(v.z());
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

void refuseToWrite(const Model& model, const std::string& element, const std::string& problem) {
  throw InputError(model.name(), element, problem + ", which its files cannot express", "change the model");
}

}  // namespace bielle
