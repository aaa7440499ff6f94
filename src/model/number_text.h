#pragma once
// Numbers in tables and messages.
#include <string>

namespace bielle {

// \param format  as of printf, for one double
std::string formatNumber(double value, const char* format = "%.6g");

}  // namespace bielle
