#pragma once
/// \file Motions as OpenSim files, which other programs also read: a header, then tab-separated columns.
#include <string>

#include "bielle/motion/record.h"

namespace bielle {

/// Coordinates over time (.mot): time and q by their names, rad and m (inDegrees=no).
std::string formatMot(const MotionRecord& record);

/// All columns of the CSV (record.h) over time (.sto). The last node repeats the values of the last stage, so that no
/// cell is empty.
std::string formatSto(const MotionRecord& record);

}  // namespace bielle
