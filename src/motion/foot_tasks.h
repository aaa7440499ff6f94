#pragma once
// What feet do in a stage (StageSpec::feet), with their costs and constraints; and constraints of the end of a motion. Contacts are
// indices in the model.
#include "bielle/motion/motion.h"
#include "motion/robot_size.h"

namespace bielle {

// A foot in the air follows its path: a cost of its placement. \param weights  1/m^2 and 1, in the axes of X_WF; all 0: no cost
void addSwing(const Model& model, int contact, const SE3& X_WF, const Vector6d& weights, StageSpec& stage);
// And one of its velocity, m/s and rad/s in world axes, which defines the motion.
void addSwingVelocity(const Model& model, int contact, const Vector6d& V_F, const Vector6d& weights, StageSpec& stage);

// How far from its place a foot may land: along x and y of the place, and its corners by turning about z, m.
struct LandingRegion {
  Eigen::Vector2d lower = Eigen::Vector2d::Zero(), upper = Eigen::Vector2d::Zero();
  double turn = 0;
};
// All within `room` m, as far as the sole then still has what it has of the ground's box under the place: at most half of what
// is left up to an edge or a riser, and half for turning.
LandingRegion findLandingRegion(const ContactFrame& foot, const SE3& X_WF, double room, const Ground& ground);

// The sole lies at a place, at rest; of a contact at a point only the point does. It may be off as far as the region goes, and
// it comes down at `speed`, m/s.
void addLanding(const Model& model, const RobotSize& size, int contact, const SE3& X_WF, const LandingRegion& region,
                double speed, StageSpec& stage);

// How far from its foothold a foot may land with this stage, along x and y, m; infinite where the stage has no landing of it.
double getLandingRoom(int contact, const StageSpec& stage);

// All corners of the sole are at least `least` m over the ground, whose steps have ramps (makeSoleClearance).
void addClearance(const Model& model, const RobotSize& size, int contact, const Ground& ground, double ramp,
                  double least, StageSpec& stage);
// Whether check and motion ask for full clearance at node i of n in the air: in the middle half.
inline bool isMidSwing(int i, int n) { return 4 * i >= n && 4 * i <= 3 * n; }
inline constexpr double kMidSwingClearance = 6e-3;  // m
// A foot that is about to land, or lands, finds its ground lower than planned: it goes on down at `speed`, m/s, from and to
// any height, as flat and over the same place as before.
void lowerFoot(const Model& model, int contact, double speed, StageSpec& stage);

// Width of the ramps around steps that leave the soles on the ground free, at most 2 cm, m.
double chooseRamp(const Model& model, const Ground& ground, const std::vector<ContactTarget>& soles);

// A foot in the air stays at least `least` m from a standing one, or from where its path leads, less a centimetre if
// that is nearer. Soles count as capsules: their middle lines, as thick as they are wide.
void addDistance(const RobotSize& size, const ContactFrame& swinging, const SE3& X_path, const ContactFrame& standing,
                 const SE3& X_standing, double least, StageSpec& stage);

// Whether the first body moves freely in a plane: along two axes, and by an angle, its coordinate 2.
inline bool hasPlanarBase(const Model& model) {
  return model.numBodies() > 1 && model.joints()[1].kind == JointKind::Planar;
}

// The motion ends with the centre of mass at rest and without rotation of the torso. With the feet on the ground, all
// other velocities follow from these; constraints on them too would contradict what contacts are off by. Of a robot on
// a rail that leaves the vertical velocity alone, of one in a plane those along it.
void addRest(const Model& model, const RobotSize& size, StageSpec& terminal);

}  // namespace bielle
