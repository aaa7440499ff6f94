#pragma once
// The ground in summary.json.
#include "bielle/dynamics/ground.h"
#include "results/json_text.h"

namespace bielle {

Json describeGround(const Ground& ground);

/// \throws std::exception when something is missing or of another type
Ground readGround(const Json& json);

}  // namespace bielle
