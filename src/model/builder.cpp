#include "bielle/model/builder.h"

#include <algorithm>
#include <cmath>

#include "math/decompositions.h"
#include "model/number_text.h"

namespace bielle {
namespace {

// kg, m, kg m^2: far beyond any robot, and far below what overflows in products of a few such numbers.
constexpr double kBeyondRobots = 1e12;

}  // namespace

ModelBuilder::ModelBuilder(std::string name, std::string source) : source_(std::move(source)) {
  model_.data_->name = std::move(name);
  Joint world;
  world.name = "world";
  world.parent = -1;
  model_.data_->joints.push_back(world);
  model_.data_->bodies.push_back({"world", {}});
  model_.data_->frames.push_back({"world", 0, {}});
  frames_["world"] = {0, {}};
  limits_.push_back({});
}

void ModelBuilder::fail(const std::string& element, const std::string& problem, const std::string& remedy) const {
  throw InputError(source_, element, problem, remedy);
}

ModelBuilder::FramePlace ModelBuilder::getFrame(const std::string& name, const std::string& element) const {
  const auto it = frames_.find(name);
  if (it == frames_.end())
    fail(element, "there is no link or frame '" + name + "'", "check the spelling, or declare the link first");
  return it->second;
}

void ModelBuilder::addLink(const std::string& link, const std::string& parent_link, Joint joint, const Inertia& inertia,
                           const JointLimits& limits) {
  const std::string element = "joint '" + joint.name + "'";
  if (link.empty()) fail(element, "its child link has no name", "name it");
  if (frames_.count(link))
    fail("link '" + link + "'", "it is declared twice", "give every link and frame a unique name");
  const FramePlace parent = getFrame(parent_link, element);
  if (!(joint.X_PJ.p.cwiseAbs().maxCoeff() <= kBeyondRobots))
    fail(element, "its origin is not within " + formatNumber(kBeyondRobots) + " m of its parent link",
         "correct its <origin>, in m");
  if (joint.kind == JointKind::Fixed) {
    const SE3 X_BF = parent.X_BF * joint.X_PJ;
    frames_[link] = {parent.body, X_BF};
    model_.data_->frames.push_back({link, parent.body, X_BF});
    addInertia(link, inertia);
    return;
  }
  for (const Joint& other : model_.joints())
    if (other.name == joint.name) fail(element, "two joints have this name", "rename one of them");
  for (Vector3d* axis : {&joint.axis, &joint.axis2}) {
    const double norm = axis->norm();
    if (!(norm > 1e-12) || !std::isfinite(norm)) fail(element, "its axis is not a direction", "give a non-zero vector");
    if (std::abs(axis->squaredNorm() - 1) > 1e-15) *axis /= norm;  // so that what is written is read back
  }
  if (joint.kind == JointKind::Universal && joint.axis.cross(joint.axis2).norm() < 1e-6)
    fail(element, "the two axes of a universal joint are parallel", "give two different axes");
  joint.parent = parent.body;
  joint.X_PJ = parent.X_BF * joint.X_PJ;
  joint.nq = getNq(joint.kind);
  joint.nv = getNv(joint.kind);
  joint.idx_q = model_.nq();
  joint.idx_v = model_.nv();
  model_.data_->nq += joint.nq;
  model_.data_->nv += joint.nv;
  for (const VectorXd* bound : {&limits.lower, &limits.upper, &limits.velocity})
    if (bound->size() != 0 && bound->size() != joint.nv)
      fail(
          element,
          "its limits have " + std::to_string(bound->size()) + " entries, its velocity has " + std::to_string(joint.nv),
          "give one limit per velocity coordinate, or none");
  const int body = model_.numBodies();
  model_.data_->joints.push_back(joint);
  model_.data_->bodies.push_back({link, {}});
  model_.data_->frames.push_back({link, body, {}});
  frames_[link] = {body, {}};
  limits_.push_back(limits);
  addInertia(link, inertia);
}

void ModelBuilder::addInertia(const std::string& link, const Inertia& inertia) {
  const FramePlace place = getFrame(link, "link '" + link + "'");
  link_inertias_.emplace_back(link, inertia);
  if (place.body == 0) return;  // the ground has no dynamics
  Body& body = model_.data_->bodies[place.body];
  body.inertia = body.inertia + inertia.transformed(place.X_BF);
}

void ModelBuilder::addFrame(const std::string& name, const std::string& link, const SE3& X_LF) {
  if (frames_.count(name))
    fail("frame '" + name + "'", "it is declared twice", "give every link and frame a unique name");
  const FramePlace place = getFrame(link, "frame '" + name + "'");
  frames_[name] = {place.body, place.X_BF * X_LF};
  model_.data_->frames.push_back({name, place.body, place.X_BF * X_LF});
}

void ModelBuilder::addMotor(const std::string& joint, double armature, double effort_limit, double velocity_limit,
                            std::optional<double> torque_loss) {
  addMotor({joint, 0, 0, armature, effort_limit, velocity_limit, torque_loss});
}

void ModelBuilder::addMotor(Motor motor) {
  const std::string element = "motor '" + motor.name + "'";
  motor.joint = model_.findJoint(motor.name);
  if (motor.joint < 0)
    fail(element, "there is no moving joint of this name", "name a joint of the robot that is not fixed");
  const Joint& j = model_.joints()[motor.joint];
  if (j.nv != 1)
    fail(element, "it is on a " + std::string(getName(j.kind)) + " joint of " + std::to_string(j.nv) + " coordinates",
         "motors drive revolute, continuous or prismatic joints");
  motor.dof = j.idx_v;
  if (model_.findMotor(motor.name) >= 0) fail(element, "the joint has two motors", "list it once");
  if (!(motor.armature >= 0) || std::isinf(motor.armature))
    fail(element, "its armature is not a finite number of 0 or more", "give a rotor inertia");
  if (!(motor.effort_limit > 0)) fail(element, "its effort limit is not positive", "give a positive limit or none");
  if (!(motor.velocity_limit > 0)) fail(element, "its velocity limit is not positive", "give a positive limit or none");
  if (motor.torque_loss && !(*motor.torque_loss >= 0 && std::isfinite(*motor.torque_loss)))
    fail(element, "its torque_loss is not a finite number of 0 or more", "give W/(N m)^2, or leave it out");
  if (!(motor.continuous_effort > 0))
    fail(element, "its continuous effort is not positive",
         "give the effort it can sustain indefinitely, or leave it out");
  applyDrive(element, motor);
  model_.data_->motors.push_back(std::move(motor));
}

void ModelBuilder::applyDrive(const std::string& element, Motor& motor) const {
  const MotorDrive& drive = motor.drive;
  for (double value : {drive.rotor_inertia, drive.torque_constant, drive.resistance, drive.mass})
    if (!(value >= 0) || std::isinf(value))
      fail(element, "its rotor_inertia, torque_constant, resistance or mass is not a finite number of 0 or more",
           "give it in kg m^2, N m/A, ohm or kg, or leave it out");
  if (!(drive.ratio > 0) || std::isinf(drive.ratio))
    fail(element, "its ratio is not positive", "give turns of the rotor per turn of the joint");
  for (double value : {drive.voltage, drive.current, drive.continuous_current})
    if (!(value > 0)) fail(element, "its voltage or a current is not positive", "give V and A, or leave them out");
  for (double value : {drive.efficiency, drive.back_efficiency})
    if (!(value > 0 && value <= 1)) fail(element, "an efficiency is outside 0 .. 1", "give a share, e.g. 0.9");
  if (motor.armature == 0) motor.armature = drive.ratio * drive.ratio * drive.rotor_inertia;
  if (!drive.hasWinding()) {
    if (drive.resistance > 0 || std::isfinite(std::min({drive.voltage, drive.current, drive.continuous_current})))
      fail(element, "its resistance, voltage or currents have no meaning without its torque constant",
           "add torque_constant, N m/A");
    return;
  }
  const double torque = drive.ratio * drive.torque_constant;  // of an ampere, N m
  motor.effort_limit = std::min(motor.effort_limit, drive.efficiency * torque * drive.current);
  motor.velocity_limit = std::min(motor.velocity_limit, drive.voltage / torque);
  motor.continuous_effort = std::min(motor.continuous_effort, torque * drive.continuous_current);
  if (drive.resistance > 0 && !motor.torque_loss) motor.torque_loss = drive.resistance / (torque * torque);
}

void ModelBuilder::addJointForce(const std::string& joint, JointForce force) {
  const std::string element = "force on joint '" + joint + "'";
  const int index = model_.findJoint(joint);
  if (index < 0) fail(element, "there is no moving joint of this name", "name a joint of the robot that is not fixed");
  const Joint& j = model_.joints()[index];
  if (j.nv != 1)
    fail(element, "it is a " + std::string(getName(j.kind)) + " joint of " + std::to_string(j.nv) + " coordinates",
         "springs, dampers and friction act on revolute, continuous or prismatic joints");
  // A second one is what the friction of the first loses with speed (model/stiction.h), and nothing else.
  const JointForce* whole = nullptr;
  for (const JointForce& other : model_.jointForces()) {
    if (other.joint != index) continue;
    if (whole || !(force.friction < 0)) fail(element, "it is declared twice", "add its forces up");
    whole = &other;
  }
  const bool falls = whole && force.stiffness == 0 && force.preload == 0 && force.damping == 0;
  if (falls && !(-force.friction <= whole->friction && force.friction_speed > whole->friction_speed))
    fail(element, "its friction falls below zero, or at less than its friction_speed",
         "give a stiction of at least the friction, and a stribeck_speed above the friction_speed");
  for (double value : {force.stiffness, force.damping, falls ? 0 : force.friction})
    if (!(value >= 0) || std::isinf(value))
      fail(element, "its stiffness, damping or friction is not a finite number of 0 or more", "correct it");
  if (!std::isfinite(force.rest) || !std::isfinite(force.preload))
    fail(element, "its rest or preload is not finite", "correct it");
  if (!(force.friction_speed > 0) || std::isinf(force.friction_speed))
    fail(element, "its friction_speed is not positive", "give the speed below which friction acts like a damper");
  if (force.stiffness == 0 && force.preload == 0 && force.damping == 0 && force.friction == 0) return;
  force.joint = index;
  force.idx_q = j.idx_q;
  force.dof = j.idx_v;
  model_.data_->joint_forces.push_back(force);
}

void ModelBuilder::addPointSpring(const std::string& frame1, const std::string& frame2, PointSpring spring) {
  const std::string element = "point spring '" + spring.name + "'";
  for (const PointSpring& other : model_.pointSprings())
    if (other.name == spring.name) fail(element, "two of them have this name", "rename one of them");
  const FramePlace f1 = getFrame(frame1, element), f2 = getFrame(frame2, element);
  if (f1.body == f2.body)
    fail(element, "frames '" + frame1 + "' and '" + frame2 + "' are on the same rigid body, where it has no effect",
         "name frames of two bodies, or remove it");
  if (!spring.point1.allFinite() || !spring.point2.allFinite())
    fail(element, "a point is not finite", "give three numbers in metres");
  for (double value : {spring.stiffness, spring.rest, spring.damping})
    if (!(value >= 0) || std::isinf(value))
      fail(element, "its stiffness, rest or damping is not a finite number of 0 or more",
           "give N/m, m and N s/m (a preload may be negative)");
  if (!std::isfinite(spring.preload)) fail(element, "its preload is not finite", "give N");
  spring.body1 = f1.body;
  spring.body2 = f2.body;
  spring.point1 = f1.X_BF.act(spring.point1);
  spring.point2 = f2.X_BF.act(spring.point2);
  model_.data_->point_springs.push_back(std::move(spring));
}

void ModelBuilder::copyPointSpring(const Model& from, const PointSpring& spring) {
  const auto link = [&from](int body) { return body == 0 ? "world" : from.bodies()[body].name; };
  addPointSpring(link(spring.body1), link(spring.body2), spring);
}

void ModelBuilder::addContact(const std::string& name, const std::string& frame, ContactKind kind, double half_length,
                              double half_width) {
  const std::string element = "contact '" + name + "'";
  if (model_.findContact(name) >= 0) fail(element, "it is declared twice", "rename one of them");
  const FramePlace place = getFrame(frame, element);
  if (!(half_length >= 0) || !(half_width >= 0) || !std::isfinite(half_length + half_width))
    fail(element, "its sole is not given by two sizes of 0 or more", "give length and width in metres");
  if (kind == ContactKind::Edge5D && !(half_length > 0 && half_width == 0))
    fail(element, "an edge needs a length, and has no width", "give its length in metres, along x of its frame");
  model_.data_->contacts.push_back({name, place.body, place.X_BF, kind, half_length, half_width});
}

void ModelBuilder::addReference(Reference reference) {
  checkReference(reference);
  model_.data_->references.push_back(std::move(reference));
}

void ModelBuilder::checkReference(const Reference& reference) const {
  const std::string element = "reference '" + reference.name + "'";
  for (const Reference& other : model_.references())
    if (other.name == reference.name) fail(element, "two references have this name", "rename one of them");
  for (const auto& [name, q] : reference.joints) {
    const int index = model_.findJoint(name);
    if (index < 0) fail(element, "there is no moving joint '" + name + "'", "correct the name");
    const Joint& joint = model_.joints()[index];
    const Eigen::Map<const VectorXd> values(q.data(), static_cast<Eigen::Index>(q.size()));
    if (values.size() != joint.nq)
      fail(element,
           "it gives " + std::to_string(q.size()) + " value(s) to joint '" + name + "', a " + getName(joint.kind) +
               " joint of " + std::to_string(joint.nq),
           "give that many");
    if (!values.allFinite()) fail(element, "joint '" + name + "' has a value that is not finite", "correct it");
    const bool has_quaternion = joint.kind == JointKind::Spherical || joint.kind == JointKind::FreeFlyer;
    if (has_quaternion && std::abs(values.tail<4>().norm() - 1) > 1e-3)
      fail(element, "the quaternion (x y z w) of joint '" + name + "' is not of unit length", "normalise it");
  }
  for (const auto& [contact, position] : reference.feet) {
    if (model_.findContact(contact) < 0) fail(element, "there is no contact '" + contact + "'", "correct the name");
    if (!position.allFinite()) fail(element, "the place of contact '" + contact + "' is not finite", "correct it");
  }
  for (const auto& [contact, yaw] : reference.yaws) {
    if (!reference.feet.count(contact))
      fail(element, "it gives a yaw to contact '" + contact + "', but no place", "give both");
    if (!std::isfinite(yaw)) fail(element, "the yaw of contact '" + contact + "' is not finite", "correct it");
  }
  if (reference.height_frame.empty()) return;
  getFrame(reference.height_frame, element);
  if (!std::isfinite(reference.height)) fail(element, "its height is not finite", "give a height in metres");
}

void ModelBuilder::addVisual(const std::string& link, Visual visual) {
  const FramePlace place = getFrame(link, "visual of link '" + link + "'");
  visual.body = place.body;
  visual.X_BV = place.X_BF * visual.X_BV;
  model_.data_->visuals.push_back(std::move(visual));
}

void ModelBuilder::addShape(const std::string& link, Shape shape) {
  if (shape.fitted) return;
  const std::string element = "shape of link '" + link + "'";
  const FramePlace place = getFrame(link, element);
  if (!shape.half.allFinite() || !(shape.half.minCoeff() >= 0) || !std::isfinite(shape.radius) || !(shape.radius >= 0))
    fail(element, "a size is negative or not finite", "give lengths of 0 or more, m");
  shape.body = place.body;
  shape.X_BS = place.X_BF * shape.X_BS;
  model_.data_->shapes.push_back(shape);
}

void ModelBuilder::addSerialJoint(const std::string& joint) {
  const int index = model_.findJoint(joint);
  if (index < 0)
    fail("serial joint '" + joint + "'", "there is no moving joint of this name",
         "name a joint of the robot that is not fixed");
  const std::vector<int>& listed = model_.data_->serial_joints;
  if (std::find(listed.begin(), listed.end(), index) != listed.end())
    fail("serial joint '" + joint + "'", "it is listed twice", "list it once");
  model_.data_->serial_joints.push_back(index);
}

void ModelBuilder::setGravity(const Vector3d& gravity) {
  if (!gravity.allFinite()) fail("gravity", "it is not finite", "give three numbers in m/s^2");
  model_.data_->gravity = gravity;
}

void ModelBuilder::setArmature(const std::string& joint, double armature) {
  if (model_.findJoint(joint) < 0)
    fail("armature of '" + joint + "'", "there is no moving joint of this name",
         "name a joint of the robot that is not fixed");
  if (!(armature >= 0) || std::isinf(armature))
    fail("armature of '" + joint + "'", "it is not a finite number of 0 or more", "give a rotor inertia");
  joint_armature_[joint] = armature;
}

Model ModelBuilder::build(std::vector<std::string>* warnings) const {
  if (model_.nv() == 0) fail("robot '" + model_.data_->name + "'", "it has no moving joints", "declare at least one");
  checkInertias(warnings);
  Model model;
  *model.data_ = *model_.data_;
  finishDofs(model);
  finishClosures(model);
  finishPointSprings(model);
  finishShapes(model);
  for (int i = 1; i < model.numBodies(); ++i) model.data_->mass += model.data_->bodies[i].inertia.mass;
  return model;
}

void ModelBuilder::finishShapes(Model& model) const {
  std::vector<bool> has_shape(model.data_->bodies.size(), false);
  for (const Shape& shape : model.shapes()) has_shape[shape.body] = true;
  for (const Visual& visual : model.visuals())
    if (const auto shape = has_shape[visual.body] ? std::nullopt : fitShape(visual))
      model.data_->shapes.push_back(*shape);
}

void ModelBuilder::checkInertias(std::vector<std::string>* warnings) const {
  for (const auto& [link, inertia] : link_inertias_) {
    const std::string element = "link '" + link + "'";
    if (!std::isfinite(inertia.mass) || !inertia.com.allFinite() || !inertia.I_com.allFinite())
      fail(element, "its inertia is not a finite number", "correct the <inertial> element");
    if (std::max({inertia.mass, inertia.com.cwiseAbs().maxCoeff(), inertia.I_com.cwiseAbs().maxCoeff()}) >
        kBeyondRobots)
      fail(element,
           "its mass (" + formatNumber(inertia.mass) + " kg), its centre of mass or its inertia exceeds " +
               formatNumber(kBeyondRobots) + " kg, m or kg m^2",
           "correct the <inertial> element");
    if (inertia.mass < 0)
      fail(element, "its mass is negative (" + formatNumber(inertia.mass) + " kg)", "give 0 or more");
    const Vector3d moments =
        Eigen::SelfAdjointEigenSolver<Matrix3d>(inertia.I_com, Eigen::EigenvaluesOnly).eigenvalues();
    // A body's principal moments are sums of two non-negative second moments: none negative, none above the sum of the
    // others.
    const double slack = 1e-6 * moments.cwiseAbs().maxCoeff() + 1e-12;
    if (moments[0] < -slack) fail(element, "its inertia matrix has a negative principal moment", "correct <inertia>");
    // Published robots have such, and their mass matrices are positive definite all the same.
    if (warnings && moments[2] > moments[0] + moments[1] + slack)
      warnings->push_back((source_.empty() ? "" : source_ + ": ") + element +
                          ": its principal moments violate the triangle inequality, so no body can have them; they are "
                          "used as they are");
    if (inertia.mass == 0 && moments[2] > slack)
      fail(element, "it has rotational inertia but no mass", "give it a mass, or no inertia");
    if (warnings && inertia.mass >= 1000)
      warnings->push_back((source_.empty() ? "" : source_ + ": ") + element + ": a mass of " +
                          formatNumber(inertia.mass) + " kg is implausible for a leg");
  }
}

void ModelBuilder::finishDofs(Model& model) const {
  model.data_->dofs.resize(model.nv());
  model.data_->support.resize(model.numBodies());
  const size_t bodies = model.numBodies();
  model.data_->ancestry.assign(bodies * bodies, 0);
  for (size_t b = 0; b < bodies; ++b)
    for (int a = static_cast<int>(b); a >= 0; a = model.joints()[a].parent) model.data_->ancestry[a * bodies + b] = 1;
  const double inf = std::numeric_limits<double>::infinity();
  model.data_->lower = VectorXd::Constant(model.nv(), -inf);
  model.data_->upper = VectorXd::Constant(model.nv(), inf);
  model.data_->velocity_limit = VectorXd::Constant(model.nv(), inf);
  model.data_->armature = VectorXd::Zero(model.nv());
  for (int i = 1; i < model.numBodies(); ++i) {
    const Joint& joint = model.joints()[i];
    model.data_->support[i] = model.data_->support[joint.parent];
    for (int k = 0; k < joint.nv; ++k) {
      Dof& dof = model.data_->dofs[joint.idx_v + k];
      dof.joint = i;
      dof.parent = model.data_->support[i].empty() ? -1 : model.data_->support[i].back();
      dof.first_of_universal = joint.kind == JointKind::Universal && k == 0;
      dof.second_of_universal = joint.kind == JointKind::Universal && k == 1;
      model.data_->support[i].push_back(joint.idx_v + k);
    }
    const JointLimits& limits = limits_[i];
    if (limits.lower.size()) model.data_->lower.segment(joint.idx_v, joint.nv) = limits.lower;
    if (limits.upper.size()) model.data_->upper.segment(joint.idx_v, joint.nv) = limits.upper;
    if (limits.velocity.size()) model.data_->velocity_limit.segment(joint.idx_v, joint.nv) = limits.velocity;
    for (int k = joint.idx_v; k < joint.idx_v + joint.nv; ++k)
      if (!(model.data_->lower[k] <= model.data_->upper[k]))
        fail("joint '" + joint.name + "'", "its lower limit is above its upper limit", "swap them");
  }
  for (const Motor& motor : model.motors()) {
    model.data_->armature[motor.dof] = motor.armature;
    model.data_->velocity_limit[motor.dof] = std::min(model.data_->velocity_limit[motor.dof], motor.velocity_limit);
  }
  for (const auto& [name, armature] : joint_armature_) {
    if (model.findMotor(name) >= 0)
      fail("armature of '" + name + "'", "the joint has a motor", "give the armature with the motor");
    const Joint& joint = model.joints()[model.findJoint(name)];
    model.data_->armature.segment(joint.idx_v, joint.nv).setConstant(armature);
  }
}

}  // namespace bielle
