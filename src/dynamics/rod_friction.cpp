#include "dynamics/rod_friction.h"

#include <algorithm>

#include "bielle/model/error.h"

namespace bielle {
namespace {

[[noreturn]] void refuse(const RodFriction& law, const std::string& problem, const std::string& remedy) {
  throw InputError("", "friction of closure '" + law.closure + "'", problem, remedy);
}

void requireNumbers(const RodFriction& law) {
  const auto require = [&](bool holds, const char* problem, const char* remedy) {
    if (!holds) refuse(law, problem, remedy);
  };
  for (const double value : {law.coefficient, law.radius, law.friction_speed, law.stiction, law.stribeck_speed})
    require(std::isfinite(value), "a number is not finite", "correct it");
  require(law.coefficient >= 0, "its coefficient is negative", "give the friction over the force, e.g. 0.1");
  require(law.radius > 0, "its radius is not positive", "give that of the ball or pin, m");
  require(law.friction_speed > 0, "its friction_speed is not positive",
          "give the speed below which friction acts like a damper, rad/s");
  require(law.stiction == 0 || law.stiction >= law.coefficient, "its stiction is less than the coefficient of sliding",
          "give the friction at rest over the force");
  require(!(law.stiction > law.coefficient) || law.stribeck_speed > law.friction_speed,
          "its stribeck_speed is not above the friction_speed",
          "give the speed at which friction has fallen to that of sliding, rad/s");
}

RodBearing makeBearing(const Model& model, const RodFriction& law) {
  requireNumbers(law);
  const auto& closures = model.closures();
  const auto at =
      std::find_if(closures.begin(), closures.end(), [&law](const Closure& c) { return c.name == law.closure; });
  if (at == closures.end()) refuse(law, "there is no such closure", "`bielle info` lists them");
  RodBearing bearing{static_cast<int>(at - closures.begin()), law, {}};
  if (at->kind == ClosureKind::Ball3D || at->kind == ClosureKind::Hinge5D) {
    bearing.pivots.emplace_back();
    for (size_t k = 0; k < at->dofs.size(); ++k) bearing.pivots.back().emplace_back(at->dofs[k], at->signs[k]);
  } else if (at->kind != ClosureKind::Weld6D) {
    refuse(law, std::string("it is a ") + getName(at->kind) + ", which has no pivot",
           "give the rod a body, with a ball or a hinge at its end");
  } else if (law.joints.empty()) {
    refuse(law, "nothing turns in a weld", "name the joints at the ends of the rod: `joints: [...]`");
  }
  for (const std::string& name : law.joints) {
    const int index = model.findJoint(name);
    if (index < 0) refuse(law, "there is no joint '" + name + "'", "`bielle info` lists them");
    const Joint& joint = model.joints()[static_cast<size_t>(index)];
    if (std::find(at->dofs.begin(), at->dofs.end(), joint.idx_v) == at->dofs.end())
      refuse(law, "joint '" + name + "' is not in its loop", "name joints at the ends of the rod");
    if (joint.kind == JointKind::Prismatic) refuse(law, "joint '" + name + "' does not turn", "name a pivot");
    bearing.pivots.emplace_back();
    for (int k = 0; k < joint.nv; ++k) bearing.pivots.back().emplace_back(joint.idx_v + k, 1);
  }
  return bearing;
}

}  // namespace

std::vector<RodBearing> makeRodBearings(const Model& model, const std::vector<RodFriction>& frictions) {
  std::vector<RodBearing> bearings;
  for (const RodFriction& law : frictions) {
    for (const RodBearing& other : bearings)
      if (other.law.closure == law.closure) refuse(law, "it is given twice", "give it once");
    bearings.push_back(makeBearing(model, law));
  }
  return bearings;
}

}  // namespace bielle
