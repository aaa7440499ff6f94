#pragma once
/// \file When a robot that carries out a plan has fallen.
#include <optional>
#include <string>

#include "bielle/control/policy.h"
#include "control/passive_joints.h"
#include "worlds/terrain.h"

namespace bielle::worlds {

/// When a robot counts as fallen: its trunk (the body of the first joint)
/// - leans by more than `tilt` from its planned attitude, whatever its heading, or
/// - has its centre of mass less than `height` times as high over the ground as planned at that time,
/// or a revolute joint is more than `joint` away from its planned angle: a leg that whirls about carries nothing.
struct FallCriterion {
  double tilt = 0.8;    ///< rad
  double height = 0.6;  ///< 1
  double joint = 1.5;   ///< rad
  /// For controllers that make plans of their own, which may lead joints that far from the first plan: such a joint counts
  /// only if its leg does whirl about. It belongs to no linkage, or is half a turn away; or the linkages have passed a dead
  /// point, so that turning the motors straight back to their planned angles does not bring all joints back to theirs.
  bool only_whirling = false;
};

/// Compares a robot with its plan.
class FallDetector {
 public:
  /// \param model  of the robot, which may differ from that of the plan   \param plan  must outlive it
  /// \param q  closed configuration of the robot (nq)   \param ground  of the world   \param planned_ground  of the plan
  FallDetector(const Model& model, const Policy& plan, const VectorXd& q, const FallCriterion& criterion,
               const Ground& ground, const Ground& planned_ground);

  /// Why the robot counts as fallen, or nothing. \param plan_time  the instant of the plan at which it should be
  std::string find(double time, double plan_time, const VectorXd& q);
  double deviation() const { return deviation_; }  ///< of the trunk from its planned place, at the last find(), m
  double jointDeviation() const { return joint_deviation_; }  ///< of a revolute joint, the largest then, rad

 private:
  const Joint* findStrayJoint(const VectorXd& q);
  bool followsBack(const VectorXd& q);
  double calcDeviation(const Joint& joint, const VectorXd& q) const;
  // Of the centre of mass of the trunk over the ground below it: its frame may be anywhere.
  double calcHeight(const VectorXd& q, const Terrain& ground) const;

  Model model_;
  const Policy& plan_;
  const FallCriterion criterion_;
  const Terrain ground_, planned_ground_;
  std::optional<PassiveJoints> linkages_;  // only where requested
  VectorXd q_, v_;                         // as planned
  VectorXd q_back_, motors_;               // turned back; of the motors
  double deviation_ = 0, joint_deviation_ = 0;
};

}  // namespace bielle::worlds
