#pragma once
// Numbers in tables and messages.
#include <string>
#include <vector>

namespace bielle {

// \param format  as of printf, for one double
std::string formatNumber(double value, const char* format = "%.6g");

/// Whether the text is made of finite numbers between white space, which are added to `numbers`.
bool parseNumbers(const std::string& text, std::vector<double>& numbers);

}  // namespace bielle
