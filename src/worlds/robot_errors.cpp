#include "worlds/robot_errors.h"

#include <algorithm>
#include <limits>
#include <optional>
#include <random>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/model/builder.h"
#include "control/passive_joints.h"

namespace bielle::worlds {
namespace {

// Of the corners of all soles, m (world).
double calcLeastHeight(const Model& model, ConstVectorRef q) {
  Workspace ws(model);
  updatePlacements<double>(model, ws, q);
  double least = std::numeric_limits<double>::infinity();
  for (const ContactFrame& contact : model.contacts())
    for (double x : {-contact.half_length, contact.half_length})
      for (double y : {-contact.half_width, contact.half_width})
        least = std::min(least, ws.X_WB[contact.body].act(contact.X_BF.act(Vector3d(x, y, 0))).z());
  return least;
}

}  // namespace

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
  if (machine.hasFreeFlyer() && !machine.contacts().empty())
    out[2] += calcLeastHeight(model, q) - calcLeastHeight(machine, out);
  return out;
}

}  // namespace bielle::worlds
