#include "worlds/robot_errors.h"

#include <algorithm>
#include <limits>
#include <random>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/model/builder.h"
#include "control/passive_joints.h"

namespace bielle::simulation {
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

void addLinks(const Model& model, const std::vector<Inertia>& inertias, ModelBuilder& builder) {
  const auto getLink = [&model](int body) { return body == 0 ? "world" : model.bodies()[body].name; };
  for (int i = 1; i < model.numBodies(); ++i) {
    const Joint& joint = model.joints()[i];
    const auto select = [&joint](const VectorXd& limits) { return VectorXd(limits.segment(joint.idx_v, joint.nv)); };
    builder.addLink(getLink(i), getLink(joint.parent), joint, inertias[i],
                    {select(model.lowerLimits()), select(model.upperLimits()), select(model.velocityLimits())});
    if (joint.nv == 1 && model.findMotor(joint.name) < 0)
      builder.setArmature(joint.name, model.armature()[joint.idx_v]);
  }
  for (const Frame& frame : model.frames())
    if (frame.name != getLink(frame.body)) builder.addFrame(frame.name, getLink(frame.body), frame.X_BF);
}

// The model with other inertias (per body) and frames 1 of closures moved by shifts in their bodies.
Model rebuild(const Model& model, const std::vector<Inertia>& inertias, const std::vector<Vector3d>& shifts) {
  ModelBuilder builder(model.name());
  builder.setGravity(model.gravity());
  addLinks(model, inertias, builder);
  const auto addFrame = [&](const std::string& name, int body, const SE3& X) {
    builder.addFrame(name, body == 0 ? "world" : model.bodies()[body].name, X);
    return name;
  };
  for (size_t c = 0; c < model.closures().size(); ++c) {
    Closure closure = model.closures()[c];
    closure.X_B1.p += shifts[c];
    builder.copyClosure(model, closure);
  }
  for (const Motor& motor : model.motors()) builder.addMotor(motor);
  for (const JointForce& force : model.jointForces()) builder.addJointForce(model.joints()[force.joint].name, force);
  for (const PointSpring& spring : model.pointSprings()) builder.copyPointSpring(model, spring);
  for (const ContactFrame& contact : model.contacts())
    builder.addContact(contact.name, addFrame(contact.name + "|contact", contact.body, contact.X_BF), contact.kind,
                       contact.half_length, contact.half_width);
  for (const Reference& reference : model.references()) builder.addReference(reference);
  for (int joint : model.serialJoints()) builder.addSerialJoint(model.joints()[joint].name);
  return builder.build();
}

}  // namespace

Model makeMachine(const Model& model, const RobotErrors& errors) {
  if (!(errors.mass >= 0 && errors.mass < 1))
    throw ModelError(model.name(), "masses",
                     "an error of " + std::to_string(errors.mass) + " can make them zero or negative",
                     "give 0 to less than 1");
  std::mt19937 generator(errors.seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::vector<Inertia> inertias;
  for (const Body& body : model.bodies()) {
    const double factor = 1 + errors.mass * uniform(generator);
    inertias.push_back({factor * body.inertia.mass, body.inertia.com, factor * body.inertia.I_com});
  }
  std::vector<Vector3d> shifts;
  for (size_t c = 0; c < model.closures().size(); ++c) {
    Vector3d& shift = shifts.emplace_back();
    for (int axis = 0; axis < 3; ++axis) shift[axis] = errors.rod * uniform(generator);
  }
  return rebuild(model, inertias, shifts);
}

VectorXd assembleMachine(const Model& model, const Model& machine, ConstVectorRef q) {
  const AssemblyResult closed = closeConfiguration(machine, q);
  if (closed.status != AssemblyStatus::Closed)
    throw ModelError(machine.name(), closed.worst, "its loop cannot be closed: " + closed.message,
                     "allow smaller errors; loops with redundant rows allow no errors");
  PassiveJoints joints(machine, closed.q);
  VectorXd motors(machine.nu()), out = q;
  for (int m = 0; m < machine.nu(); ++m) motors[m] = q[machine.joints()[machine.motors()[m].joint].idx_q];
  if (joints.update(motors, out) != ClosingStatus::Closed)
    throw ModelError(machine.name(), "closures", "they cannot close at the motors' positions", "allow smaller errors");
  if (machine.hasFreeFlyer() && !machine.contacts().empty())
    out[2] += calcLeastHeight(model, q) - calcLeastHeight(machine, out);
  return out;
}

}  // namespace bielle::simulation
