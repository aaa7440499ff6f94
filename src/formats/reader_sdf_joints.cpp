// Joints of SDF files: those that carry links, and those that close loops.
#include <cmath>
#include <limits>

#include "bielle/model/error.h"
#include "formats/reader_loops.h"
#include "formats/reader_sdf.h"
#include "math/direction.h"

namespace bielle {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

std::string describeSdf(const sdf::Joint& joint) { return "joint '" + joint.Name() + "'"; }

// If an axis is a coordinate axis but for rounding, makes it that one and returns the rotation from it to what was given; else the
// identity. Rows across the plane of a linkage are then zero, not a millionth of the others.
Matrix3d turnToAxis(Vector3d& axis) {
  constexpr double kNearly = 1e-3;  // rad
  const NearestAxis nearest = findNearestAxis(axis);
  if (nearest.angle == 0 || nearest.angle > kNearly) return Matrix3d::Identity();
  axis = nearest.axis;
  return nearest.turn;
}

}  // namespace

// In the directions of the child as the file gives it.
Vector3d SdfReader::resolveAxis(const sdf::Joint& joint, int k) const {
  const sdf::JointAxis* axis = joint.Axis(k);
  const auto frames = joint_frames_.find(joint.Name());
  const bool in_own_frame = axis && frames != joint_frames_.end() &&
                            (axis->XyzExpressedIn().empty() || axis->XyzExpressedIn() == joint.Name());
  ignition::math::Vector3d v;
  if (in_own_frame || (axis && axis->XyzExpressedIn().empty() && standsOnChild(joint)))
    v = axis->Xyz();
  else if (axis)
    check(axis->ResolveXyz(v, getChild(joint)));
  Vector3d direction(v.X(), v.Y(), v.Z());
  if (in_own_frame)
    direction =
        getPlace(model_->LinkByName(getChild(joint))->SemanticPose()).R.transpose() * frames->second.X_WC.R * direction;
  const double norm = direction.stableNorm();
  if (!axis)
    fail(describeSdf(joint), "it has no <axis>, or too few", "give its direction, e.g. <axis><xyz>0 0 1</xyz></axis>");
  if (!(norm > 1e-12) || !std::isfinite(norm))
    fail(describeSdf(joint), "its axis is not a direction", "give a non-zero vector");
  return std::abs(direction.squaredNorm() - 1) > 1e-15 ? Vector3d(direction / norm) : direction;  // as it was written
}

// In our frame of the child.
Vector3d SdfReader::getAxis(const sdf::Joint& joint, int k) const {
  return X_LS_.at(getChild(joint)).R * resolveAxis(joint, k);
}

// Axes of a universal joint at right angles are x and y of its link, as our files and Drake's have it.
std::optional<Matrix3d> SdfReader::findUniversalAxes(const sdf::Joint& joint) const {
  constexpr double kRightAngle = 1e-9;
  const Vector3d x = resolveAxis(joint, 0), y = resolveAxis(joint, 1);
  if (std::abs(x.dot(y)) > kRightAngle) return {};
  Matrix3d R;
  R << x, y, x.cross(y);
  return R;
}

// Whether a hinge has what a closure cannot have: a range, a force, or what its motor can do.
bool SdfReader::losesByCut(const sdf::Joint& joint) {
  const sdf::JointAxis* axis = joint.Axis(0);
  if (!axis || (joint.Type() != sdf::JointType::REVOLUTE && joint.Type() != sdf::JointType::CONTINUOUS)) return false;
  const bool has_range =
      joint.Type() == sdf::JointType::REVOLUTE && (axis->Lower() > -kNoLimit || axis->Upper() < kNoLimit);
  return has_range || axis->Damping() != 0 || axis->Friction() != 0 || axis->SpringStiffness() != 0 ||
         (axis->Effort() > 0 && axis->Effort() < kNoLimit);
}

// Limits, forces and speed of a coordinate.
void SdfReader::readAxis(const sdf::Joint& joint, int k, UrdfJoint& out) {
  const sdf::JointAxis& axis = *joint.Axis(k);
  const double lower = axis.Lower(), upper = axis.Upper();
  if (!(lower <= upper)) fail(describeSdf(joint), "its range is empty", "give the lower limit first");
  if ((lower > -kNoLimit || upper < kNoLimit) && out.joint.kind != JointKind::Continuous) {
    if (out.lower.size() == 0) {
      out.lower = VectorXd::Constant(getNv(out.joint.kind), -kInfinite);
      out.upper = VectorXd::Constant(getNv(out.joint.kind), kInfinite);
    }
    if (lower > -kNoLimit) out.lower[k] = lower;
    if (upper < kNoLimit) out.upper[k] = upper;
  }
  JointForce force;
  force.damping = axis.Damping();
  force.friction = axis.Friction();
  force.stiffness = axis.SpringStiffness();
  if (force.stiffness != 0) force.rest = axis.SpringReference();
  const bool has_force = force.damping != 0 || force.friction != 0 || force.stiffness != 0;
  if (getNv(out.joint.kind) != 1) {
    if (has_force)
      tree_.warnings.push_back(path_ + ": " + describeSdf(joint) + ": springs, damping and friction are left out");
    return;
  }
  if (has_force) yaml_.joint_forces.push_back({joint.Name(), force});
  if (axis.Effort() > 0 && axis.Effort() < kNoLimit) out.effort = axis.Effort();
  if (axis.MaxVelocity() > 0 && axis.MaxVelocity() < kNoLimit) out.velocity = axis.MaxVelocity();
}

