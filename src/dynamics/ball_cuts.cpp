#include "bielle/dynamics/ball_cuts.h"

#include <algorithm>
#include <limits>
#include <tuple>

#include "bielle/dynamics/assembly.h"
#include "bielle/model/builder.h"
#include "model/ball_leaf.h"

namespace bielle {
namespace {

constexpr double kNoLimit = std::numeric_limits<double>::infinity();

// A body that becomes part of another one.
struct Merged {
  int into = -1;  // -1: it does not
  SE3 X_IB;       // its placement there
};

template <typename List, typename Test>
bool hasNone(const List& list, const Test& test) {
  return std::none_of(list.begin(), list.end(), test);
}

// Nothing would be lost with its joint.
bool isPlain(const Model& model, int leaf) {
  const Joint& joint = model.joints()[leaf];
  const auto of = [&joint](const VectorXd& numbers) { return numbers.segment(joint.idx_v, joint.nv); };
  const std::vector<int>& serial = model.serialJoints();
  return hasNone(model.contacts(), [leaf](const ContactFrame& contact) { return contact.body == leaf; }) &&
         std::find(serial.begin(), serial.end(), leaf) == serial.end() && of(model.armature()).isZero(0) &&
         (of(model.lowerLimits()).array() == -kNoLimit).all() && (of(model.upperLimits()).array() == kNoLimit).all() &&
         (of(model.velocityLimits()).array() == kNoLimit).all();
}

// Closes a loop at the joint of a leaf instead of the weld that holds it.
void moveCut(const Joint& joint, bool is_first, const SE3& X_IL, Closure& closure) {
  closure.kind = ClosureKind::Ball3D;
  const std::pair<int, SE3> far{joint.parent, joint.X_PJ};
  if (is_first) {
    std::tie(closure.body1, closure.X_B1) = far;
    closure.X_B2 = X_IL;
  } else {
    closure.X_B1 = X_IL;
    std::tie(closure.body2, closure.X_B2) = far;
  }
}

// What is fixed to merged bodies goes with them.
void moveAttachments(const std::vector<Merged>& merged, ModelParts& parts) {
  const auto move = [&merged](int& body, SE3& X) {
    const Merged& m = merged[body];
    if (m.into < 0) return;
    body = m.into;
    X = m.X_IB * X;
  };
  for (Frame& frame : parts.frames) move(frame.body, frame.X_BF);
  for (Visual& visual : parts.visuals) move(visual.body, visual.X_BV);
  for (Shape& shape : parts.shapes) move(shape.body, shape.X_BS);
  for (PointSpring& spring : parts.point_springs)
    for (const auto& [body, point] : {std::pair(&spring.body1, &spring.point1), {&spring.body2, &spring.point2}}) {
      const Merged& m = merged[*body];
      if (m.into < 0) continue;
      *body = m.into;
      *point = m.X_IB.act(*point);
    }
  const auto is_idle = [](const PointSpring& spring) { return spring.body1 == spring.body2; };
  std::vector<PointSpring>& springs = parts.point_springs;
  springs.erase(std::remove_if(springs.begin(), springs.end(), is_idle), springs.end());
}

// References give all joints but the base: what follows from closing the loops could be on another branch where they are cut
// elsewhere.
void completeReferences(const Model& model, ModelParts& parts) {
  for (Reference& reference : parts.references) {
    const AssemblyResult posture = assembleReference(model, reference.name);
    if (posture.status != NumericalStatus::Ok) continue;
    for (const Joint& joint : model.joints()) {
      if (joint.nq == 0 || joint.kind == JointKind::FreeFlyer) continue;
      const double* values = posture.q.data() + joint.idx_q;
      reference.joints[joint.name] = {values, values + joint.nq};
    }
  }
}

// Bodies that are part of others go, and numbers change.
void removeBodies(const std::vector<Merged>& merged, ModelParts& parts) {
  std::vector<int> number(parts.bodies.size(), -1), dofs;
  std::vector<Body> bodies;
  std::vector<Joint> joints;
  int nq = 0, nv = 0;
  for (size_t i = 0; i < parts.bodies.size(); ++i) {
    Joint joint = parts.joints[i];
    if (merged[i].into >= 0) {
      for (Reference& reference : parts.references) reference.joints.erase(joint.name);
      continue;
    }
    for (int k = 0; k < joint.nv; ++k) dofs.push_back(joint.idx_v + k);
    number[i] = static_cast<int>(bodies.size());
    if (joint.parent >= 0) joint.parent = number[joint.parent];
    joint.idx_q = nq, joint.idx_v = nv;
    nq += joint.nq, nv += joint.nv;
    bodies.push_back(parts.bodies[i]);
    joints.push_back(std::move(joint));
  }
  const auto renumber = [&](int& body) { body = number[body]; };
  const auto place = [&](int& joint, int& idx_q, int& dof) {
    renumber(joint);
    idx_q = joints[joint].idx_q;
    dof = joints[joint].idx_v;
  };
  for (Frame& frame : parts.frames) renumber(frame.body);
  for (Visual& visual : parts.visuals) renumber(visual.body);
  for (Shape& shape : parts.shapes) renumber(shape.body);
  for (ContactFrame& contact : parts.contacts) renumber(contact.body);
  for (PointSpring& spring : parts.point_springs) renumber(spring.body1), renumber(spring.body2);
  for (int& joint : parts.serial_joints) renumber(joint);
  for (Closure& closure : parts.closures) {
    renumber(closure.body1), renumber(closure.body2);
    for (CouplerTerm& term : closure.terms) place(term.joint, term.idx_q, term.dof);
  }
  for (JointForce& force : parts.joint_forces) place(force.joint, force.idx_q, force.dof);
  for (Motor& motor : parts.motors) {
    renumber(motor.joint);
    motor.dof = joints[motor.joint].idx_v;
  }
  for (VectorXd* numbers : {&parts.lower_limits, &parts.upper_limits, &parts.velocity_limits, &parts.armature})
    *numbers = VectorXd((*numbers)(dofs));
  parts.bodies = std::move(bodies);
  parts.joints = std::move(joints);
}

}  // namespace

Model cutAtBalls(const Model& model) {
  std::vector<Merged> merged(model.bodies().size());
  std::vector<int> leaves;
  ModelParts parts = takeParts(model);
  for (Closure& closure : parts.closures) {
    const int leaf = findBallLeaf(model, model.closures(), closure, leaves);
    if (leaf < 0 || !isPlain(model, leaf)) continue;
    const bool is_first = closure.body1 == leaf;
    const int into = is_first ? closure.body2 : closure.body1;
    const SE3 X_IL = is_first ? closure.X_B2 * closure.X_B1.inverse() : closure.X_B1 * closure.X_B2.inverse();
    leaves.push_back(leaf);
    merged[leaf] = {into, X_IL};
    Inertia& whole = parts.bodies[into].inertia;
    whole = whole + model.bodies()[leaf].inertia.transformed(X_IL);
    moveCut(model.joints()[leaf], is_first, X_IL, closure);
  }
  if (leaves.empty()) return model;
  completeReferences(model, parts);
  moveAttachments(merged, parts);
  removeBodies(merged, parts);
  return ModelBuilder::restore(std::move(parts));
}

}  // namespace bielle
