// A model taken apart and put together again.
#include <cmath>

#include "bielle/model/builder.h"

namespace bielle {
namespace {

void require(bool ok, const ModelParts& parts, const std::string& element) {
  if (!ok)
    throw InputError("", "robot '" + parts.name + "'", "its " + element + " are inconsistent",
                     "take them from a model");
}

void checkParts(const ModelParts& parts) {
  const int bodies = static_cast<int>(parts.bodies.size());
  require(bodies > 1 && parts.joints.size() == parts.bodies.size(), parts, "bodies and joints");
  int nq = 0, nv = 0;
  for (int i = 0; i < bodies; ++i) {
    const Joint& joint = parts.joints[i];
    require(joint.idx_q == nq && joint.idx_v == nv && joint.nq == getNq(joint.kind) && joint.nv == getNv(joint.kind) &&
                (i == 0 ? joint.parent == -1 : joint.parent >= 0 && joint.parent < i),
            parts, "joints");
    nq += joint.nq;
    nv += joint.nv;
  }
  const auto isBody = [bodies](int body) { return body >= 0 && body < bodies; };
  for (const Frame& frame : parts.frames) require(isBody(frame.body), parts, "frames");
  const auto isCoordinate = [&](int joint, int idx_q, int dof) {
    return joint > 0 && joint < bodies && parts.joints[joint].nv == 1 && idx_q == parts.joints[joint].idx_q &&
           dof == parts.joints[joint].idx_v;
  };
  for (const Closure& c : parts.closures) {
    const bool coupler = c.kind == ClosureKind::Coupler;
    require(isBody(c.body1) && isBody(c.body2) && (c.body1 == c.body2) == coupler, parts, "closures");
    require(coupler ? c.terms.size() >= 2 : c.terms.empty(), parts, "couplers");
    for (const CouplerTerm& term : c.terms) require(isCoordinate(term.joint, term.idx_q, term.dof), parts, "couplers");
  }
  for (const JointForce& force : parts.joint_forces)
    require(isCoordinate(force.joint, force.idx_q, force.dof), parts, "joint forces");
  for (const PointSpring& spring : parts.point_springs)
    require(isBody(spring.body1) && isBody(spring.body2) && spring.body1 != spring.body2, parts, "point springs");
  for (const Motor& motor : parts.motors)
    require(motor.joint > 0 && motor.joint < bodies && motor.dof == parts.joints[motor.joint].idx_v &&
                parts.joints[motor.joint].nv == 1,
            parts, "motors");
  for (const ContactFrame& contact : parts.contacts) require(isBody(contact.body), parts, "contacts");
  for (const Visual& visual : parts.visuals) require(isBody(visual.body), parts, "visuals");
  for (const Shape& shape : parts.shapes) require(isBody(shape.body), parts, "shapes");
  for (int joint : parts.serial_joints) require(joint > 0 && joint < bodies, parts, "serial joints");
  for (const VectorXd* numbers : {&parts.lower_limits, &parts.upper_limits, &parts.velocity_limits, &parts.armature})
    require(numbers->size() == nv && nv > 0, parts, "limits");
}

}  // namespace

ModelParts takeParts(const Model& m) {
  return {m.name(),        m.gravity(),        m.bodies(),     m.joints(),      m.frames(),       m.closures(),
          m.motors(),      m.contacts(),       m.references(), m.visuals(),     m.serialJoints(), m.lowerLimits(),
          m.upperLimits(), m.velocityLimits(), m.armature(),   m.jointForces(), m.pointSprings(), m.shapes()};
}

Model ModelBuilder::restore(ModelParts parts) {
  checkParts(parts);
  ModelBuilder builder(parts.name);
  builder.limits_.resize(parts.bodies.size());
  Model& draft = builder.model_;
  draft.data_->gravity = parts.gravity;
  draft.data_->nq = parts.joints.back().idx_q + parts.joints.back().nq;
  draft.data_->nv = parts.joints.back().idx_v + parts.joints.back().nv;
  draft.data_->bodies = std::move(parts.bodies);
  draft.data_->joints = std::move(parts.joints);
  draft.data_->frames = std::move(parts.frames);
  draft.data_->closures = std::move(parts.closures);
  for (Closure& closure : draft.data_->closures) closure.dofs.clear(), closure.signs.clear();  // found again
  draft.data_->motors = std::move(parts.motors);
  draft.data_->joint_forces = std::move(parts.joint_forces);
  draft.data_->point_springs = std::move(parts.point_springs);
  for (PointSpring& spring : draft.data_->point_springs) spring.dofs.clear(), spring.signs.clear();  // found again
  draft.data_->contacts = std::move(parts.contacts);
  draft.data_->references = std::move(parts.references);
  draft.data_->visuals = std::move(parts.visuals);
  for (const Shape& shape : parts.shapes)
    if (!shape.fitted) draft.data_->shapes.push_back(shape);  // the others are fitted again
  draft.data_->serial_joints = std::move(parts.serial_joints);
  Model model = builder.build();
  model.data_->lower = std::move(parts.lower_limits);
  model.data_->upper = std::move(parts.upper_limits);
  model.data_->velocity_limit = std::move(parts.velocity_limits);
  model.data_->armature = std::move(parts.armature);
  return model;
}

}  // namespace bielle
