#pragma once
// The page around the data that its scripts draw.
#include "results/json_text.h"

namespace bielle {

std::string makePage(const Json& data);

}  // namespace bielle
