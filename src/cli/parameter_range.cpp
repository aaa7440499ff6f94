#include "cli/parameter_range.h"

#include <algorithm>
#include <cmath>

#include "bielle/model/error.h"
#include "model/number_text.h"

namespace bielle::cli {
namespace {

constexpr double kUsualWidth = 0.3;  // on either side of the value, relative to it

double readNumber(const std::string& text, const std::string& number) {
  const OptionValue value = parseOption(number);
  if (const int* whole = std::get_if<int>(&value)) return *whole;
  if (const double* real = std::get_if<double>(&value)) return *real;
  throw InputError("", text, "its range is not given by two numbers", "write NAME=LOW:HIGH");
}

}  // namespace

ParameterRange readParameterRange(const std::string& flag, const std::string& text, const OptionSet& parameters) {
  const size_t equals = text.find('='), colon = text.find(':');
  const Option& option = parameters.get(text.substr(0, equals));
  const double* value = std::get_if<double>(&option.value);
  if (!value)
    throw InputError("", flag + " " + text, "parameter '" + option.name + "' is no number", "name one that is");
  const double width = kUsualWidth * std::abs(*value);
  ParameterRange range{option.name, option.unit, *value, std::max(option.bounds.lower, *value - width),
                       std::min(option.bounds.upper, *value + width)};
  if (equals != std::string::npos) {
    range.low = readNumber(flag + " " + text, text.substr(equals + 1, colon - equals - 1));
    range.high = readNumber(flag + " " + text, colon == std::string::npos ? "" : text.substr(colon + 1));
  }
  if (!(range.low <= *value && *value <= range.high && range.low < range.high))
    throw InputError("", flag + " " + text, "its value, " + formatNumber(*value) + ", is not in the range",
                     "write NAME=LOW:HIGH with LOW below it and HIGH above it");
  return range;
}

}  // namespace bielle::cli
