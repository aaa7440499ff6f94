#pragma once
// The page around the data that its scripts draw.
#include "results/json_text.h"

namespace bielle {

std::string makePage(const Json& data);

// The page of designs; designs.js says of what the data consist.
std::string makeDesignPage(Json data);

// The page of a data set; dataset.js says of what the data consist.
std::string makeDatasetPage(const Json& data);

}  // namespace bielle
