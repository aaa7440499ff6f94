#include "worlds/fall_detector.h"

#include <algorithm>
#include <cmath>

#include "bielle/model/error.h"
#include "model/number_text.h"

namespace bielle::worlds {
namespace {

constexpr double kHalfTurn = 3.14159265358979323846;  // rad
constexpr double kTurnBack = 0.05;                    // of a motor at a time, rad: no dead point is jumped over
constexpr double kSamePlace = 0.2;  // of joints that came back, rad: rods that are off their model move them by less

std::string formatTime(double time) { return formatNumber(time, "%.3f s"); }

bool isTurning(const Joint& joint) { return joint.kind == JointKind::Revolute || joint.kind == JointKind::Continuous; }

}  // namespace

FallDetector::FallDetector(const Model& model, const Policy& plan, const VectorXd& q, const FallCriterion& criterion,
                           const Ground& ground, const Ground& planned_ground)
    : model_(model),
      plan_(plan),
      criterion_(criterion),
      ground_(ground),
      planned_ground_(planned_ground),
      q_(model.makeNeutral()),
      v_(VectorXd::Zero(model.nv())),
      motors_(model.nu()) {
  if (!criterion.only_whirling || model.closures().empty()) return;
  try {
    linkages_.emplace(model, q);
  } catch (const InputError&) {
    // Motors do not determine all joints: nothing can be said of where linkages would follow them.
  }
}

std::string FallDetector::find(double time, double plan_time, const VectorXd& q) {
  plan_.getReference(plan_time, q_, v_);
  if (const Joint* joint = findStrayJoint(q))
    return "joint " + joint->name + " is far from its planned angle at " + formatTime(time);
  if (!model_.hasFreeFlyer()) return {};
  const Vector3d p = q.head<3>(), planned = q_.head<3>();
  deviation_ = (p - planned).norm();
  const auto getUp = [](const VectorXd& at) {
    return Vector3d(Eigen::Quaterniond(at[6], at[3], at[4], at[5]).toRotationMatrix().row(2));
  };
  const Vector3d up = getUp(q), planned_up = getUp(q_);
  const double tilt = std::atan2(up.cross(planned_up).norm(), up.dot(planned_up));
  const double height = calcHeight(q, ground_) / calcHeight(q_, planned_ground_);
  if (!(tilt <= criterion_.tilt)) return "the trunk leans far from its planned attitude at " + formatTime(time);
  if (!(height >= criterion_.height)) return "the trunk is far below its planned height at " + formatTime(time);
  return {};
}

double FallDetector::calcHeight(const VectorXd& q, const Terrain& ground) const {
  const Eigen::Quaterniond attitude(q[6], q[3], q[4], q[5]);
  const Vector3d p = q.head<3>() + attitude * model_.bodies()[1].inertia.com;
  return p.z() - ground.find(p.x(), p.y()).height;
}

double FallDetector::calcDeviation(const Joint& joint, const VectorXd& q) const {
  return isTurning(joint) ? std::abs(q[joint.idx_q] - q_[joint.idx_q]) : 0;
}

const Joint* FallDetector::findStrayJoint(const VectorXd& q) {
  joint_deviation_ = 0;
  for (const Joint& joint : model_.joints()) {
    const double deviation = calcDeviation(joint, q);
    if (!(deviation <= joint_deviation_)) joint_deviation_ = deviation;
    if (std::isnan(deviation)) return &joint;
  }
  if (joint_deviation_ <= criterion_.joint) return nullptr;
  const bool back = linkages_ && followsBack(q);
  for (const Joint& joint : model_.joints()) {
    const double deviation = calcDeviation(joint, q);
    if (deviation > (back && linkages_->isLinked(joint) ? kHalfTurn : criterion_.joint)) return &joint;
  }
  return nullptr;
}

bool FallDetector::followsBack(const VectorXd& q) {
  linkages_->reset(q);
  q_back_ = q;
  double farthest = 0;
  const auto& joints = model_.joints();
  for (const Motor& motor : model_.motors())
    farthest = std::max(farthest, std::abs(q[joints[motor.joint].idx_q] - q_[joints[motor.joint].idx_q]));
  const int steps = static_cast<int>(std::ceil(std::min(farthest, 2 * kHalfTurn) / kTurnBack));
  for (int i = 1; i <= steps; ++i) {
    for (int m = 0; m < model_.nu(); ++m) {
      const int at = joints[model_.motors()[m].joint].idx_q;
      motors_[m] = q[at] + (q_[at] - q[at]) * i / steps;
    }
    if (linkages_->update(motors_, q_back_) != NumericalStatus::Ok) return false;
  }
  return std::all_of(joints.begin(), joints.end(),
                     [this](const Joint& joint) { return calcDeviation(joint, q_back_) < kSamePlace; });
}

}  // namespace bielle::worlds
