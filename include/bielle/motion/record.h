#pragma once
/// \file A solved motion as numbers: the values at every node, in named columns.
#include <string>
#include <vector>

#include "bielle/motion/motion.h"

namespace bielle {

using RowMatrixXd = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// N stages, N + 1 nodes; one row per node or, for quantities of a stage (from its node to the next), one row per
/// stage. An impact is a stage that takes no time: two rows of equal time, with no acceleration and no forces between
/// them. SI units, orders and frames of notation.h. Numbers of a stage whose dynamics could not be computed are NaN.
struct MotionRecord {
  std::vector<std::string> q_names, v_names;  ///< of coordinates, as names.h gives them
  std::vector<std::string> u_names;           ///< of motors
  std::vector<std::string> closure_names, contact_names;

  VectorXd time;                 ///< N + 1, s
  RowMatrixXd q, v;              ///< N + 1 x nq, N + 1 x nv
  RowMatrixXd a;                 ///< N x nv; of midpoint steps at (q_mid, v_mid), like u and the wrenches
  RowMatrixXd u;                 ///< N x nu, N m or N
  RowMatrixXd closure_wrenches;  ///< N x 6 per closure, on body 1, in frame 1
  RowMatrixXd contact_wrenches;  ///< N x 6 per contact, of the ground on the foot, in its frame; zero in the air
  bool has_midpoints = false;    ///< midpoint steps (robot_problem.h Eq. (2)); else the next two are empty
  RowMatrixXd q_mid, v_mid;      ///< N x nq, N x nv; of an impact, which takes no time, q and v of its node
  RowMatrixXd com;               ///< N + 1 x 3, m
  RowMatrixXd gap;               ///< N + 1 x 2, largest closing error: norms of position (m) and of angle (rad)
  /// Predicted footholds of motions under predictive control, else empty: N + 1 x 8 per contact: time of landing (s),
  /// position (m) and quaternion x, y, z, w of its frame in the world. NaN: no landing within the window.
  RowMatrixXd footholds;
  static constexpr int kFootholdEntries = 8;  ///< columns of `footholds` per contact
  /// Of a motion that repeats (MotionOutline::cycle): its period, s, and where its end is from its beginning: turned about the
  /// vertical through the world's origin by a yaw, then displaced by x and y: period, x, y, yaw. Else empty.
  VectorXd cycle;
  Multipliers multipliers;  ///< of the constraints, for warm starts; without penalty if they are not known
};

/// Without footholds and multipliers.
MotionRecord makeRecord(const Motion& motion, const ShootingTrajectory& trajectory);

/// The data that goal.h measures, from a record of the model's motion.
MotionTrack makeTrack(const Model& model, const MotionRecord& record);

/// Largest displacement of a foot since its contact began.
struct Slip {
  double position = 0, angle = 0;  ///< m, rad
};
Slip calcSlip(const Motion& motion, const MotionTrack& track);

/// Where a solve of a motion begins, from states and torques of a record of the same robot. If the lengths agree, node by
/// node, with the recorded durations where phases are free; otherwise each node takes the recorded one at the same
/// fraction of the duration. If stance feet are more than 0.5 mm away from their places in the new motion, it is mended: the base is
/// moved there, linkages beyond their margins from dead points are led past them, and postures change by as little as feet at their
/// places and closed loops need. Multipliers are those of the record.
/// \throws InputError when the coordinates or motors differ, or the record contains numbers that are not finite
StartingPoint makeStart(const MotionRecord& record, const Motion& motion);

}  // namespace bielle