void SdfReader::addCarried(const sdf::Joint& joint) {
  UrdfJoint out;
  out.parent = getParent(joint);
  out.child = getChild(joint);
  out.joint.name = joint.Name();
  out.joint.X_PJ = calcPlaceIn(out.parent, out.child);
  switch (joint.Type()) {
    case sdf::JointType::FIXED:
      out.joint.kind = JointKind::Fixed;
      break;
    case sdf::JointType::BALL:
      out.joint.kind = JointKind::Spherical;
      break;
    case sdf::JointType::REVOLUTE:
    case sdf::JointType::CONTINUOUS:
    case sdf::JointType::PRISMATIC:
      out.joint.axis = getAxis(joint, 0);
      out.joint.kind = joint.Type() == sdf::JointType::PRISMATIC ? JointKind::Prismatic : JointKind::Revolute;
      if (joint.Type() == sdf::JointType::CONTINUOUS ||
          (joint.Type() == sdf::JointType::REVOLUTE && joint.Axis(0)->Lower() < -kNoLimit &&
           joint.Axis(0)->Upper() > kNoLimit))
        out.joint.kind = JointKind::Continuous;
      readAxis(joint, 0, out);
      break;
    case sdf::JointType::UNIVERSAL:
      out.joint.kind = JointKind::Universal;
      out.joint.axis = Vector3d::UnitX();
      out.joint.axis2 = Vector3d::UnitY();
      if (!findUniversalAxes(joint)) {
        out.joint.axis = getAxis(joint, 0);
        out.joint.axis2 = getAxis(joint, 1);
      }
      for (int k : {0, 1}) readAxis(joint, k, out);
      break;
    default:
      fail(describeSdf(joint), "joints of type gearbox, revolute2 and screw are not supported",
           "replace it by revolute and prismatic joints; `closures` of a YAML file can couple them");
  }
  tree_.joints.push_back(out);
}

void SdfReader::addClosure(const std::string& name, ClosureKind kind, const Vector3d& axis, const std::string& link1,
                           const SE3& X_W1, const std::string& link2, const SE3& X_W2) {
  const auto frame = [&](const std::string& link, const SE3& X, const std::string& suffix) {
    constexpr double kCoincident = 1e-10;  // the posture of the file is closed to less
    const SE3 X_LF = getLinkPlace(link).inverse() * X;
    const std::string known = findUrdfFrame(tree_, link, X_LF, kind == ClosureKind::Ball3D, kCoincident);
    if (!known.empty()) return known;
    std::string made = name + suffix;
    while (!names_.insert(made).second) made += "_";
    return addFrame(made, link, X_LF);
  };
  ClosureSpec closure;
  closure.name = name;
  closure.kind = kind;
  closure.axis = axis;
  closure.frame1 = frame(link1, X_W1, "_frame1");
  closure.frame2 = frame(link2, X_W2, "_frame2");
  yaml_.closures.push_back(closure);
}

void SdfReader::addClosure(const sdf::Joint& joint) {
  const std::string parent = getParent(joint), child = getChild(joint);
  ClosureKind kind = ClosureKind::Weld6D;
  Vector3d axis = Vector3d::UnitZ();
  SE3 X_WP = getPlace(joint.SemanticPose(), parent), X_WC = getPlace(joint.SemanticPose(), child);
  if (const auto frames = joint_frames_.find(joint.Name()); frames != joint_frames_.end()) {
    X_WP = moves_.at(parent) * frames->second.X_WP;
    X_WC = moves_.at(child) * frames->second.X_WC;
  }
  if (joint.Type() == sdf::JointType::BALL) kind = ClosureKind::Ball3D;
  if (joint.Type() == sdf::JointType::PRISMATIC) kind = ClosureKind::Slider;
  if (joint.Type() == sdf::JointType::REVOLUTE || joint.Type() == sdf::JointType::CONTINUOUS)
    kind = ClosureKind::Hinge5D;
  if (hasAxis(kind)) {
    const sdf::JointAxis* own = joint.Axis(0);
    axis = own && own->XyzExpressedIn().empty() && !joint_frames_.count(joint.Name())
               ? Vector3d(own->Xyz().X(), own->Xyz().Y(), own->Xyz().Z())
               : Vector3d(X_WC.R.transpose() * getLinkPlace(child).R * getAxis(joint, 0));
    UrdfJoint unused;
    unused.joint.kind = kind == ClosureKind::Slider ? JointKind::Prismatic : JointKind::Revolute;
    const size_t forces = yaml_.joint_forces.size();
    readAxis(joint, 0, unused);
    if (unused.lower.size() > 0 || yaml_.joint_forces.size() > forces)
      tree_.warnings.push_back(path_ + ": " + describeSdf(joint) +
                               ": it closes a loop: its range, spring, damping and friction are left out");
    yaml_.joint_forces.resize(forces);
    if (kind == ClosureKind::Hinge5D) {
      const Matrix3d turn = turnToAxis(axis);
      X_WP.R = X_WP.R * turn;
      X_WC.R = X_WC.R * turn;
    }
  }
  addClosure(joint.Name(), kind, axis, parent, X_WP, child, X_WC);
}

}  // namespace bielle
