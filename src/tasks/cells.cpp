#include "tasks/cells.h"

#include <charconv>
#include <cmath>
#include <sstream>

namespace bielle::tasks {

std::string formatExact(double value) {
  if (!std::isfinite(value)) return "";
  char text[32];
  return {text, std::to_chars(text, text + sizeof text, value).ptr};
}

std::string formatCell(double value, int digits) {
  if (!std::isfinite(value)) return "–";
  std::ostringstream text;
  text.setf(std::ios::fixed);
  text.precision(digits);
  text << value;
  return text.str();
}

std::string quoteCsv(const std::string& text) {
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? "\"\"" : std::string(1, c);
  return quoted + "\"";
}

}  // namespace bielle::tasks
