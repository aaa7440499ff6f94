#include "bielle/model/builder.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

namespace bielle {

ModelBuilder::ModelBuilder(std::string name, std::string source) : source_(std::move(source)) {
  model_.name_ = std::move(name);
  Joint world;
  world.name = "world";
  world.parent = -1;
  model_.joints_.push_back(world);
  model_.bodies_.push_back({"world", {}});
  model_.frames_.push_back({"world", 0, {}});
  frames_["world"] = {0, {}};
  limits_.push_back({});
}

void ModelBuilder::fail(const std::string& element, const std::string& problem, const std::string& remedy) const {
  throw ModelError(source_, element, problem, remedy);
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
    fail("link '" + link + "'", "it is declared twice", "give every link and frame its own name");
  const FramePlace parent = getFrame(parent_link, element);
  if (joint.kind == JointKind::Fixed) {
    const SE3 X_BF = parent.X_BF * joint.X_PJ;
    frames_[link] = {parent.body, X_BF};
    model_.frames_.push_back({link, parent.body, X_BF});
    addInertia(link, inertia);
    return;
  }
  for (const Joint& other : model_.joints_)
    if (other.name == joint.name) fail(element, "two joints have this name", "rename one of them");
  for (Vector3d* axis : {&joint.axis, &joint.axis2}) {
    const double norm = axis->norm();
    if (!(norm > 1e-12) || !std::isfinite(norm)) fail(element, "its axis is not a direction", "give a non-zero vector");
    *axis /= norm;
  }
  if (joint.kind == JointKind::Universal && joint.axis.cross(joint.axis2).norm() < 1e-6)
    fail(element, "the two axes of a universal joint are parallel", "give two different axes");
  joint.parent = parent.body;
  joint.X_PJ = parent.X_BF * joint.X_PJ;
  joint.nq = getNq(joint.kind);
  joint.nv = getNv(joint.kind);
  joint.idx_q = model_.nq_;
  joint.idx_v = model_.nv_;
  model_.nq_ += joint.nq;
  model_.nv_ += joint.nv;
  for (const VectorXd* bound : {&limits.lower, &limits.upper, &limits.velocity})
    if (bound->size() != 0 && bound->size() != joint.nv)
      fail(
          element,
          "its limits have " + std::to_string(bound->size()) + " entries, its velocity has " + std::to_string(joint.nv),
          "give one limit per velocity coordinate, or none");
  const int body = model_.numBodies();
  model_.joints_.push_back(joint);
  model_.bodies_.push_back({link, {}});
  model_.frames_.push_back({link, body, {}});
  frames_[link] = {body, {}};
  limits_.push_back(limits);
  addInertia(link, inertia);
}

void ModelBuilder::addInertia(const std::string& link, const Inertia& inertia) {
  const FramePlace place = getFrame(link, "link '" + link + "'");
  link_inertias_.emplace_back(link, inertia);
  if (place.body == 0) return;  // the ground has no dynamics
  Body& body = model_.bodies_[place.body];
  body.inertia = body.inertia + inertia.transformed(place.X_BF);
}

void ModelBuilder::addFrame(const std::string& name, const std::string& link, const SE3& X_LF) {
  if (frames_.count(name))
    fail("frame '" + name + "'", "it is declared twice", "give every link and frame its own name");
  const FramePlace place = getFrame(link, "frame '" + name + "'");
  frames_[name] = {place.body, place.X_BF * X_LF};
  model_.frames_.push_back({name, place.body, place.X_BF * X_LF});
}

void ModelBuilder::addClosure(const std::string& name, ClosureKind kind, const std::string& frame1,
                              const std::string& frame2, const Vector3d& axis, double kp, double kd) {
  const std::string element = "closure '" + name + "'";
  const FramePlace f1 = getFrame(frame1, element), f2 = getFrame(frame2, element);
  if (frame1 == frame2) fail(element, "it closes frame '" + frame1 + "' with itself", "name two frames on two bodies");
  if (f1.body == f2.body)
    fail(element, "frames '" + frame1 + "' and '" + frame2 + "' are on the same rigid body",
         "a closure needs a joint between its frames");
  if (!(axis.norm() > 1e-12) || !axis.allFinite())
    fail(element, "its hinge axis is not a direction", "give a non-zero vector");
  Closure closure;
  closure.name = name;
  closure.kind = kind;
  closure.body1 = f1.body;
  closure.body2 = f2.body;
  closure.X_B1 = f1.X_BF;
  closure.X_B2 = f2.X_BF;
  closure.axis = axis.normalized();
  closure.kp = kp;
  closure.kd = kd;
  addChecked(std::move(closure));
}

void ModelBuilder::addCoupler(const std::string& name, const std::map<std::string, double>& coefficients, double offset,
                              double kp, double kd) {
  const std::string element = "closure '" + name + "'";
  Closure closure;
  closure.name = name;
  closure.kind = ClosureKind::Coupler;
  for (const auto& [joint, coefficient] : coefficients) {
    const int index = model_.findJoint(joint);
    if (index < 0) fail(element, "there is no moving joint '" + joint + "'", "name joints that are not fixed");
    const Joint& j = model_.joints_[index];
    if (j.nv != 1)
      fail(element,
           "it couples '" + joint + "', a " + getName(j.kind) + " joint of " + std::to_string(j.nv) + " coordinates",
           "couple revolute, continuous or prismatic joints");
    if (!std::isfinite(coefficient) || coefficient == 0)
      fail(element, "the coefficient of joint '" + joint + "' is zero or not finite", "correct it, or omit the joint");
    closure.terms.push_back({index, coefficient, j.idx_q, j.idx_v});
  }
  if (closure.terms.size() < 2)
    fail(element, "it couples fewer than two joints", "name at least two, or make the joint fixed");
  if (!std::isfinite(offset)) fail(element, "its offset is not finite", "correct it");
  std::sort(closure.terms.begin(), closure.terms.end(),
            [](const CouplerTerm& a, const CouplerTerm& b) { return a.dof < b.dof; });
  closure.offset = offset;
  closure.kp = kp;
  closure.kd = kd;
  addChecked(std::move(closure));
}

void ModelBuilder::addChecked(Closure closure) {
  const std::string element = "closure '" + closure.name + "'";
  for (const Closure& other : model_.closures_)
    if (other.name == closure.name) fail(element, "two closures have this name", "rename one of them");
  if (!(closure.kp >= 0) || !(closure.kd >= 0) || std::isinf(closure.kp) || std::isinf(closure.kd))
    fail(element, "a stabilisation gain is not a finite number of 0 or more", "correct kp and kd");
  model_.closures_.push_back(std::move(closure));
}

void ModelBuilder::copyClosure(const Model& from, const Closure& closure) {
  if (closure.kind == ClosureKind::Coupler) {
    std::map<std::string, double> coefficients;
    for (const CouplerTerm& term : closure.terms) coefficients[from.joints()[term.joint].name] = term.coefficient;
    addCoupler(closure.name, coefficients, closure.offset, closure.kp, closure.kd);
    return;
  }
  const auto place = [&](const char* suffix, int body, const SE3& X_BF) {
    addFrame(closure.name + suffix, body == 0 ? "world" : from.bodies()[body].name, X_BF);
    return closure.name + suffix;
  };
  addClosure(closure.name, closure.kind, place("/frame1", closure.body1, closure.X_B1),
             place("/frame2", closure.body2, closure.X_B2), closure.axis, closure.kp, closure.kd);
}

void ModelBuilder::addMotor(const std::string& joint, double armature, double effort_limit, double velocity_limit,
                            std::optional<double> torque_loss) {
  const std::string element = "motor '" + joint + "'";
  const int index = model_.findJoint(joint);
  if (index < 0) fail(element, "there is no moving joint of this name", "name a joint of the robot that is not fixed");
  const Joint& j = model_.joints_[index];
  if (j.nv != 1)
    fail(element, "it is on a " + std::string(getName(j.kind)) + " joint of " + std::to_string(j.nv) + " coordinates",
         "motors drive revolute, continuous or prismatic joints");
  if (model_.findMotor(joint) >= 0) fail(element, "the joint has two motors", "list it once");
  if (!(armature >= 0) || std::isinf(armature))
    fail(element, "its armature is not a finite number of 0 or more", "give a rotor inertia");
  if (!(effort_limit > 0)) fail(element, "its effort limit is not positive", "give a positive limit or none");
  if (!(velocity_limit > 0)) fail(element, "its velocity limit is not positive", "give a positive limit or none");
  if (torque_loss && !(*torque_loss >= 0 && std::isfinite(*torque_loss)))
    fail(element, "its torque_loss is not a finite number of 0 or more", "give W/(N m)^2, or leave it out");
  model_.motors_.push_back({joint, index, j.idx_v, armature, effort_limit, velocity_limit, torque_loss});
}

void ModelBuilder::addContact(const std::string& name, const std::string& frame, ContactKind kind, double half_length,
                              double half_width) {
  const std::string element = "contact '" + name + "'";
  if (model_.findContact(name) >= 0) fail(element, "it is declared twice", "rename one of them");
  const FramePlace place = getFrame(frame, element);
  if (!(half_length >= 0) || !(half_width >= 0) || !std::isfinite(half_length + half_width))
    fail(element, "its sole is not made of two sizes of 0 or more", "give length and width in metres");
  model_.contacts_.push_back({name, place.body, place.X_BF, kind, half_length, half_width});
}

void ModelBuilder::addReference(Reference reference) {
  checkReference(reference);
  model_.references_.push_back(std::move(reference));
}

void ModelBuilder::checkReference(const Reference& reference) const {
  const std::string element = "reference '" + reference.name + "'";
  for (const Reference& other : model_.references_)
    if (other.name == reference.name) fail(element, "two references have this name", "rename one of them");
  for (const auto& [name, q] : reference.joints) {
    const int index = model_.findJoint(name);
    if (index < 0) fail(element, "there is no moving joint '" + name + "'", "correct the name");
    const Joint& joint = model_.joints_[index];
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
  if (reference.height_frame.empty()) return;
  getFrame(reference.height_frame, element);
  if (!std::isfinite(reference.height)) fail(element, "its height is not finite", "give a height in metres");
}

void ModelBuilder::addVisual(const std::string& link, Visual visual) {
  const FramePlace place = getFrame(link, "visual of link '" + link + "'");
  visual.body = place.body;
  visual.X_BV = place.X_BF * visual.X_BV;
  model_.visuals_.push_back(std::move(visual));
}

void ModelBuilder::addSerialJoint(const std::string& joint) {
  const int index = model_.findJoint(joint);
  if (index < 0)
    fail("serial joint '" + joint + "'", "there is no moving joint of this name",
         "name a joint of the robot that is not fixed");
  const std::vector<int>& listed = model_.serial_joints_;
  if (std::find(listed.begin(), listed.end(), index) != listed.end())
    fail("serial joint '" + joint + "'", "it is listed twice", "list it once");
  model_.serial_joints_.push_back(index);
}

void ModelBuilder::setGravity(const Vector3d& gravity) {
  if (!gravity.allFinite()) fail("gravity", "it is not finite", "give three numbers in m/s^2");
  model_.gravity_ = gravity;
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
  if (model_.nv_ == 0) fail("robot '" + model_.name_ + "'", "it has no moving joint", "declare at least one");
  checkInertias(warnings);
  Model model = model_;
  finishDofs(model);
  finishClosures(model);
  for (int i = 1; i < model.numBodies(); ++i) model.mass_ += model.bodies_[i].inertia.mass;
  return model;
}

void ModelBuilder::checkInertias(std::vector<std::string>* warnings) const {
  for (const auto& [link, inertia] : link_inertias_) {
    const std::string element = "link '" + link + "'";
    if (!std::isfinite(inertia.mass) || !inertia.com.allFinite() || !inertia.I_com.allFinite())
      fail(element, "its inertia is not a finite number", "correct the <inertial> element");
    if (inertia.mass < 0)
      fail(element, "its mass is negative (" + std::to_string(inertia.mass) + " kg)", "give 0 or more");
    const Vector3d moments =
        Eigen::SelfAdjointEigenSolver<Matrix3d>(inertia.I_com, Eigen::EigenvaluesOnly).eigenvalues();
    // A body's principal moments are sums of two non-negative second moments: none negative, none above the sum of the
    // others.
    const double slack = 1e-6 * moments.cwiseAbs().maxCoeff() + 1e-12;
    if (moments[0] < -slack) fail(element, "its inertia matrix has a negative principal moment", "correct <inertia>");
    if (moments[2] > moments[0] + moments[1] + slack)
      fail(element, "its principal moments break the triangle inequality, no body has such an inertia",
           "correct <inertia>");
    if (inertia.mass == 0 && moments[2] > slack)
      fail(element, "it has rotational inertia but no mass", "give it a mass, or no inertia");
    if (warnings && inertia.mass >= 1000)
      warnings->push_back((source_.empty() ? "" : source_ + ": ") + element + ": a mass of " +
                          std::to_string(inertia.mass) + " kg is implausible for a leg");
  }
}

void ModelBuilder::finishDofs(Model& model) const {
  model.dofs_.resize(model.nv_);
  model.support_.resize(model.numBodies());
  const size_t bodies = model.numBodies();
  model.ancestry_.assign(bodies * bodies, 0);
  for (size_t b = 0; b < bodies; ++b)
    for (int a = static_cast<int>(b); a >= 0; a = model.joints_[a].parent) model.ancestry_[a * bodies + b] = 1;
  const double inf = std::numeric_limits<double>::infinity();
  model.lower_ = VectorXd::Constant(model.nv_, -inf);
  model.upper_ = VectorXd::Constant(model.nv_, inf);
  model.velocity_limit_ = VectorXd::Constant(model.nv_, inf);
  model.armature_ = VectorXd::Zero(model.nv_);
  for (int i = 1; i < model.numBodies(); ++i) {
    const Joint& joint = model.joints_[i];
    model.support_[i] = model.support_[joint.parent];
    for (int k = 0; k < joint.nv; ++k) {
      Dof& dof = model.dofs_[joint.idx_v + k];
      dof.joint = i;
      dof.parent = model.support_[i].empty() ? -1 : model.support_[i].back();
      dof.first_of_universal = joint.kind == JointKind::Universal && k == 0;
      dof.second_of_universal = joint.kind == JointKind::Universal && k == 1;
      model.support_[i].push_back(joint.idx_v + k);
    }
    const JointLimits& limits = limits_[i];
    if (limits.lower.size()) model.lower_.segment(joint.idx_v, joint.nv) = limits.lower;
    if (limits.upper.size()) model.upper_.segment(joint.idx_v, joint.nv) = limits.upper;
    if (limits.velocity.size()) model.velocity_limit_.segment(joint.idx_v, joint.nv) = limits.velocity;
    for (int k = joint.idx_v; k < joint.idx_v + joint.nv; ++k)
      if (!(model.lower_[k] <= model.upper_[k]))
        fail("joint '" + joint.name + "'", "its lower limit is above its upper limit", "swap them");
  }
  for (const Motor& motor : model.motors_) {
    model.armature_[motor.dof] = motor.armature;
    model.velocity_limit_[motor.dof] = std::min(model.velocity_limit_[motor.dof], motor.velocity_limit);
  }
  for (const auto& [name, armature] : joint_armature_) {
    if (model.findMotor(name) >= 0)
      fail("armature of '" + name + "'", "the joint has a motor", "give the armature with the motor");
    const Joint& joint = model.joints_[model.findJoint(name)];
    model.armature_.segment(joint.idx_v, joint.nv).setConstant(armature);
  }
}

// Bodies of a coupler, dofs and signs of any closure.
void ModelBuilder::finishClosure(const Model& model, Closure& closure) const {
  if (closure.kind == ClosureKind::Coupler) {
    int carrier = model.joints_[closure.terms.front().joint].parent;
    const auto carriesAll = [&] {
      return std::all_of(closure.terms.begin(), closure.terms.end(), [&](const CouplerTerm& term) {
        return model.isAncestorOrSelf(carrier, model.joints_[term.joint].parent);
      });
    };
    while (!carriesAll()) carrier = model.joints_[carrier].parent;
    closure.body1 = closure.body2 = carrier;
    std::set<int> dofs;
    for (const CouplerTerm& term : closure.terms)
      dofs.insert(model.support_[term.joint].begin() + model.support_[carrier].size(),
                  model.support_[term.joint].end());
    closure.dofs.assign(dofs.begin(), dofs.end());
    closure.signs.assign(dofs.size(), 1);
    return;
  }
  const std::vector<int>&s1 = model.support_[closure.body1], &s2 = model.support_[closure.body2];
  for (int k = 0; k < model.nv_; ++k) {
    const bool in1 = std::binary_search(s1.begin(), s1.end(), k), in2 = std::binary_search(s2.begin(), s2.end(), k);
    if (in1 == in2) continue;
    closure.dofs.push_back(k);
    closure.signs.push_back(in1 ? 1 : -1);
  }
}

void ModelBuilder::finishClosures(Model& model) const {
  std::vector<int> owner(model.nv_);  // union-find over dofs
  std::iota(owner.begin(), owner.end(), 0);
  const auto find = [&owner](int k) {
    while (owner[k] != k) k = owner[k] = owner[owner[k]];
    return k;
  };
  for (Closure& closure : model.closures_) {
    finishClosure(model, closure);
    for (int k : closure.dofs) owner[find(k)] = find(closure.dofs.front());
    model.closure_rows_ += getRows(closure.kind);
  }
  std::map<int, LoopCluster> clusters;  // by representative dof
  for (int c = 0; c < static_cast<int>(model.closures_.size()); ++c) {
    LoopCluster& cluster = clusters[find(model.closures_[c].dofs.front())];
    cluster.closures.push_back(c);
    cluster.rows += getRows(model.closures_[c].kind);
    cluster.dofs.insert(cluster.dofs.end(), model.closures_[c].dofs.begin(), model.closures_[c].dofs.end());
  }
  for (auto& [root, cluster] : clusters) {
    std::sort(cluster.dofs.begin(), cluster.dofs.end());
    cluster.dofs.erase(std::unique(cluster.dofs.begin(), cluster.dofs.end()), cluster.dofs.end());
    model.clusters_.push_back(std::move(cluster));
  }
}

}  // namespace bielle
