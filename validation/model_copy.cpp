#include "model_copy.h"

#include "bielle/model/builder.h"
#include "math/decompositions.h"

namespace bielle::validation {

Model copyModel(const Model& model, const ModelChanges& changes) {
  ModelBuilder builder(model.name());
  builder.setGravity(model.gravity());
  const auto link = [&model](int body) { return body == 0 ? std::string("world") : model.bodies()[body].name; };
  for (int i = 1; i < model.numBodies(); ++i) {
    Inertia inertia = model.bodies()[i].inertia;
    if (changes.inertia) changes.inertia(i, inertia);
    builder.addLink(link(i), link(model.joints()[i].parent), model.joints()[i], inertia);
  }
  for (int c = 0; c < static_cast<int>(model.closures().size()); ++c) {
    Closure closure = model.closures()[c];
    if (changes.closure) changes.closure(c, closure);
    builder.copyClosure(model, closure);
  }
  for (const JointForce& force : model.jointForces()) builder.addJointForce(model.joints()[force.joint].name, force);
  for (const PointSpring& spring : model.pointSprings()) builder.copyPointSpring(model, spring);
  for (const ContactFrame& contact : model.contacts()) {
    builder.addFrame(contact.name + "/frame", link(contact.body), contact.X_BF);
    builder.addContact(contact.name, contact.name + "/frame", contact.kind, contact.half_length, contact.half_width);
  }
  for (const Motor& motor : model.motors())
    builder.addMotor(motor.name, changes.armature_scale * motor.armature, motor.effort_limit, motor.velocity_limit,
                     motor.torque_loss);
  for (int i = 1; i < model.numBodies(); ++i) {
    const Joint& joint = model.joints()[i];
    if (joint.nv > 0 && model.findMotor(joint.name) < 0)
      builder.setArmature(joint.name, changes.armature_scale * model.armature()[joint.idx_v]);
  }
  return builder.build();
}

Model makeModelWithoutArmature(const Model& model, double least) {
  ModelChanges changes;
  changes.armature_scale = 0;
  changes.inertia = [least](int, Inertia& inertia) {
    const Eigen::SelfAdjointEigenSolver<Matrix3d> moments(inertia.I_com, Eigen::EigenvaluesOnly);
    if (moments.eigenvalues()[0] > least) return;
    Inertia ballast;
    ballast.mass = 0.01;
    ballast.I_com = 1e-4 * Matrix3d::Identity();
    inertia = inertia + ballast;
  };
  return copyModel(model, changes);
}

}  // namespace bielle::validation
