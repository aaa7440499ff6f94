#include "bielle/model/model.h"

#include <algorithm>

#include "math/direction.h"
#include "model/joint.h"

namespace bielle {

bool MotorDrive::isGiven() const {
  return !type.empty() || ratio != 1 || rotor_inertia != 0 || hasWinding() || resistance != 0 ||
         std::isfinite(std::min({voltage, current, continuous_current})) || efficiency != 1 || back_efficiency != 1 ||
         mass != 0;
}

double Motor::clampEffort(double u, double w) const {
  double lower = -effort_limit, upper = effort_limit;
  if (hasEnvelope() && drive.resistance > 0) {
    const double induced = voltsPerSpeed() * w, per_effort = voltsPerEffort();
    // Beyond the speed at which the induced voltage is that of the supply the motor brakes, whatever is asked.
    lower = std::clamp((-drive.voltage - induced) / per_effort, -effort_limit, effort_limit);
    upper = std::clamp((drive.voltage - induced) / per_effort, -effort_limit, effort_limit);
  }
  return std::clamp(u, lower, upper);
}
namespace {

template <typename Items>
int findByName(const Items& items, const std::string& name) {
  for (size_t i = 0; i < items.size(); ++i)
    if (items[i].name == name) return static_cast<int>(i);
  return -1;
}

}  // namespace

Shape makeCapsule(int body, const Vector3d& from, const Vector3d& to, double radius) {
  const double length = (to - from).norm();
  Shape shape;
  shape.body = body;
  shape.X_BS.p = (from + to) / 2;
  if (length > 0) shape.X_BS.R = calcRotationOfZ((to - from) / length);
  shape.half.z() = length / 2;
  shape.radius = radius;
  return shape;
}

std::optional<Shape> fitShape(const Visual& visual) {
  Shape shape;
  shape.body = visual.body;
  shape.X_BS = visual.X_BV;
  shape.fitted = true;
  const double radius = visual.size[0], length = visual.size[1];  // of cylinders and spheres
  switch (visual.shape) {
    case Visual::Shape::Box:
      shape.half = visual.size / 2;
      return shape;
    case Visual::Shape::Sphere:
      shape.radius = radius;
      return shape;
    case Visual::Shape::Cylinder: {
      const double box = 4 * length,
                   capsule = EIGEN_PI * (length + 4. / 3 * radius);  // volumes over the radius squared
      shape.half = box < capsule ? Vector3d(radius, radius, length / 2) : Vector3d(0, 0, length / 2);
      if (capsule <= box) shape.radius = radius;
      return shape;
    }
    case Visual::Shape::Mesh:
      if (!visual.bounds) return {};
      shape.X_BS = visual.X_BV * visual.bounds->X_BS;
      shape.half = visual.bounds->half;
      shape.radius = visual.bounds->radius;
      return shape;
  }
  return {};
}

const char* getName(ClosureKind kind) {
  switch (kind) {
    case ClosureKind::Weld6D:
      return "6d";
    case ClosureKind::Ball3D:
      return "3d";
    case ClosureKind::Hinge5D:
      return "5d";
    case ClosureKind::Coupler:
      return "coupler";
    case ClosureKind::Distance:
      return "distance";
    case ClosureKind::Slider:
      return "slider";
  }
  return "?";
}

const char* getName(ContactKind kind) {
  switch (kind) {
    case ContactKind::Point3D:
      return "3d";
    case ContactKind::Edge5D:
      return "5d";
    case ContactKind::Surface6D:
      return "6d";
  }
  return "?";
}

int getRows(ClosureKind kind) {
  switch (kind) {
    case ClosureKind::Weld6D:
      return 6;
    case ClosureKind::Ball3D:
      return 3;
    case ClosureKind::Hinge5D:
    case ClosureKind::Slider:
      return 5;
    case ClosureKind::Coupler:
    case ClosureKind::Distance:
      return 1;
  }
  return 0;
}

int getLengthRows(ClosureKind kind) {
  switch (kind) {
    case ClosureKind::Weld6D:
    case ClosureKind::Ball3D:
    case ClosureKind::Hinge5D:
      return 3;
    case ClosureKind::Slider:
      return 2;
    case ClosureKind::Distance:
      return 1;
    case ClosureKind::Coupler:
      return 0;
  }
  return 0;
}

bool hasAxis(ClosureKind kind) { return kind == ClosureKind::Hinge5D || kind == ClosureKind::Slider; }

Model::Model() : data_(std::make_shared<Data>()) {}

int Model::findJoint(const std::string& name) const {
  const int index = findByName(data_->joints, name);
  return index == 0 ? -1 : index;  // the world is not a joint
}
int Model::findFrame(const std::string& name) const { return findByName(data_->frames, name); }
int Model::findMotor(const std::string& name) const { return findByName(data_->motors, name); }
int Model::findContact(const std::string& name) const { return findByName(data_->contacts, name); }
int Model::findClosure(const std::string& name) const { return findByName(data_->closures, name); }

VectorXd Model::makeNeutral() const {
  VectorXd q(data_->nq);
  for (const Joint& joint : data_->joints)
    if (joint.nq) setNeutral(joint.kind, q.segment(joint.idx_q, joint.nq));
  return q;
}

void Model::integrate(ConstVectorRef q, ConstVectorRef dv, VectorRef q_out) const {
  for (const Joint& joint : data_->joints)
    if (joint.nv)
      integrateJoint(joint, q.segment(joint.idx_q, joint.nq), dv.segment(joint.idx_v, joint.nv),
                     q_out.segment(joint.idx_q, joint.nq));
}

VectorXd Model::integrate(ConstVectorRef q, ConstVectorRef dv) const {
  VectorXd out(data_->nq);
  integrate(q, dv, out);
  return out;
}

void Model::difference(ConstVectorRef q0, ConstVectorRef q1, VectorRef dv) const {
  for (const Joint& joint : data_->joints)
    if (joint.nv)
      calcJointDifference(joint, q0.segment(joint.idx_q, joint.nq), q1.segment(joint.idx_q, joint.nq),
                          dv.segment(joint.idx_v, joint.nv));
}

VectorXd Model::difference(ConstVectorRef q0, ConstVectorRef q1) const {
  VectorXd out(data_->nv);
  difference(q0, q1, out);
  return out;
}

void Model::normalize(VectorRef q) const {
  for (const Joint& joint : data_->joints) {
    if (joint.kind == JointKind::Spherical) q.segment<4>(joint.idx_q).normalize();
    if (joint.kind == JointKind::FreeFlyer) q.segment<4>(joint.idx_q + 3).normalize();
  }
}

}  // namespace bielle
