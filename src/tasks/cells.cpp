#include "tasks/cells.h"

#include <cmath>

#include "model/number_text.h"

namespace bielle::tasks {

std::string formatCell(double value, int digits) {
  if (!std::isfinite(value)) return "–";
  return formatText("%.*f", digits, value);
}

std::string quoteCsv(const std::string& text) {
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? "\"\"" : std::string(1, c);
  return quoted + "\"";
}

}  // namespace bielle::tasks
