#pragma once
/// \file Measured motions: columns over time, from a text of comma-separated values or from a NumPy archive.
#include <string>
#include <vector>

#include "bielle/math/types.h"

namespace bielle {

struct MotionLog {
  std::string path;
  VectorXd time;                   ///< K, s; it does not fall
  std::vector<std::string> names;  ///< of the columns that were asked for and are there
  MatrixXd values;                 ///< K x names, finite, but for what isHeld() says
  std::vector<std::string> rows;   ///< K, where they are in the file: "line 7", "row 5"

  /// Index of a column, -1 if it is not there.
  int find(const std::string& name) const;
  /// Whether each number of a column of torques holds from its row to the next, as those of Bielle's trajectories do: then the last row
  /// has none (NaN).
  bool isHeld(int column) const;
};

/// A text (.csv) has a header of names and a line a row. An archive (.npz) has arrays of K numbers by name, or `q` (K x n) with
/// `q_names` (n), likewise `v` and `u`. Both have `time`; a column `q.NAME` is NAME, those of speeds and torques are `v.NAME` and `u.NAME`,
/// so that a trajectory of Bielle is a log. The last row may lack torques. Columns that are not wanted are not read.
/// \throws InputError naming the file, the line or row, the column and the remedy: what is no finite number, rows of other
///   lengths than the header, names that are given twice, times that fall, fewer than two rows
MotionLog readLog(const std::string& path, const std::vector<std::string>& wanted);

}  // namespace bielle
