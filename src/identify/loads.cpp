#include "identify/loads.h"

#include <algorithm>

#include "bielle/model/builder.h"
#include "identify/geometry.h"

namespace bielle {

const char* getName(LoadKind kind) {
  switch (kind) {
    case LoadKind::Mass:
      return "mass";
    case LoadKind::Com:
      return "com";
    case LoadKind::Armature:
      return "armature";
    case LoadKind::Damping:
      return "damping";
    case LoadKind::Friction:
      return "friction";
  }
  return "?";
}

JointForce getJointForce(const Model& model, int joint) {
  for (const JointForce& force : model.jointForces())
    if (force.joint == joint) return force;
  JointForce none;
  const Joint& at = model.joints()[static_cast<size_t>(joint)];
  none.joint = joint, none.idx_q = at.idx_q, none.dof = at.idx_v;
  return none;
}

// Without what is more at rest.
double getSlidingFriction(const Model& model, int joint) {
  double sum = 0;
  for (const JointForce& force : model.jointForces()) sum += force.joint == joint ? force.friction : 0;
  return sum;
}

std::vector<LoadNumber> listLoads(const Model& model) {
  std::vector<LoadNumber> numbers;
  const std::vector<int> group = groupBodies(model);
  const auto getMass = [&model](int body) { return model.bodies()[static_cast<size_t>(body)].inertia.mass; };
  for (int first = 1; first < model.numBodies(); ++first) {
    LoadNumber mass{LoadKind::Mass, model.bodies()[static_cast<size_t>(first)].name + ".mass", "kg"};
    for (int body = first; body < model.numBodies(); ++body)
      if (group[static_cast<size_t>(body)] == first && getMass(body) > 0)
        mass.bodies.push_back(body), mass.value += getMass(body);
    if (mass.value > 0) numbers.push_back(mass);
    if (!(getMass(first) > 0)) continue;
    const Body& body = model.bodies()[static_cast<size_t>(first)];
    for (int k = 0; k < 3; ++k)
      numbers.push_back({LoadKind::Com, body.name + ".com." + "xyz"[k], "m", body.inertia.com[k], {first}, k});
  }
  for (int m = 0; m < model.nu(); ++m) {
    const Motor& motor = model.motors()[static_cast<size_t>(m)];
    const JointForce force = getJointForce(model, motor.joint);
    const bool slides = model.joints()[static_cast<size_t>(motor.joint)].kind == JointKind::Prismatic;
    const auto add = [&](LoadKind kind, const char* unit, double value) {
      numbers.push_back({kind, motor.name + "." + getName(kind), unit, value, {}, 0, m});
    };
    add(LoadKind::Armature, slides ? "kg" : "kg m^2", motor.armature);
    add(LoadKind::Damping, slides ? "N s/m" : "N m s/rad", force.damping);
    add(LoadKind::Friction, slides ? "N" : "N m", getSlidingFriction(model, motor.joint));
  }
  return numbers;
}

Model changeLoads(const Model& model, const std::vector<LoadNumber>& numbers, ConstVectorRef changes) {
  ModelParts parts = takeParts(model);
  for (size_t i = 0; i < numbers.size(); ++i) {
    const LoadNumber& number = numbers[i];
    const double change = changes[static_cast<Eigen::Index>(i)];
    if (change == 0) continue;
    if (number.kind == LoadKind::Mass) {
      const double factor = std::max(1 + change / number.value, kShareOfMassLeft);
      for (const int body : number.bodies) {
        Inertia& inertia = parts.bodies[static_cast<size_t>(body)].inertia;
        inertia.mass *= factor, inertia.I_com *= factor;
      }
      continue;
    }
    if (number.kind == LoadKind::Com) {
      parts.bodies[static_cast<size_t>(number.bodies.front())].inertia.com[number.axis] += change;
      continue;
    }
    Motor& motor = parts.motors[static_cast<size_t>(number.motor)];
    const double value = std::max(0.0, number.value + change);
    if (number.kind == LoadKind::Armature) {
      motor.armature = parts.armature[motor.dof] = value;
      continue;
    }
    const auto is_own = [&motor](const JointForce& force) { return force.joint == motor.joint; };
    auto force = std::find_if(parts.joint_forces.begin(), parts.joint_forces.end(), is_own);
    if (force == parts.joint_forces.end()) force = parts.joint_forces.insert(force, getJointForce(model, motor.joint));
    // The friction of sliding: what is more at rest stays as it is.
    double& own = number.kind == LoadKind::Damping ? force->damping : force->friction;
    own = value + (own - number.value);
  }
  return ModelBuilder::restore(std::move(parts));
}

}  // namespace bielle
