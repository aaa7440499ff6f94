#pragma once
// The error message of reading a recorded motion.
#include <string>

#include "bielle/results/record_files.h"
#include "get_error.h"

namespace bielle::testing {

inline std::string getErrorOfReading(const std::string& path) {
  return getError([&] { readRecord(path); });
}

}  // namespace bielle::testing
