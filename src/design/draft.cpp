#include "design/draft.h"

#include <Eigen/Eigenvalues>
#include <algorithm>

#include "bielle/model/builder.h"
#include "bielle/model/error.h"

namespace bielle {

RobotDraft::RobotDraft(const Model& model)
    : model_(model), visuals_(model.visuals()), shapes_(model.shapes()), motors_(model.motors()) {
  for (const Joint& joint : model.joints()) joints_.push_back(joint.X_PJ);
  for (const Frame& frame : model.frames()) frames_.push_back(frame.X_BF);
  for (const Closure& closure : model.closures()) rods_.push_back(closure.length);
  for (const Body& body : model.bodies()) inertias_.push_back(body.inertia);
}

int RobotDraft::findMovable(const std::string& name, bool& is_joint) const {
  const int joint = model_.findJoint(name), frame = model_.findFrame(name);
  is_joint = joint > 0;
  if (is_joint) return joint;
  if (frame < 0)
    throw InputError(model_.name(), "place '" + name + "'", "there is no such joint or frame",
                     "`bielle info` lists them");
  if (getLink(model_.frames()[frame].body) == name)
    throw InputError(model_.name(), "place '" + name + "'", "it is a link, which is the origin of its own coordinates",
                     "name the joint that carries it");
  return frame;
}

RobotDraft::Place RobotDraft::getPlace(const std::string& name) const {
  bool is_joint = false;
  const int index = findMovable(name, is_joint);
  if (is_joint) return {model_.joints()[index].parent, joints_[index].p};
  return {model_.frames()[index].body, frames_[index].p};
}

Vector3d RobotDraft::getPlaceIn(int body, const std::string& name) const {
  if (model_.joints()[body].name == name) return Vector3d::Zero();
  const Place place = getPlace(name);
  if (place.body != body)
    throw InputError(model_.name(), "place '" + name + "'",
                     "it is fixed to '" + getLink(place.body) + "', not to '" + getLink(body) + "'",
                     "name two places of one body");
  return place.p;
}

void RobotDraft::setPlace(const std::string& name, const Vector3d& p) {
  bool is_joint = false;
  const int index = findMovable(name, is_joint);
  (is_joint ? joints_ : frames_)[index].p = p;
}

int RobotDraft::findLink(const std::string& name) const {
  int body = 1;
  while (body < model_.numBodies() && model_.bodies()[body].name != name) ++body;
  if (body == model_.numBodies())
    throw InputError(model_.name(), "link '" + name + "'", "there is no such body", "`bielle info` lists them");
  return body;
}

size_t RobotDraft::findRod(const std::string& closure) const {
  const std::vector<Closure>& closures = model_.closures();
  const auto found = std::find_if(closures.begin(), closures.end(), [&](const Closure& c) {
    return c.name == closure && c.kind == ClosureKind::Distance;
  });
  if (found == closures.end())
    throw InputError(model_.name(), "rod '" + closure + "'", "there is no closure of type distance with this name",
                     "`bielle info` lists them");
  return static_cast<size_t>(found - closures.begin());
}

void RobotDraft::scaleMass(const std::string& link, double factor) {
  Inertia& inertia = inertias_[findLink(link)];
  inertia.mass *= factor;
  inertia.I_com *= factor;
}

void RobotDraft::stretch(const std::string& link, const Vector3d& origin, const Vector3d& direction, double factor) {
  const int body = findLink(link);
  const Matrix3d D = Matrix3d::Identity() + (factor - 1) * direction * direction.transpose();
  Inertia& inertia = inertias_[body];
  const Matrix3d S = inertia.I_com.trace() / 2 * Matrix3d::Identity() - inertia.I_com;  // Eq. (1)
  const Matrix3d stretched = factor * D * S * D;
  inertia.mass *= factor;
  inertia.com = origin + D * (inertia.com - origin);
  inertia.I_com = stretched.trace() * Matrix3d::Identity() - stretched;
  const auto stretchShape = [&](Shape& shape) {
    shape.X_BS.p = origin + D * (shape.X_BS.p - origin);
    const Vector3d along = (shape.X_BS.R.transpose() * direction).cwiseAbs();
    for (int i = 0; i < 3; ++i)
      if (along[i] > 0.99) shape.half[i] *= factor;
  };
  for (Visual& visual : visuals_) {
    if (visual.body != body) continue;
    std::optional<Shape> bounds = visual.bounds ? fitShape(visual) : std::nullopt;
    visual.X_BV.p = origin + D * (visual.X_BV.p - origin);
    if (bounds) {
      stretchShape(*bounds);
      bounds->X_BS = visual.X_BV.inverse() * bounds->X_BS;
      visual.bounds = bounds;
    }
    const Vector3d along = (visual.X_BV.R.transpose() * direction).cwiseAbs();
    if (visual.shape == Visual::Shape::Cylinder && along.z() > 0.99) visual.size[1] *= factor;
    if (visual.shape != Visual::Shape::Box) continue;
    for (int i = 0; i < 3; ++i)
      if (along[i] > 0.99) visual.size[i] *= factor;
  }
  for (Shape& shape : shapes_)
    if (shape.body == body) stretchShape(shape);
}

void RobotDraft::addMass(int body, const Vector3d& at, double mass) {
  if (body == 0) return;
  Inertia& inertia = inertias_[static_cast<size_t>(body)];
  const Inertia sum = inertia + Inertia{mass, at, Matrix3d::Zero()};
  // Second moments, of which no body has negative ones.
  const Matrix3d moments = 0.5 * sum.I_com.trace() * Matrix3d::Identity() - sum.I_com;
  const double least = Eigen::SelfAdjointEigenSolver<Matrix3d>(moments, Eigen::EigenvaluesOnly).eigenvalues()[0];
  if (!(sum.mass > 0) || least < -1e-9 * std::max(inertia.I_com.trace(), 1e-12))
    throw InputError(model_.name(), "link '" + getLink(body) + "'",
                     "it cannot include the mass of the motor that it is said to carry",
                     "correct the masses of the link and of its motors in the robot's files");
  inertia = sum;
}

int RobotDraft::findFrameAt(int body, const SE3& X_BF) const {
  for (size_t i = 0; i < model_.frames().size(); ++i) {
    const Frame& frame = model_.frames()[i];
    if (frame.body == body && frame.X_BF.p == X_BF.p && frame.X_BF.R == X_BF.R) return static_cast<int>(i);
  }
  return -1;
}

int RobotDraft::findFrameAt(int body, const Vector3d& p) const {
  for (size_t i = 0; i < model_.frames().size(); ++i)
    if (model_.frames()[i].body == body && model_.frames()[i].X_BF.p == p) return static_cast<int>(i);
  return -1;
}

Model RobotDraft::build() const {
  const Model& m = model_;
  ModelBuilder builder(m.name());
  builder.setGravity(m.gravity());
  for (int i = 1; i < m.numBodies(); ++i) {
    Joint joint = m.joints()[i];
    joint.X_PJ = joints_[i];
    JointLimits limits;
    if (joint.nv > 0)
      limits = {m.lowerLimits().segment(joint.idx_v, joint.nv), m.upperLimits().segment(joint.idx_v, joint.nv),
                m.velocityLimits().segment(joint.idx_v, joint.nv)};
    builder.addLink(getLink(i), getLink(joint.parent), joint, inertias_[i], limits);
  }
  for (size_t i = 0; i < frames_.size(); ++i) {
    const Frame& frame = m.frames()[i];
    if (frame.name != getLink(frame.body)) builder.addFrame(frame.name, getLink(frame.body), {frames_[i]});
  }
  // Closures, springs and contacts made from a frame move with it.
  const auto place = [&](const std::string& name, int body, const SE3& X_BF) {
    if (const int frame = findFrameAt(body, X_BF); frame >= 0) return m.frames()[frame].name;
    builder.addFrame(name, getLink(body), X_BF);
    return name;
  };
  for (size_t i = 0; i < rods_.size(); ++i) {
    Closure c = m.closures()[i];
    c.length = rods_[i];
    if (c.kind == ClosureKind::Coupler) {
      builder.copyClosure(m, c);
      continue;
    }
    const std::string frame1 = place(c.name + "/frame1", c.body1, c.X_B1);
    builder.addClosure(frame1, place(c.name + "/frame2", c.body2, c.X_B2), c);
  }
  for (const Motor& motor : motors_) builder.addMotor(motor);
  for (const Joint& joint : m.joints())
    if (joint.nv > 0 && m.findMotor(joint.name) < 0) builder.setArmature(joint.name, m.armature()[joint.idx_v]);
  for (const JointForce& force : m.jointForces()) builder.addJointForce(m.joints()[force.joint].name, force);
  for (PointSpring spring : m.pointSprings()) {
    const auto move = [&](int body, Vector3d& point) {
      if (const int frame = findFrameAt(body, point); frame >= 0) point = frames_[frame].p;
    };
    move(spring.body1, spring.point1);
    move(spring.body2, spring.point2);
    builder.copyPointSpring(m, spring);
  }
  for (const ContactFrame& c : m.contacts())
    builder.addContact(c.name, place(c.name + "/frame", c.body, c.X_BF), c.kind, c.half_length, c.half_width);
  for (const Reference& reference : m.references()) builder.addReference(reference);
  for (const Visual& visual : visuals_) builder.addVisual(getLink(visual.body), visual);
  for (const Shape& shape : shapes_) builder.addShape(getLink(shape.body), shape);
  for (int joint : m.serialJoints()) builder.addSerialJoint(m.joints()[joint].name);
  return builder.build();
}

}  // namespace bielle
