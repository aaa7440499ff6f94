// Joints of six coordinates in files of USD, of which limits lock some.
#include <algorithm>
#include <cmath>

#include "bielle/model/error.h"
#include "formats/reader_usd.h"
#include "math/so3.h"
#include "model/listing.h"

namespace bielle {
namespace {

constexpr const char* kAxes[] = {"transX", "transY", "transZ", "rotX", "rotY", "rotZ"};

std::string listAxes(const std::vector<int>& axes) {
  std::vector<std::string> names;
  for (const int i : axes) names.emplace_back(kAxes[i]);
  return listItems(names);
}

// Of turns about these axes, one after the other, the angle of the first one.
double findFirstAngle(const Matrix3d& R, const std::vector<int>& axes) {
  if (axes.size() == 3) return std::atan2(-R(1, 2), R(2, 2));  // x, y and z
  const Vector3d e_i = Vector3d::Unit(axes[0]), e_j = Vector3d::Unit(axes[1]), turned = R * e_j;
  return std::atan2(e_i.cross(e_j).dot(turned), e_j.dot(turned));
}

// A ball has no motors: where its turns are driven one by one, it is three hinges.
bool drivesTurns(const UsdPrim& prim) {
  return std::any_of(kAxes + 3, kAxes + 6,
                     [&prim](const char* axis) { return prim.hasApi("PhysicsDriveAPI:" + std::string(axis)); });
}

}  // namespace

// Locked is what has a lower limit above the upper one. Whether it holds anything.
bool UsdReader::readSix(UsdJoint& joint) {
  const UsdPrim& prim = *joint.prim;
  bool has_range = false;
  for (int i = 0; i < 6; ++i) {
    const std::string prefix = "limit:" + std::string(kAxes[i]) + ":physics:";
    if (prim.hasApi("PhysicsLimitAPI:" + std::string(kAxes[i]))) {
      const double low = getNumber(prim, prefix + "low", -HUGE_VAL, true),
                   high = getNumber(prim, prefix + "high", HUGE_VAL, true);
      if (low > high) continue;
      has_range = has_range || std::isfinite(low) || std::isfinite(high);
    }
    joint.axes.push_back(i);
  }
  if (prim.hasApi("PhysicsLimitAPI:distance"))
    failUsd(path_, prim, "it limits a distance, which is not supported",
            "put a rod with a ball at each end in its place");
  if (joint.axes.size() == 6) {
    note(prim.line, "PhysicsJoint that locks nothing");
    return false;
  }
  if (joint.axes == std::vector<int>{3, 4, 5} && !drivesTurns(prim)) {
    joint.axes.clear();
    joint.kind = JointKind::Spherical;
    if (has_range) note(prim.line, "PhysicsLimitAPI of a ball", "the limits of a ball are left out");
  } else if (joint.axes.size() == 1) {
    readAxis(joint, joint.axes[0]);
  }
  return true;
}

void UsdReader::readAxis(UsdJoint& joint, int axis) const {
  joint.kind = axis < 3 ? JointKind::Prismatic : JointKind::Revolute;
  joint.axis = Vector3d::Unit(axis % 3);
  joint.coordinate = kAxes[axis];
  const std::string prefix = "limit:" + joint.coordinate + ":physics:";
  if (joint.prim->hasApi("PhysicsLimitAPI:" + joint.coordinate)) readRange(joint, prefix + "low", prefix + "high");
}

// Several free coordinates: a joint for each, slides first, then turns in the order of x, y and z, or a ball where none of them is
// driven, with bodies without mass in between, which stand where those of the file have them.
void UsdReader::addChain(const UsdJoint& whole) {
  if (whole.is_excluded) failForSeveral(whole);
  note(
      whole.prim->line, "PhysicsJoint",
      "it leaves several coordinates free: it is read as a chain of joints, slides first, then turns about x, y and z");
  SE3 X = calcMotion(whole);
  const auto is_slide = [](int axis) { return axis < 3; };
  const auto slides = std::count_if(whole.axes.begin(), whole.axes.end(), is_slide);
  const bool has_ball = whole.axes.size() - static_cast<size_t>(slides) == 3 && !drivesTurns(*whole.prim);
  const size_t count = has_ball ? static_cast<size_t>(slides) + 1 : whole.axes.size();
  int body = whole.body[0];
  SE3 X_SJ = whole.X_SJ[0];
  for (size_t k = 0; k < count; ++k) {
    UsdJoint joint = whole;
    const int axis = whole.axes[k];
    const bool is_ball = has_ball && k + 1 == count;
    if (is_ball)
      joint.kind = JointKind::Spherical;
    else
      readAxis(joint, axis);
    for (size_t other = 0; other < count; ++other)
      joint.siblings.emplace_back(has_ball && other + 1 == count ? "" : kAxes[whole.axes[other]]);
    joint.name = makeUnusedName(whole.name + "_" + (is_ball ? "ball" : joint.coordinate),
                                [this](const std::string& made) { return joint_names_.count(made) > 0; });
    joint_names_.insert(joint.name);
    readDrive(joint);
    readExtensions(joint);
    joint.body[0] = body;
    joint.X_SJ[0] = X_SJ;
    if (k + 1 < count) {
      SE3 moved;
      if (axis < 3) {
        moved.p = X.p[axis] * joint.axis;
      } else {
        std::vector<int> turns;
        for (size_t other = k; other < count; ++other) turns.push_back(whole.axes[other] - 3);
        moved.R = makeAxisRotation(joint.axis, findFirstAngle(X.R, turns));
        X.R = moved.R.transpose() * X.R;
      }
      UsdBody between;
      between.name = makeUnusedName(getLink(whole.body[1]) + "/" + joint.name,
                                    [this](const std::string& made) { return link_names_.count(made) > 0; });
      between.X_WS = bodies_[static_cast<size_t>(body)].X_WS * X_SJ * moved;
      link_names_.insert(between.name);
      body = joint.body[1] = static_cast<int>(bodies_.size());
      joint.X_SJ[1] = X_SJ = SE3();
      bodies_.push_back(std::move(between));
    }
    joints_.push_back(std::move(joint));
  }
}

void UsdReader::failForSeveral(const UsdJoint& joint) const {
  failUsd(path_, *joint.prim,
          "it closes a loop, but leaves " + listAxes(joint.axes) + " free: no such closure is supported",
          "let another joint of its loop close it (physics:excludeFromArticulation), or put a chain of revolute and "
          "prismatic joints with small bodies in between in its place");
}

}  // namespace bielle
