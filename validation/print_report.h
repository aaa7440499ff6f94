#pragma once
// The rows of a cross-validation as text, for what fails.
#include <sstream>
#include <string>

#include "validate.h"

namespace bielle::testing {

inline std::string print(const validation::ValidationReport& report) {
  std::ostringstream text;
  validation::printReport(text, report);
  return text.str();
}

}  // namespace bielle::testing
