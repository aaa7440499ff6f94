#pragma once
// What a workshop needs of a robot on paper: its mechanism with distances, and a table.
#include <string>

#include "bielle/model/model.h"

namespace bielle {

// The mechanism in the standing posture, an SVG file.
std::string formatSheet(const Model& model);

// kind,of,from,to,value,unit: `length` of links from pivot to pivot (formats/pivots.h), `mass` of links, `ratio`, `motor mass`,
// `largest torque` and `largest speed` of motors, as far as they are known; `from` of these is the type.
std::string formatSheetTable(const Model& model);

}  // namespace bielle
