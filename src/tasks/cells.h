#pragma once
// Numbers and texts as cells of the tables of reports.
#include <limits>
#include <string>

namespace bielle::tasks {

constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();

// With the given number of decimals; a dash for NaN.
std::string formatCell(double value, int digits);
// A text as a field of a CSV table.
std::string quoteCsv(const std::string& text);

}  // namespace bielle::tasks
