#pragma once
// Help without the program that it is about.
#include <string>
#include <vector>

namespace bielle::cli {

// The help of a companion's command, such as {"generate", "delta"}, or else of the longest command that these words begin with; null
// where there is none.
const std::string* findHelp(const std::vector<std::string>& words);

}  // namespace bielle::cli
