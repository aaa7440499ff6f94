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
  Multipliers multipliers;  ///< of the constraints, for warm starts; without penalty if they are not known
};

MotionRecord makeRecord(const Motion& motion, const ShootingTrajectory& trajectory);

/// One row per node under one header: time, q.<name>, v.<name>, a.<name>, u.<motor>, closure.<name>.<entry>,
/// contact.<name>.<entry>, com.x, com.y, com.z, gap.position, gap.angle and, of midpoint steps, q_mid.<name> and
/// v_mid.<name>. No stage starts at the last node: its cells of a, u, q_mid, v_mid and of the wrenches are empty.
/// Numbers are the shortest that read back to the same bits. Footholds and multipliers are left out. It is for other
/// programs; Bielle reads the archive below.
void writeCsv(const std::string& path, const MotionRecord& record);

/// NumPy archive of the members above by the same names; wrenches are N x closures x 6 and N x contacts x 6, footholds, if there
/// are any, N + 1 x contacts x 8. Multipliers, if known, are `multipliers` (node after node), `multiplier_rows` (N + 1, how many
/// each node has) and `multiplier_penalty` (1).
void writeNpz(const std::string& path, const MotionRecord& record);

/// Reads an archive that writeNpz() wrote.
/// \throws ModelError naming the file and what is wrong with it, as the writers do when they cannot write
MotionRecord readRecord(const std::string& path);

}  // namespace bielle
