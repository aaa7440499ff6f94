#pragma once
/// \file Motions as files of OpenSim, which other programs read too: a header, then columns separated by tabs.
#include <string>

#include "bielle/io/record.h"

namespace bielle {

/// Coordinates over time (.mot): time and q by their names, rad and m (inDegrees=no).
std::string formatMot(const MotionRecord& record);

/// Everything over time (.sto): the columns of the CSV (record.h). The last node holds what the last stage did, so that no
/// cell is empty.
std::string formatSto(const MotionRecord& record);

}  // namespace bielle
