#pragma once
/// \file Motions as OpenSim files, which other programs also read: a header, then tab-separated columns.
#include <string>
#include <vector>

#include "bielle/motion/record.h"

namespace bielle {

/// An impact is a stage that takes no time, and OpenSim refuses tables whose times do not increase: of nodes at one time the
/// last one is written, after the impact.
struct OpensimText {
  std::string text;
  std::vector<std::string> warnings;  ///< of nodes that are left out
};

/// Coordinates over time (.mot): time and q by their names, rad and m (inDegrees=no).
OpensimText formatMot(const MotionRecord& record);

/// All columns of the CSV (record.h) over time (.sto). The last node repeats the values of the last stage, so that no
/// cell is empty.
OpensimText formatSto(const MotionRecord& record);

}  // namespace bielle
