#pragma once
// The error message of reading a recorded motion.
#include <string>

#include "bielle/results/result.h"
#include "get_error.h"

namespace bielle::testing {

inline std::string getErrorOfReading(const std::string& path) {
  return getError([&] { readRecord(path); });
}

}  // namespace bielle::testing
