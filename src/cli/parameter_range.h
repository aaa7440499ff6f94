#pragma once
// A parameter of a generated robot with a range, as options give it.
#include <string>

#include "bielle/model/options.h"

namespace bielle::cli {

struct ParameterRange {
  std::string name, unit;
  double value = 0, low = 0, high = 0;
};

inline constexpr const char* kParameterRange = "NAME[=LOW:HIGH]";

// \param flag  in messages   \param text  kParameterRange; without a range, 30 % on either side of the value
// \throws InputError for a parameter that is unknown or no number, and a range without its value
ParameterRange readParameterRange(const std::string& flag, const std::string& text, const OptionSet& parameters);

}  // namespace bielle::cli
