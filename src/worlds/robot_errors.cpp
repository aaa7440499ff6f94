#include "worlds/robot_errors.h"

#include <optional>
#include <random>

#include "bielle/dynamics/assembly.h"
#include "bielle/model/builder.h"
#include "control/passive_joints.h"
#include "worlds/contact_law.h"

namespace bielle::worlds {

Model makeMachine(const Model& model, const RobotErrors& errors) {
  if (!(errors.mass >= 0 && errors.mass < 1))
    throw InputError(model.name(), "masses",
                     "an error of " + std::to_string(errors.mass) + " can make them zero or negative",
                     "give 0 to less than 1");
  std::mt19937 generator(errors.seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  ModelParts parts = takeParts(model);
  for (Body& body : parts.bodies) {
    const double factor = 1 + errors.mass * uniform(generator);
    body.inertia.mass *= factor;
    body.inertia.I_com *= factor;
  }
  for (Closure& closure : parts.closures)
    for (int axis = 0; axis < 3; ++axis) closure.X_B1.p[axis] += errors.rod * uniform(generator);
  return ModelBuilder::restore(std::move(parts));
}

VectorXd assembleMachine(const Model& model, const Model& machine, ConstVectorRef q) {
  const AssemblyResult closed = closeConfiguration(machine, q);
  if (closed.status != NumericalStatus::Ok)
    throw InputError(machine.name(), closed.worst, "its loop cannot be closed: " + closed.message,
                     "allow smaller errors; loops with redundant rows allow no errors");
  std::optional<PassiveJoints> joints;
  try {
    joints.emplace(machine, closed.q);
  } catch (const InputError&) {
    // Motors do not determine all joints, such as rails: the nearest posture then.
  }
  VectorXd motors(machine.nu()), out = joints ? VectorXd(q) : closed.q;
  for (int m = 0; m < machine.nu(); ++m) motors[m] = q[machine.joints()[machine.motors()[m].joint].idx_q];
  if (joints && joints->update(motors, out) != NumericalStatus::Ok)
    throw InputError(machine.name(), "closures", "they cannot close at the motors' positions", "allow smaller errors");
  if (machine.hasFreeFlyer() && !machine.contacts().empty()) {
    Workspace planned(model), built(machine);
    out[2] += calcLeastHeight(model, planned, q) - calcLeastHeight(machine, built, out);
  }
  return out;
}

}  // namespace bielle::worlds
